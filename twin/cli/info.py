"""twin info: what an artefact holds and how good it is."""

from __future__ import annotations

from typing import Any

import click


@click.command(epilog="Example: twin info out/five_axis.h5 --json")
@click.argument("artefact", type=click.Path())
@click.option("--json", "as_json", is_flag=True, help="machine-readable")
@click.option("--check", is_flag=True, help="check the file and say what was checked, instead")
def command(artefact: str, as_json: bool, check: bool) -> int:
    """Show orders, poses, parameters with their certified ranges, certificate and provenance of ARTEFACT.

    --check: exit status 0 if it is as it was written and its model can be, 1 if its certificate says that it failed,
    2 if it is damaged. Every command that reads an artefact makes the same checks.
    """
    import json

    from twin.face.model import check_artefact, read

    if check:
        told = check_artefact(artefact)
        certificate = read(artefact).certificate
        failed = certificate.get("passed") is False
        verdict = "above" if failed else "within"
        told = (*told, f"certificate: {f'errors {verdict} the limits of the machine' if certificate else 'none'}")
        click.echo(json.dumps({"checked": told, "failed": failed}, indent=2) if as_json else "\n".join(told))
        return int(failed)
    facts = read(artefact).facts()
    click.echo(json.dumps(facts, indent=2) if as_json else text(facts))
    return 0


def text(told: dict[str, Any]) -> str:
    """The facts as lines for a reader."""
    lines = [f"{told['name']}: {told['states']} states, {told['poses']} poses, {len(told['sensors'])} sensors"]
    lines.append(f"created {told['created']}, model sha256 {told['model_sha256'][:16]}…")
    lines += ["", "bodies"]
    for b in told["bodies"]:
        lines.append(
            f"  {b['name']:<24} {b['states']:4d} states ({b['projection']}), {b['ports']} ports, "
            f"{len(b['sources'])} sources, {len(b['sensors'])} sensors"
        )
    lines += ["", "pose grid"]
    lines += [f"  {axis}: {', '.join(f'{1e3 * v:g}' for v in grid)} mm" for axis, grid in told["pose_grid_m"].items()]
    lines += ["", "signals and their certified ranges"]
    lines += [
        f"  {n:<32} {r['low']:g} .. {r['high']:g} {r['unit']}" for n, r in told["certified_ranges"]["signals"].items()
    ]
    lines += ["", "coefficients and their certified ranges"]
    lines += [f"  {n:<48} {r['low']:g} .. {r['high']:g} {r['unit']}"
              for n, r in told["certified_ranges"]["coefficients"].items()]  # fmt: skip
    lines += ["", "parameters (SI)"]
    lines += [f"  {name:<48} {value:g}" for name, value in told["parameters"].items()]
    lines += ["", "certificate"]
    lines += _certificate(told["certificate"]) or ["  none"]
    lines += ["", "provenance"]
    lines += [f"  {name}: {value}" for name, value in told["provenance"].items()] or ["  none"]
    return "\n".join(lines)


def _certificate(certificate: dict[str, Any]) -> list[str]:
    """One line per entry; tables by their largest value, lists of texts by their number."""
    lines = []
    for name, value in certificate.items():
        if isinstance(value, list):
            numbers = _flat(value)
            if numbers and all(isinstance(v, int | float) for v in numbers):
                value = f"max {max(numbers):.3g} of {len(numbers)}"
            else:
                value = f"{len(value)} entries"
        elif isinstance(value, float):
            value = f"{value:.4g}"
        lines.append(f"  {name}: {value}")
    return lines


def _flat(value: Any) -> list[Any]:
    return [v for item in value for v in _flat(item)] if isinstance(value, list) else [value]

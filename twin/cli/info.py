"""twin info: what an artefact holds and how good it is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from twin.rom.artefact import Artefact


@click.command(epilog="Example: twin info out/five_axis.h5 --json")
@click.argument("artefact", type=click.Path())
@click.option("--json", "as_json", is_flag=True, help="machine-readable")
def command(artefact: str, as_json: bool) -> None:
    """Show orders, poses, parameters with their certified ranges, certificate and provenance of ARTEFACT."""
    import json
    from pathlib import Path

    from twin.rom.artefact import read_artefact

    told = facts(read_artefact(Path(artefact)))
    click.echo(json.dumps(told, indent=2) if as_json else text(told))


def facts(artefact: Artefact) -> dict[str, Any]:
    """Everything `twin info` tells, as JSON values (SI)."""
    model = artefact.model
    load = model.load_model

    def use(owner: str, law: Any) -> dict[str, Any]:
        return {f"{owner}.{name}": value for name, value in law.parameters.items()}

    parameters: dict[str, float] = {}
    for source in load.sources:
        parameters |= use(f"sources.{source.name}", source.use) | {f"sources.{source.name}.gain": source.gain}
    for film in load.films:
        owner = f"films.{film.name}"
        parameters |= use(owner, film.use) | {f"{owner}.gain": film.gain, f"{owner}.emissivity": film.emissivity}
    for joint in load.joints:
        parameters[f"contacts.{joint.name}.{joint.key}"] = joint.conductance
    for pair in load.pairs:
        parameters[f"contacts.{pair.contact}.{pair.key}"] = pair.conductance
    unit = {"conductance": "W/(m^2*K)", "total": "W/K"}
    terms = [*((f"films.{f.name}", f.low, f.high, unit["conductance"]) for f in load.films),
             *((f"contacts.{j.name}.{j.key}", j.low, j.high, unit[j.key]) for j in load.joints)]  # fmt: skip
    return {
        "name": model.name,
        "created": artefact.created,
        "model_sha256": artefact.digest,
        "reference_temperature_degC": model.reference_temperature,
        "states": model.n,
        "bodies": [
            {
                "name": b.name,
                "states": b.n,
                "ports": len(b.ports),
                "sources": [load.sources[i].name for i in b.sources],
                "sensors": [model.sensors[i] for i in b.sensors],
                "projection": "galerkin" if b.symmetric else "oblique",
            }
            for b in model.bodies
        ],
        "poses": len(model.poses),
        "pose_grid_m": {axis: grid.tolist() for axis, grid in zip(model.pose_axes, model.pose_grid, strict=True)},
        "sensors": [*model.sensors, *(name for name, _ in model.ambient_sensors)],
        "parameters": parameters,
        "certified_ranges": {
            "signals": {
                s.name: {"low": s.low, "high": s.high, "unit": s.unit, "column": s.column} for s in load.signals
            },
            "coefficients": {name: {"low": low, "high": high, "unit": u} for name, low, high, u in terms},
        },
        "certificate": {
            name: value if not hasattr(value, "tolist") else value.tolist()
            for name, value in artefact.certificate.items()
        },
        "pictures": [field.body for field in artefact.fields],
        "provenance": artefact.provenance,
    }


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

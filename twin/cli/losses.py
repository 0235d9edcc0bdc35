"""twin losses: the heat of every source, the coefficient of every film, and where they come from."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from twin.machine.explain import Explanation, Load


@click.command(epilog="Example: twin losses models/five_axis --explain sources.x_motor --set x_current='8 A'")
@click.argument("machine", type=click.Path())
@click.option("--explain", "path", help="one of them, for example sources.x_motor, films.bed or contacts.x_guide")
@click.option("--run", "run_folder", type=click.Path(), help="evaluate at every sample of this run folder")
@click.option("--set", "settings", multiple=True, metavar="NAME=VALUE",
              help="a signal, or temperature, surface or ambient of the model; repeatable")  # fmt: skip
@click.option("--json", "as_json", is_flag=True, help="machine-readable")
def command(machine: str, path: str | None, run_folder: str | None, settings: tuple[str, ...], as_json: bool) -> None:
    """Show the heat of the sources and the films of MACHINE, or explain one of them: formula, inputs, source, result.

    Without --run at one load: every signal at the upper bound of its certified range. With --run mean, largest value
    and energy over its samples; powers are averaged, never the signals. Meshes are not read.
    """
    import json
    from pathlib import Path

    from twin.logs.read import read_run
    from twin.machine.explain import explain, load_of, paths
    from twin.machine.load import load_machine

    described = load_machine(Path(machine))
    run = read_run(Path(run_folder)) if run_folder is not None else None
    load = load_of(described, _pairs(settings), run)
    if path is not None:
        one = explain(described, path, load)
        click.echo(json.dumps(_facts(one, load), indent=1) if as_json else _page(one, load))
        return
    every = [explain(described, p, load) for p in paths(described)]
    if as_json:
        told = [_facts(e, load) for e in every]
        click.echo(json.dumps({"load": _load_text(run_folder, settings), "laws": told}, indent=1))
    else:
        click.echo(_tables(every, load, _load_text(run_folder, settings)))


def _pairs(settings: tuple[str, ...]) -> dict[str, str]:
    from twin.errors import TwinError

    pairs = {}
    for setting in settings:
        name, equals, text = setting.partition("=")
        if not equals or not name.strip() or not text.strip():
            raise TwinError(f"'{setting}' sets nothing", "--set", "write --set x_current='8 A', for example")
        pairs[name.strip()] = text.strip()
    return pairs


def _load_text(run: str | None, settings: tuple[str, ...]) -> str:
    base = f"every sample of {run}" if run else "every signal at the upper bound of its certified range"
    return base + (f"; set: {', '.join(settings)}" if settings else "")


def _number(value: float, unit: str) -> str:
    """Numbers as a table shows them, speeds of rotation and of axes in SI."""
    return f"{value:.4g}" + ("" if unit == "1" else f" {unit}")


def _spread(values: Any, unit: str, load: Load) -> str:
    low, high = float(values.min()), float(values.max())
    if high == low:
        return _number(low, unit)
    return f"{_number(load.mean(values), unit)} ({low:.4g} to {high:.4g})"


def _over_time(one: Explanation, load: Load) -> dict[str, float]:
    """Mean and maximum, and of heat its energy."""
    values = _whole(one.value, load)
    told = {"mean": load.mean(values), "max": float(values.max())}
    if one.unit == "W":
        told["energy_J"] = told["mean"] * float(load.time[-1] - load.time[0])
    return told


def _whole(values: Any, load: Load) -> Any:
    import numpy as np

    return np.broadcast_to(values, load.time.shape)


def _holds(one: Explanation, load: Load) -> str:
    if not one.validity:
        return "no published limits"
    outside = int((~_whole(one.holds, load)).sum())
    n = len(load.time)
    if n == 1:
        return f"{one.validity}: {'does NOT hold' if outside else 'holds'}"
    return f"{one.validity}: " + (f"does NOT hold at {outside} of {n} samples" if outside else "holds at every sample")


def _page(one: Explanation, load: Load) -> str:
    """One law with all its inputs."""
    lines = [f"{one.path}: {one.law or 'a given value'}", f"  formula   {one.formula}", f"  source    {one.citation}"]
    lines.append(f"  acts on   {one.place}")
    width = max(len(i.name) for i in one.inputs)
    shown = [_spread(_whole(i.value, load), i.unit, load) for i in one.inputs]
    wide = max(len(s) for s in shown)
    lines.append("  inputs")
    lines += [f"    {i.name:<{width}}  {s:<{wide}}  {i.meaning}; {i.origin}"
              for i, s in zip(one.inputs, shown, strict=True)]  # fmt: skip
    if one.law:
        lines.append(f"  validity  {_holds(one, load)}")
    lines.append(f"  result    {_result(one, load)}")
    return "\n".join(lines)


def _result(one: Explanation, load: Load) -> str:
    if one.radiation is not None:
        convection, radiation = _whole(one.value, load), _whole(one.radiation, load)
        parts = f"{_spread(convection, one.unit, load)} convection + {_spread(radiation, one.unit, load)} radiation"
        return parts + f" = {_spread(convection + radiation, one.unit, load)}"
    if len(load.time) == 1:
        return _number(float(one.value[0]), one.unit)
    told = _over_time(one, load)
    text = f"mean {_number(told['mean'], one.unit)}, largest {_number(told['max'], one.unit)}"
    hours = float(load.time[-1] - load.time[0]) / 3600
    return text + (f", {told['energy_J'] / 3600:.4g} Wh in {hours:.3g} h" if "energy_J" in told else "")


def _tables(every: list[Explanation], load: Load, at: str) -> str:
    """Sources, films and joints, one line each."""
    from twin.machine.explain import WARMER

    many = len(load.time) > 1
    lines = [f"load: {at}"]
    sources = [e for e in every if e.kind == "source"]
    if sources:
        head = ["source", "law", "mean [W]", "max [W]", "energy [Wh]"] if many else ["source", "law", "heat [W]"]
        told = [_over_time(e, load) for e in sources]
        rows = [[e.path.partition(".")[2], e.law, *_columns(t, many)] for e, t in zip(sources, told, strict=True)]
        whole = _columns({key: sum(t[key] for t in told) for key in told[0]}, many)
        if many:
            whole[1] = ""  # largest values do not come together
        lines += ["", *_aligned([head, *rows, ["all", "", *whole]])]
    films = [e for e in every if e.kind == "film"]
    if films:
        air = "" if {"surface", "ambient"} & set(load.states) else f", surfaces {WARMER:g} K above their environment"
        lines += ["", f"films, W/(m^2*K){', mean' if many else ''}{air}:"]
        rows = [
            [e.path.partition(".")[2], e.law, *(f"{load.mean(_whole(v, load)):.4g}" for v in _parts(e))] for e in films
        ]
        lines += _aligned([["film", "law", "convection", "radiation", "both"], *rows])
    joints = [e for e in every if e.kind == "contact" and e.law]
    if joints:
        rows = [[e.path.partition(".")[2], e.law, f"{float(e.value[0]):.4g}"] for e in joints]
        lines += ["", *_aligned([["joint", "law", "W/(m^2*K)"], *rows])]
    assumed = [e.path for e in every if e.citation.startswith("assumed")]
    if assumed:
        lines += ["", f"assumed values: {', '.join(assumed)}"]
    broken = [e for e in every if not e.holds.all()]
    if broken:
        lines += ["", "outside the validity of their laws:", *(f"  {e.path}: {_holds(e, load)}" for e in broken)]
    return "\n".join(lines)


def _parts(film: Explanation) -> list[Any]:
    return [film.value, film.radiation, film.value + film.radiation]


def _columns(told: dict[str, float], many: bool) -> list[str]:
    if not many:
        return [f"{told['mean']:.4g}"]
    return [f"{told['mean']:.4g}", f"{told['max']:.4g}", f"{told['energy_J'] / 3600:.4g}"]


def _aligned(rows: list[list[str]]) -> list[str]:
    """Names to the left, numbers to the right."""
    widths = [max(len(row[c]) for row in rows) for c in range(len(rows[0]))]
    lines = []
    for row in rows:
        cells = [t.ljust(w) if c < 2 else t.rjust(w) for c, (t, w) in enumerate(zip(row, widths, strict=True))]
        lines.append("  ".join(cells).rstrip())
    return lines


def _facts(one: Explanation, load: Load) -> dict[str, Any]:
    """As JSON, SI."""
    told: dict[str, Any] = {"path": one.path, "kind": one.kind, "law": one.law or None, "formula": one.formula,
                            "source": one.citation, "acts_on": one.place, "unit": one.unit}  # fmt: skip
    told["inputs"] = [
        {"name": i.name, "unit": i.unit, "meaning": i.meaning, "origin": i.origin, **_statistics(i.value, load)}
        for i in one.inputs
    ]
    told["result"] = _over_time(one, load) if len(load.time) > 1 else {"value": float(one.value[0])}
    if one.radiation is not None:
        told["radiation"] = _statistics(one.radiation, load)
    told["validity"] = one.validity or None
    told["holds"] = bool(one.holds.all())
    told["samples_outside"] = int((~_whole(one.holds, load)).sum())
    return told


def _statistics(values: Any, load: Load) -> dict[str, float]:
    whole = _whole(values, load)
    if float(whole.min()) == float(whole.max()):
        return {"value": float(whole[0])}
    return {"mean": load.mean(whole), "min": float(whole.min()), "max": float(whole.max())}

"""twin losses: the heat of every source, the coefficient of every film, and where they come from."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from twin.face.losses import over_time, whole

if TYPE_CHECKING:
    from twin.machine.explain import Explanation, Load


@click.command(epilog="Example: twin losses models/five_axis --explain sources.x_motor --set x_current='8 A'")
@click.argument("machine", type=click.Path())
@click.option("--explain", "path", help="one of them, for example sources.x_motor, films.bed or contacts.x_guide")
@click.option("--run", "run_folder", type=click.Path(), help="evaluate at every sample of this run folder")
@click.option("--set", "settings", multiple=True, metavar="NAME=VALUE",
              help="a signal, or temperature, surface or ambient of the model (signals.ambient, model.ambient where "
                   "there are both); repeatable")  # fmt: skip
@click.option("--json", "as_json", is_flag=True, help="machine-readable")
def command(machine: str, path: str | None, run_folder: str | None, settings: tuple[str, ...], as_json: bool) -> None:
    """Show the heat of the sources and the films of MACHINE, or explain one of them: formula, inputs, source, result.

    Without --run at one load: every signal at the upper bound of its certified range. With --run mean, largest value
    and energy over its samples; powers are averaged, never the signals. Meshes are not read.
    """
    import json

    from twin.face.losses import losses

    found = losses(machine, path, run_folder, _pairs(settings))
    if path is not None:
        click.echo(json.dumps(found.facts()[0], indent=1) if as_json else _page(found.laws[0], found.load))
        return
    at = _load_text(run_folder, settings)
    if as_json:
        click.echo(json.dumps({"load": at, "laws": found.facts()}, indent=1))
    else:
        click.echo(_tables(list(found.laws), found.load, at))


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


def _holds(one: Explanation, load: Load) -> str:
    if not one.validity:
        return "no published limits"
    outside = int((~whole(one.holds, load)).sum())
    n = len(load.time)
    if n == 1:
        return f"{one.validity}: {'does NOT hold' if outside else 'holds'}"
    return f"{one.validity}: " + (f"does NOT hold at {outside} of {n} samples" if outside else "holds at every sample")


def _page(one: Explanation, load: Load) -> str:
    """One law with all its inputs."""
    lines = [f"{one.path}: {one.law or 'a given value'}", f"  formula   {one.formula}", f"  source    {one.citation}"]
    lines.append(f"  acts on   {one.place}")
    width = max(len(i.name) for i in one.inputs)
    shown = [_spread(whole(i.value, load), i.unit, load) for i in one.inputs]
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
        convection, radiation = whole(one.value, load), whole(one.radiation, load)
        parts = f"{_spread(convection, one.unit, load)} convection + {_spread(radiation, one.unit, load)} radiation"
        return parts + f" = {_spread(convection + radiation, one.unit, load)}"
    if len(load.time) == 1:
        return _number(float(one.value[0]), one.unit)
    told = over_time(one, load)
    text = f"mean {_number(told['mean'], one.unit)}, largest {_number(told['max'], one.unit)}"
    hours = float(load.time[-1] - load.time[0]) / 3600
    return text + (f", {told['energy_J'] / 3600:.4g} Wh in {hours:.3g} h" if "energy_J" in told else "")


def _tables(every: list[Explanation], load: Load, at: str) -> str:
    """Sources, films and joints, one line each; then what is assumed, and where laws do not hold."""
    of = {kind: [e for e in every if e.kind == kind] for kind in ("source", "film", "contact")}
    lines = [f"load: {at}"]
    lines += _source_table(of["source"], load)
    lines += _film_table(of["film"], load)
    lines += _joint_table([e for e in of["contact"] if e.law])
    assumed = [e.path for e in every if e.citation.startswith("assumed")]
    if assumed:
        lines += ["", f"assumed values: {', '.join(assumed)}"]
    broken = [e for e in every if not e.holds.all()]
    if broken:
        lines += ["", "outside the validity of their laws:", *(f"  {e.path}: {_holds(e, load)}" for e in broken)]
    return "\n".join(lines)


def _name(one: Explanation) -> str:
    return one.path.partition(".")[2]


def _source_table(sources: list[Explanation], load: Load) -> list[str]:
    if not sources:
        return []
    many = len(load.time) > 1
    head = ["source", "law", "mean [W]", "max [W]", "energy [Wh]"] if many else ["source", "law", "heat [W]"]
    told = [over_time(e, load) for e in sources]
    rows = [[_name(e), e.law, *_columns(t, many)] for e, t in zip(sources, told, strict=True)]
    total = _columns({key: sum(t[key] for t in told) for key in told[0]}, many)
    if many:
        total[1] = ""  # largest values do not come together
    return ["", *_aligned([head, *rows, ["all", "", *total]])]


def _film_table(films: list[Explanation], load: Load) -> list[str]:
    from twin.machine.explain import WARMER

    if not films:
        return []
    mean = ", mean" if len(load.time) > 1 else ""
    air = "" if {"surface", "ambient"} & set(load.states) else f", surfaces {WARMER:g} K above their environment"
    rows = [[_name(e), e.law, *(f"{load.mean(whole(v, load)):.4g}" for v in _parts(e))] for e in films]
    head = ["film", "law", "convection", "radiation", "both"]
    return ["", f"films, W/(m^2*K){mean}{air}:", *_aligned([head, *rows])]


def _joint_table(joints: list[Explanation]) -> list[str]:
    if not joints:
        return []
    rows = [[_name(e), e.law, f"{float(e.value[0]):.4g}"] for e in joints]
    return ["", *_aligned([["joint", "law", "W/(m^2*K)"], *rows])]


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

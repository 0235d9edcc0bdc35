"""The short table of `twin score`: the worst sensors, the TCP beside its baselines, and what was not compared."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from twin.calibrate.score.baselines import NAMES
from twin.calibrate.score.bootstrap import Difference
from twin.calibrate.score.metrics import Figures
from twin.calibrate.score.score import HOLD_FIRST, MODEL, REGRESSION, VECTOR, Entry, Score

WORST = 5
MOST_SEGMENTS = 12


def score_text(score: Score, artefact: str) -> str:
    """Lines for the terminal; temperatures in K, deviations in um."""
    lines: list[str] = []
    for part in ("scored", "sealed"):
        runs = [r for r in score.runs if r.part == part]
        if not runs:
            continue
        noun = "run" if len(runs) == 1 else "runs"
        lines.append(f"{artefact} on {len(runs)} {'sealed ' if part == 'sealed' else ''}{noun}")
        entries = [e for e in score.entries if e.part == part]
        lines += _temperatures([e for e in entries if e.kind == "temperature"])
        lines += _tcp([e for e in entries if e.kind == "tcp"])
        if part in score.difference:
            name = score.best[part]
            lines.append(_difference(score.difference[part], f"{name} (the best baseline, in hindsight)"))
            if part in score.regression and name != REGRESSION:
                lines.append(_difference(score.regression[part], REGRESSION))
    lines += [f"  {name}: {how}" for name, how in score.known if name != "zero"]
    lines += _notes(score)
    return "\n".join(lines)


def _temperatures(entries: Sequence[Entry]) -> list[str]:
    pooled = {(e.output, e.method): e.figures for e in entries if not e.run}
    if not pooled:
        return ["  no temperatures to compare"]
    whole, held = pooled["", MODEL], pooled["", HOLD_FIRST]
    sensors = sorted(
        (name for name, method in pooled if name and method == MODEL), key=lambda name: -pooled[name, MODEL].rms
    )
    shown = sensors[:WORST]
    width = max(len(name) for name in (*shown, "first value held"))
    named = "the sensor" if len(sensors) == 1 else f"the worst of {len(sensors)} sensors"
    lines = [
        f"  temperatures [K], {named}",
        f"    {'':<{width}}  {'rms':>7}  {'largest':>7}  {'p2p':>7}  % of rise  share %",
    ]
    lines += [_temperature(name, pooled[name, MODEL], width) for name in shown]
    lines += [_temperature("all", whole, width), _temperature("first value held", held, width)]
    return lines


def _temperature(name: str, f: Figures, width: int) -> str:
    told = f"    {name:<{width}}  {f.rms:7.3f}  {f.max_abs:7.3f}  {f.p2p:7.3f}  {_number(f.percent_of_max, 9)}"
    return f"{told}  {_number(None if f.share is None else 100.0 * f.share, 7)}"


def _tcp(entries: Sequence[Entry]) -> list[str]:
    pooled = {(e.output, e.method): e.figures for e in entries if not e.run}
    if not pooled:
        return ["  no TCP measurements to compare"]
    axes = [a for a in ("dx", "dy", "dz") if (a, MODEL) in pooled]
    vector = pooled.get((VECTOR, MODEL))
    rows = f"{vector.n} measurements, each predicted before it is used" if vector else "incomplete measurements"
    lines = [f"  TCP [um], {rows}"]
    header = "".join(f"  {'rms ' + a:>7}" for a in axes) + f"  {'rms all':>7}  {'largest':>7}"
    header += "".join(f"  {'p2p ' + a:>7}" for a in axes) + f"  {'fit %':>7}  {'share %':>7}"
    lines.append(f"    {'':<16}{header}")
    for method in (MODEL, *NAMES):
        if (axes[0], method) in pooled:
            lines.append(_tcp_line(method, [pooled[a, method] for a in axes], pooled.get((VECTOR, method))))
    return lines + _segments(entries)


def _segments(entries: Sequence[Entry]) -> list[str]:
    segments = [e for e in entries if e.run and e.output == VECTOR and e.method == MODEL]
    if len(segments) < 2:
        return []
    if len(segments) > MOST_SEGMENTS:
        return [f"    {len(segments)} segments: see -o or --json"]
    lines = ["    model by segment"]
    for e in segments:
        own = [f.figures for f in entries if (f.run, f.segment, f.method) == (e.run, e.segment, MODEL)]
        label = e.run.rstrip("/").split("/")[-1] if e.segment == "all" else e.segment
        lines.append(_tcp_line(label, own[:-1], own[-1], "      "))
    return lines


def _tcp_line(name: str, axes: Sequence[Figures], vector: Figures | None, indent: str = "    ") -> str:
    line = f"{indent}{name:<{20 - len(indent)}}" + "".join(f"  {1e6 * f.rms:7.2f}" for f in axes)
    line += f"  {1e6 * vector.rms:7.2f}  {1e6 * vector.max_abs:7.2f}" if vector else f"  {'-':>7}  {'-':>7}"
    line += "".join(f"  {_number(None if f.p2p is None else 1e6 * f.p2p, 7, 2)}" for f in axes)
    share = None if vector is None or vector.share is None else 100.0 * vector.share
    return line + f"  {_number(vector.fit if vector else None, 7)}  {_number(share, 7)}"


def _difference(found: Difference, name: str) -> str:
    told = f"  model - {name}: {1e6 * found.value:+.2f} um rms"
    if found.low is None or found.high is None:
        return f"{told}; too few measurements for an interval ({found.rows} in blocks of {found.block})"
    return f"{told}, 95 % between {1e6 * found.low:+.2f} and {1e6 * found.high:+.2f} (blocks of {found.block} rows)"


def _notes(score: Score) -> list[str]:
    """What was not compared, and what stands on other ground than it may seem."""
    lines = []
    if score.air:
        lines.append(f"  not scored, for the model reads them: {', '.join(score.air)}")
    for told in score.runs:
        lost = told.left_out
        notes = [
            f"{n} {what}"
            for n, what in (
                (lost.temperature_rows, "rows of temperatures.csv outside the simulated time"),
                (lost.tcp_rows, "rows of tcp.csv outside the simulated time"),
                (lost.tcp_incomplete, "rows of tcp.csv without position or deviation"),
                (lost.tcp_outside_grid, "rows of tcp.csv beyond the poses"),
                (told.outside_segments, "rows of tcp.csv in no segment"),
                (told.flagged_steps, f"of {told.steps} steps outside what was certified: {_named(told.flags)}"),
            )
            if n
        ]
        if lost.unknown:
            notes.append(f"sensors that the machine lacks: {', '.join(lost.unknown)}")
        computed = [t for t in told.synthetic if t != "loads"]
        if computed:
            notes.append(f"computed, not measured: {', '.join(computed)}")
        lines += [f"  {told.run}: {note}" for note in notes]
    return lines


def _number(value: float | None, width: int, digits: int = 1) -> str:
    """Right-aligned; '-' where it is not defined or not quotable."""
    return f"{'-':>{width}}" if value is None else f"{value:{width}.{digits}f}"


def _named(flags: Mapping[str, int]) -> str:
    """The three that hold most often."""
    return ", ".join(f"{name} ({n})" for name, n in list(flags.items())[:3])

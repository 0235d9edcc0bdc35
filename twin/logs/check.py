"""What is odd about a run. Found and reported, never repaired in silence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from twin.errors import Problem
from twin.logs.clocks import clock_problems
from twin.logs.currents import current_problems
from twin.logs.faults.find import faults_of
from twin.logs.faults.tell import fault_problems
from twin.logs.found import at, warning
from twin.logs.motion import motion_problems
from twin.logs.refuse import refusals, tables_of, usual_step
from twin.logs.run import Run
from twin.logs.sampling_rule import Needed
from twin.logs.shift import drive_shifts, table_shifts
from twin.logs.signals import SignalLike, read_from_temperatures, signal_problems
from twin.logs.slips import range_problems, slip_problems, stroke_problems, temperature_slips
from twin.logs.stuck import stuck_loads
from twin.logs.values import value_problems
from twin.nearest import did_you_mean, nearest


def check_run(
    run: Run,
    signals: Sequence[SignalLike] = (),
    axes: Sequence[str] = (),
    sensors: Sequence[str] = (),
    core: Needed | None = None,
    strokes: Mapping[str, tuple[float, float]] | None = None,
) -> list[Problem]:
    """Errors, which no verb runs with, and warnings, of a run as `twin.logs.read.parse_run` gives it.

    signals: the load channels that must be there, with their certified ranges; axes: names of the linear axes that
    tcp.csv must tell the position of; sensors: names that the columns of temperatures.csv should have; core: the
    sampling that the limits of the axes ask for; strokes: of the axes [m].

    Errors are those of `refusals` and `signal_problems`, and axes without a position. What is found by comparing
    channels is a warning, and not looked for while times are in disorder.
    """
    with np.errstate(all="ignore"):  # a damaged log may hold any number
        return _check(run, signals, axes, sensors, core, strokes or {})


def _check(
    run: Run,
    signals: Sequence[SignalLike],
    axes: Sequence[str],
    sensors: Sequence[str],
    core: Needed | None,
    strokes: Mapping[str, tuple[float, float]],
) -> list[Problem]:
    refused = refusals(run)
    problems = [*signal_problems(run, signals), *refused]
    wanted = {s.column for s in signals}
    read = read_from_temperatures(run, signals)
    apart = ("offset", "offset_or_warm")  # of a coolant from the machine, which is none
    faults = [f for f in ([] if refused else faults_of(run)) if f.kind not in apart or not read.issuperset(f.channels)]
    for name, table in tables_of(run).items():
        where = str(run.folder / f"{name}.csv")
        problems += clock_problems(run, name, table, where)
        told = {c for f in faults if f.table == name and not f.kind.startswith("offset") for c in f.channels}
        problems += value_problems(table, where, name, wanted if name == "loads" else (), told)
    problems += range_problems(run, signals)
    problems += temperature_slips(run)
    problems += current_problems(run, signals)
    problems += stroke_problems(run, strokes)
    problems += _slow(run, core)
    if not refused:
        where = str(run.folder / "loads.csv")
        problems += motion_problems(run.loads, where)
        problems += slip_problems(run, signals, where)
        problems += drive_shifts(run.loads, where)
        problems += stuck_loads(run.loads, where)
        problems += fault_problems(run, faults)
        problems += table_shifts(run)
        problems += _beyond(run)
    return [*problems, *_names(run, axes, sensors, read)]


def _beyond(run: Run) -> list[Problem]:
    """Measured rows before and after all loads, which no verb compares with anything."""
    problems = []
    first, last, step = run.loads.time[0], run.loads.time[-1], usual_step(run.loads)
    for name, time in ((n, t.time) for n, t in tables_of(run).items() if n != "loads"):
        outside = np.flatnonzero((time < first - step) | (time > last + step))
        if len(outside):
            what = (
                f"{len(outside)} of {len(time)} rows lie outside the loads' {first:g} .. {last:g} s, and are not used"
            )
            where = at(str(run.folder / f"{name}.csv"), outside)
            problems.append(warning(what, where, "is loads.csv complete? else cut these rows"))
    return problems


def _names(run: Run, axes: Sequence[str], sensors: Sequence[str], read: set[str]) -> list[Problem]:
    """Columns of temperatures.csv and tcp.csv that the machine does not know, or misses; read: those of signals."""
    problems = []
    if run.temperatures is not None and sensors:
        where = str(run.folder / "temperatures.csv")
        unknown = [c for c in run.temperatures.columns if c not in sensors and c not in read]
        problems += [
            warning(f"column '{c}' is no sensor of the machine", where, did_you_mean(c, sensors, "sensors"))
            for c in unknown
        ]
        logged = {*run.temperatures.columns, *run.loads.columns, *(nearest(c, sensors) for c in unknown)}
        if missing := [s for s in sensors if s not in logged]:
            what = f"no column of {'sensor' if len(missing) == 1 else 'sensors'} {', '.join(map(repr, missing))}"
            remedy = did_you_mean(missing[0], list(run.temperatures.columns), "columns")
            problems.append(warning(what, where, f"{remedy}; what is not measured is not compared"))
    if run.tcp is not None:
        where = str(run.folder / "tcp.csv")
        problems += [
            Problem(f"no position of axis '{a}'", where, did_you_mean(a, run.tcp.axes, "axis columns"))
            for a in axes
            if a not in run.tcp.axes
        ]
    return problems


def _slow(run: Run, core: Needed | None) -> list[Problem]:
    """A log slower than the rule of paper 001: one warning that says what it costs and what it does not."""
    usual = usual_step(run.loads)
    if core is None or usual <= 1.01 * core.interval:
        return []
    cost = {
        "position": "which rail segment a load falls on is known only on the average over that time",
        "speed": "losses in each rail segment are known only on the average over that time",
        "current": "peaks between two rows are missed",
    }[core.quantity]
    return [
        warning(
            f"loads are logged every {usual:g} s, the axes' limits ask for {core}",
            str(run.folder / "loads.csv"),
            f"{cost}; heat is right if rows are means (rms currents, mean magnitudes of speeds, mean powers), not"
            f" single samples: `twin unpack FILE -o RUN --mean '{usual:g} s'` makes such means of a fast log",
        )
    ]

"""What is odd about a run. Found and reported, never repaired in silence."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from twin.errors import Problem
from twin.logs.motion import motion_problems
from twin.logs.run import Run, Table
from twin.logs.sampling_rule import Needed
from twin.logs.signals import SignalLike, signal_problems
from twin.nearest import did_you_mean

_GAP = 5.0  # median spacings; the runtime flags the same
_PLAUSIBLE = (-40.0, 200.0)  # degC in a workshop


def check_run(
    run: Run,
    signals: Sequence[SignalLike] = (),
    axes: Sequence[str] = (),
    sensors: Sequence[str] = (),
    core: Needed | None = None,
) -> list[Problem]:
    """Errors (times that do not increase, missing signals) and warnings (gaps, constant zeros, odd clocks) of a run.

    signals: the load channels that must be there, with their certified ranges; axes: names of the linear axes that
    tcp.csv must tell the position of; sensors: names that the columns of temperatures.csv should have; core: the
    sampling that the limits of the axes ask for.
    """
    problems = [*signal_problems(run, signals)]
    tables = {"loads": run.loads}
    if run.temperatures is not None:
        tables["temperatures"] = run.temperatures
    if run.tcp is not None:
        columns = {**{a: run.tcp.position[:, k] for k, a in enumerate(run.tcp.axes)},
                   **{d: run.tcp.displacement[:, k] for k, d in enumerate(("dx", "dy", "dz"))}}  # fmt: skip
        tables["tcp"] = Table(run.tcp.time, columns, dict.fromkeys(columns, "m"), run.tcp.naive)
    for name, table in tables.items():
        where = str(run.folder / f"{name}.csv")
        problems += _time(table, where, name, run.sampling if name == "loads" else None)
        problems += _values(table, where, name)
        if name != "loads":
            problems += _overlap(table, run.loads, where)
    problems += _ranges(run, signals)
    problems += _slow(run, core)
    if not any(p for p in problems if not p.warning):
        problems += motion_problems(run.loads, str(run.folder / "loads.csv"))
    if run.temperatures is not None and sensors:
        problems += [
            Problem(
                f"column '{c}' is no sensor of the machine", str(run.folder / "temperatures.csv"),
                did_you_mean(c, sensors, "sensors"), warning=True,
            )
            for c in run.temperatures.columns if c not in sensors
        ]  # fmt: skip
    if run.tcp is not None:
        problems += [
            Problem(
                f"no position of axis '{a}'", str(run.folder / "tcp.csv"), did_you_mean(a, run.tcp.axes, "axis columns")
            )
            for a in axes
            if a not in run.tcp.axes
        ]
    return problems


def _time(table: Table, where: str, name: str, sampling: float | None) -> list[Problem]:
    problems = []
    if table.naive:
        remedy = "they are read in the zone of run.toml; log the offset, for clocks change twice a year"
        problems.append(Problem("times without a zone", where, remedy, warning=True))
    step = np.diff(table.time)
    for odd, what, remedy in (
        (step < 0.0, "time runs backwards", "sort the rows, or split the log where its clock was set"),
        (step == 0.0, "the same time twice", "remove duplicated rows"),
    ):
        if odd.any():
            line = int(np.argmax(odd)) + 3
            problems.append(Problem(f"{what}, {_times(int(odd.sum()))}", f"{where} (line {line})", remedy))
    forward = step[step > 0.0]
    if len(forward) == 0:
        return problems
    usual = float(np.median(forward))
    gaps = np.flatnonzero(step > _GAP * usual)
    if len(gaps) and name != "tcp":  # measurements come when they come
        longest = gaps[np.argmax(step[gaps])]
        what = f"{_times(len(gaps))} a gap, the longest {step[longest]:g} s where {usual:g} s are usual"
        remedy = "loads are held over a gap and the result is flagged; fill it if you can"
        problems.append(Problem(what, f"{where} (line {longest + 3})", remedy, warning=True))
    if sampling and not 0.9 < usual / sampling < 1.1:
        problems.append(
            Problem(f"rows are {usual:g} s apart, run.toml says {sampling:g} s", where,
                    "a factor 1000 is milliseconds: mend 'time [s]' or sampling", warning=True)
        )  # fmt: skip
    return problems


def _slow(run: Run, core: Needed | None) -> list[Problem]:
    """A log slower than the rule of paper 001: one warning that says what it costs and what it does not."""
    step = np.diff(run.loads.time)
    if core is None or not (step > 0.0).any():
        return []
    usual = float(np.median(step[step > 0.0]))
    if usual <= 1.01 * core.interval:
        return []
    cost = {
        "position": "which rail segment a load falls on is known only on the average over that time",
        "speed": "losses in each rail segment are known only on the average over that time",
        "current": "peaks between two rows are missed",
    }[core.quantity]
    return [
        Problem(
            f"loads are logged every {usual:g} s, the axes' limits ask for {core}",
            str(run.folder / "loads.csv"),
            f"{cost}; heat is right if rows are means (rms currents, mean magnitudes of speeds, mean powers), not"
            f" single samples: `twin unpack FILE -o RUN --mean '{usual:g} s'` makes such means of a fast log",
            warning=True,
        )
    ]


def _times(n: int) -> str:
    return "once" if n == 1 else f"{n} times"


def _values(table: Table, where: str, name: str) -> list[Problem]:
    problems = []

    def warn(what: str, remedy: str) -> None:
        problems.append(Problem(what, where, remedy, warning=True))

    for column, values in table.columns.items():
        finite = np.isfinite(values)
        good = values[finite]
        if not len(good):
            problems.append(
                Problem(f"column '{column}' has no value at all", where, "check the channel, or remove the column")
            )
            continue
        if not finite.all():
            line = int(np.argmin(finite)) + 2
            warn(f"column '{column}' lacks {int((~finite).sum())} of {len(values)} values, first in line {line}",
                 "the last value is held and the result flagged")  # fmt: skip
        if len(values) >= 10 and not good.any() and name != "tcp":
            warn(f"column '{column}' is zero throughout", "is the channel connected and the header right?")
        elif name == "temperatures" and len(values) >= 100 and np.ptp(good) == 0.0:
            warn(
                f"column '{column}' never changes ({good[0]:g} degC)", "a stuck or detached sensor? leave it out if so"
            )
        if table.units[column] == "degC" and (good.min() < _PLAUSIBLE[0] or good.max() > _PLAUSIBLE[1]):
            warn(f"column '{column}' spans {good.min():g} .. {good.max():g} degC", "check the unit: degC, degF or K?")
    return problems


def _overlap(table: Table, loads: Table, where: str) -> list[Problem]:
    if table.time[0] <= loads.time.max() and table.time[-1] >= loads.time.min():
        return []
    return [
        Problem(
            f"times {table.time[0]:g} .. {table.time[-1]:g} s lie outside the loads'"
            f" {loads.time[0]:g} .. {loads.time[-1]:g} s",
            where,
            "check start and zone in run.toml: all tables count from there",
        )
    ]


def _ranges(run: Run, signals: Sequence[SignalLike]) -> list[Problem]:
    problems = []
    for s in signals:
        if run.loads.units.get(s.column) != s.unit:
            continue
        values = run.loads.columns[s.column] / (np.sqrt(2.0) if s.kind == "peak" else 1.0)
        margin = 1e-9 * max(abs(s.low), abs(s.high))
        with np.errstate(invalid="ignore"):
            outside = int(np.count_nonzero((values < s.low - margin) | (values > s.high + margin)))
        if outside:
            problems.append(
                Problem(
                    f"'{s.column}' spans {np.nanmin(values):g} .. {np.nanmax(values):g} {s.unit},"
                    f" {outside} rows outside {s.low:g} .. {s.high:g}",
                    str(run.folder / "loads.csv"),
                    "results there are flagged: check the unit, or widen the signal's range and build again",
                    warning=True,
                )
            )
    return problems

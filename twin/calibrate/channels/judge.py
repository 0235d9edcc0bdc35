"""All that is wrong with the temperature channels of several runs, and the runs without those readings."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from twin.calibrate.channels.filled import driven
from twin.calibrate.channels.finding import Finding, What
from twin.calibrate.channels.readings import EMPTIED, STUCK, emptied, readings
from twin.calibrate.channels.refute import nothing, refuted
from twin.logs.faults.fault import Fault
from twin.logs.run import Run
from twin.logs.stuck import frozen_throughout

# Of normal noise: how far a reading typically (median) departs from the mean of its neighbours, in standard deviations
_DEPARTS = 0.6745 * 1.5**0.5
KNOWN = 0.5  # K, half of a 95 % interval: the tolerance of a good sensor (class B of IEC 60751 at 40 degC)
NEAR = 1200.0  # s about the start of a swap: two bins of the judgement
BESIDE = 3600.0  # s before and after a leap that are compared: bins in which leaps are found last 10 min to 1 h


@dataclass(frozen=True)
class Judgement:
    """What is wrong with the channels of runs."""

    findings: tuple[Finding, ...]  # single channels, in the order of what is surest
    splices: tuple[tuple[int, Fault], ...]  # number of the run, and from where on its rows are of another time
    leaps: tuple[tuple[int, str], ...]  # number of the run and channel of every leap, once for each
    warm: tuple[Finding, ...] = ()  # channels of places that are warmer or colder than the others at all times


def judge(
    runs: Sequence[Run], within: Collection[str] | None = None, sensors: Collection[str] | None = None,
    explained: Callable[[Finding], bool] = nothing,
) -> Judgement:  # fmt: skip
    """Find broken and stuck channels and splices in each run, then what all channels together say of each of them.

    within: columns that may be judged, all temperatures by default; all take part as witnesses. sensors: of which an
    offset in all runs is a fault, all columns by default: of those that no model has nothing says how warm their place
    may be (of a real spindle one of 16 is 7 K above the others at all times). explained: whether something else than
    the others explains what these refute. Nothing is changed.
    """
    found = judged([emptied(run) for run in runs], within, explained)
    measured = sum(run.temperatures is not None for run in runs)
    return found if sensors is None else _without_warm_places(found, sensors, measured)


def judged(
    parts: Sequence[tuple[Run, tuple[Fault, ...]]], within: Collection[str] | None = None,
    explained: Callable[[Finding], bool] = nothing,
) -> Judgement:  # fmt: skip
    """The same, of what `emptied` has made of each run, all columns taken for the model's."""
    frozen = _frozen([run for run, _ in parts])
    plain = [_without(run, k, [f for f in frozen if k in f.runs]) for k, (run, _) in enumerate(parts)]
    faults = [(k, f) for k, (_, found) in enumerate(parts) for f in found]
    leaps = [(k, f) for k, f in faults if f.kind == "leap"]
    table = readings(plain)
    found = [*_own(faults), *frozen]
    if table is not None:
        told = [(k, f.channels[0], f.first_time) for k, f in leaps if len(f.channels) == 1]
        found += filter(partial(_shown, plain), refuted(table, told, explained))
    return Judgement(
        tuple(f for f in found if within is None or set(f.channels) & set(within)),
        tuple((k, f) for k, f in faults if f.kind == "splice"),
        tuple((k, channel) for k, f in leaps for channel in f.channels),
    )


def _without_warm_places(judgement: Judgement, sensors: Collection[str], n_runs: int) -> Judgement:
    """With offsets in all of n_runs of channels that are none of these sensors for themselves."""
    warm = tuple(
        f for f in judgement.findings
        if f.what == "offset" and len(f.runs) == n_runs and f.channels[0] not in sensors
    )  # fmt: skip
    return replace(judgement, findings=tuple(f for f in judgement.findings if f not in warm), warm=warm)


def _own(faults: Sequence[tuple[int, Fault]]) -> list[Finding]:
    """What rows of a run itself show of each channel that is noise, rests at a limit or stands still."""
    found = []
    for run, f in faults:
        what: What = "noise" if f.kind == "noise" else "rail" if f.kind == "rail" else "stuck"
        size = f.size / _DEPARTS if what == "noise" else f.size if what == "rail" else f.last_time - f.first_time
        for channel in f.channels if f.kind in EMPTIED else ():
            found.append(Finding(what, (channel,), (run,), f.first_time, f.last_time, size, (size, size), np.inf))
    return found


def _shown(runs: Sequence[Run], f: Finding) -> bool:
    """Whether a finding is no leap, or its channel moves there from one reading to the next as far as the nearer end of
    what all others say, to KNOWN: a sensor that a warm nut comes to rises as far, but takes its time. Elsewhere in the
    run it may have cooled as far while nothing was logged."""
    table = runs[f.runs[0]].temperatures
    if f.what != "leap" or table is None:
        return True
    values, sign = table.columns[f.channels[0]], np.sign(f.size)
    there = np.isfinite(values) & (np.abs(table.time - f.start) <= BESIDE)
    steps = sign * np.diff(values[there])
    return bool(steps.max(initial=0.0) >= min(sign * end for end in f.interval) - KNOWN)


def _frozen(runs: Sequence[Run]) -> list[Finding]:
    """Channels that stand still in all of a run, and not in others."""
    tables = [(k, run.temperatures) for k, run in enumerate(runs) if run.temperatures is not None]
    found = []
    for i, still in frozen_throughout([table for _, table in tables]):
        k, table = tables[i]
        start, end = float(table.time[still.first]), float(table.time[still.last])
        if end - start >= STUCK:
            size = end - start
            found.append(Finding("stuck", (still.name,), (k,), start, end, size, (size, size), np.inf))
    return found


def set_aside(runs: Sequence[Run], findings: Sequence[Finding]) -> list[Run]:
    """The runs without the readings that findings are about, or with them corrected.

    Swapped pairs are put back in place. What reads too much by a size that is known to KNOWN is corrected by it:
    readings that are lost move a fit of a poor model as far as wrong ones. Within NEAR of a start readings go: when
    exactly it was is not known. Else readings go from the start of a leap on, of an offset or a drift throughout its
    run. Air that drives the model (`twin.calibrate.channels.filled`) is as the temperatures say then.
    """
    sound = [_without(run, k, [f for f in findings if k in f.runs]) for k, run in enumerate(runs)]
    return driven(runs, sound) if findings else sound


def _without(run: Run, number: int, found: Sequence[Finding]) -> Run:
    if run.temperatures is None or not found:
        return run
    time = run.temperatures.time
    columns = dict(run.temperatures.columns)
    for f in found:
        if f.what == "swapped" and set(f.channels) <= set(columns):
            columns |= _exchanged(columns, time, f, number == f.runs[0])
            continue
        if f.sized and np.ptp(f.interval) <= 2.0 * KNOWN:
            columns[f.channels[0]] = _corrected(columns[f.channels[0]], time, f, number == f.runs[0])
            continue
        wrong = np.ones(len(time), dtype=bool)
        if f.what not in ("offset", "drift") and number == f.runs[0]:
            wrong = time >= f.start
        if f.what in ("noise", "rail", "stuck"):
            wrong &= time <= f.end
        for name in f.channels:
            if name in columns:
                columns[name] = np.where(wrong, np.nan, columns[name])
    return replace(run, temperatures=replace(run.temperatures, columns=columns))


def share(time: np.ndarray, f: Finding, begins: bool) -> np.ndarray:
    """(n,) of the size of a leap, offset or drift, what the channel reads too much at times [s] of one of its runs.

    begins: it is at fault from some time of this run on.
    """
    since = time >= f.start if begins else np.ones(len(time), dtype=bool)
    return since * (np.clip((time - f.start) / max(f.end - f.start, 1.0), 0.0, 1.0) if f.what == "drift" else 1.0)


def _corrected(values: np.ndarray, time: np.ndarray, f: Finding, begins: bool) -> np.ndarray:
    """A channel less what it reads too much. begins: it is at fault from some time of this run on."""
    unsure = (f.what == "leap") & begins & (np.abs(time - f.start) <= NEAR)
    return np.where(unsure, np.nan, values - f.size * share(time, f, begins))


def _exchanged(columns: Mapping[str, np.ndarray], time: np.ndarray, f: Finding, begins: bool) -> dict[str, np.ndarray]:
    """The two columns of a swapped pair, each with its own readings. begins: it was swapped during this run."""
    a, b = (columns[name] for name in f.channels)
    swapped = time >= f.start if begins else np.ones(len(time), dtype=bool)
    unsure = swapped.any() & ~swapped.all() & (np.abs(time - f.start) <= NEAR)
    pair = np.where(swapped, b, a), np.where(swapped, a, b)
    return {name: np.where(unsure, np.nan, values) for name, values in zip(f.channels, pair, strict=True)}


def words(f: Finding, names: Sequence[str]) -> str:
    """As "'PT05' reads 5.1 K (4.9 to 5.3) too much in monday from 2.00 h on, by all other channels".

    names: of the runs.
    """
    where = ", ".join(names[k] for k in f.runs)
    if f.what in ("leap", "swapped") and f.start > 0.0:
        where += f" from {f.start / 3600.0:.2f} h on"
    during = f"{where} from {f.start / 3600.0:.2f} to {f.end / 3600.0:.2f} h"
    if f.what == "swapped":
        return f"'{f.channels[0]}' and '{f.channels[1]}' have each other's names in {where}, by all other channels"
    name = f"'{f.channels[0]}'"
    if f.what == "noise":
        return f"{name} is noise of {f.size:.3g} K in {during}"
    if f.what == "rail":
        return f"{name} rests at {f.size:.4g} degC in {during}"
    if f.what == "stuck":
        return f"{name} stands still while others go on in {during}"
    low, high = (f"{abs(v):.3g}" for v in sorted(f.interval, key=abs))
    much = f"{abs(f.size):.3g} K ({low} to {high}) too {'much' if f.size > 0.0 else 'little'}"
    verb = f"drifts to {much} at the end of" if f.what == "drift" else f"reads {much} in"
    return f"{name} {verb} {where}, by all other channels"

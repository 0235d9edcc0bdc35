"""What is wrong with the measured channels of a run: each fault once, those of several channels at once together."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from twin.logs.faults.breaks import LONGEST, Stretch, noise, rail, rest_before, rests_by_rounding
from twin.logs.faults.cold_start import begins_apart
from twin.logs.faults.fault import Fault, Kind
from twin.logs.faults.held import held
from twin.logs.faults.leaps import Changes, changes, leaps, leapt_together, set_to_zero
from twin.logs.faults.series import Series, beside, long_enough, tcp_series, temperature_series
from twin.logs.faults.spikes import spikes
from twin.logs.run import Run, Table
from twin.logs.stuck import Standstill, standstills

_NEAR = 1.5  # usual steps: what is no farther apart in time is one event
_BACK = 0.3  # of the larger of two leaps: they are there and back where their sum is less
_ZERO = 0.05  # of a probe's leap: as near to zero it is set to zero
_WAS = 10.0  # times nearer to zero than before
_SAME = 0.8  # of the longer of two standstills that both last: rounded channels come to rest one after the other


@dataclass(frozen=True)
class _Found:
    """A fault of one series, and the time within which another one is the same event."""

    fault: Fault
    near: float  # s


def faults_of(run: Run) -> list[Fault]:
    """The faults of temperatures.csv and tcp.csv, in the order of table and time.

    Each channel is judged by what it does itself elsewhere; series of less than 20 readings, and leaps within six
    readings of an end, are not. Where a segment of the run begins or ends, channels may leap: tests glued into one log.
    Times must increase, as `read_run` demands. Nothing is changed in the run.
    """
    temperatures, tcp = temperature_series(run), tcp_series(run)
    noisy, (temperatures, tcp) = _taken_out("noise", noise, temperatures, tcp)
    single, (temperatures,) = _taken_out("spike", spikes, temperatures)
    borders = [t for segment in run.segments for t in (segment.start, segment.end)]
    found = [*noisy, *single, *_of_temperatures(run, temperatures, borders), *_stuck_probes(run, tcp)]
    for s in (*temperatures, *tcp):
        known = [f for f in found if f.fault.kind != "spike" and (f.fault.kind == "splice" or _of(f.fault, s))]
        leapt = _rails_and_leaps(s, known, borders)
        rails = [f.fault for f in leapt if f.fault.kind == "rail"]
        found = [f for f in found if not _within(f.fault, rails)] + leapt
    if apart := begins_apart(run, temperatures):
        s = next(s for s in temperatures if s.name == apart.name)
        kind: Kind = "offset" if apart.cold else "offset_or_warm"
        found.append(_fault(kind, s, 0, len(s.row) - 1, apart.size))
    order = [*(run.temperatures.columns if run.temperatures is not None else ()), "dx", "dy", "dz"]
    return sorted(_together(found, order), key=lambda f: (f.table != "temperatures", f.first_row))


def _taken_out(
    kind: Kind, find: Callable[[Series], Sequence[Stretch]], *groups: Sequence[Series]
) -> tuple[list[_Found], list[list[Series]]]:
    """The faults of a kind in groups of series, and what is left of these."""
    found = [_fault(kind, s, n.first, n.last, n.size) for series in groups for s in series for n in find(s)]
    return found, [long_enough(_without(s, found) for s in series) for series in groups]


def _of_temperatures(run: Run, series: Sequence[Series], borders: Sequence[float]) -> list[_Found]:
    """Splices, standstills, and what a logger repeats beside these: after it all channels may leap at once."""
    repeated = [_fault("held", s, h.first, h.last, h.size) for s in series for h in held(s)]
    found = _splices(series, [*borders, *(f.fault.last_time for f in repeated)]) + _stuck(run, series)
    return found + [f for f in repeated if not any(_overlap(f.fault, other.fault) for other in found)]


def _splices(series: Sequence[Series], borders: Sequence[float]) -> list[_Found]:
    """Rows in which most temperatures leap, but at the borders of segments [s]."""
    together = leapt_together(series, [_away_from(s, changes(s), borders) for s in series])
    found = []
    for row, sizes in together.items():
        s = next(s for s in series if s.name in sizes and (s.row == row).any())
        later = [r for r in together if r > row]
        last = int(np.searchsorted(s.row, min(later))) - 1 if later else len(s.row) - 1
        one = _fault("splice", s, int(np.searchsorted(s.row, row)), last, max(sizes.values(), key=abs))
        found.append(replace(one, fault=replace(one.fault, channels=tuple(sizes))))
    return found


def _away_from(s: Series, change: Changes, times: Sequence[float]) -> Changes:
    """The changes of a series, with nothing in excess near some times [s]."""
    near = np.zeros(len(s.time), dtype=bool)
    for t in times:
        near |= np.abs(s.time - t) <= 2.0 * _near(s)
    return replace(change, excess=np.where(near, 0.0, change.excess))


def _rails_and_leaps(s: Series, known: Sequence[_Found], borders: Sequence[float]) -> list[_Found]:
    """Leaps of one series beside what is known, and the borders of segments [s]: what ends there is told already."""
    ends = [f.fault.first_time if f.fault.kind == "splice" else f.fault.last_time for f in known]
    change = _away_from(s, changes(s), [*ends, *borders])
    found: list[_Found] = []
    at = leaps(s, change)
    if not at and s.table == "tcp" and (zero := set_to_zero(s, change)) is not None:
        return [_fault("rezero", s, zero[0], len(s.row) - 1, zero[1])]
    while at:
        (i, size), at = at[0], at[1:]
        back = bool(at) and abs(size + at[0][1]) <= _BACK * max(abs(size), abs(at[0][1]))
        if (stays := rail(s, i)) is not None:
            found.append(_fault("rail", s, i, stays.last, stays.size))
            at = [(k, z) for k, z in at if k > stays.last + 1]
        elif _told(float(s.time[i]), 2.0 * _near(s), (*known, *found), float(s.time[-1])):
            continue
        elif back:
            found.append(_fault("leap", s, i, at[0][0] - 1, size))
            at = at[1:]
        elif (rest := rest_before(s, i)) is not None:
            found.append(_at_rest(s, rest.first, rest.last))
        else:
            kind: Kind = "rezero" if s.table == "tcp" and _to_zero(s, i, size, change.usual) else "leap"
            found.append(_fault(kind, s, i, len(s.row) - 1, size))
    return found


def _told(time: float, near: float, known: Iterable[_Found], end: float) -> bool:
    """Whether what happens at a time [s] is the beginning or the end of a known fault."""
    ends = [t for f in known for t in (f.fault.first_time, f.fault.last_time) if f.fault.kind != "leap"]
    return any(abs(time - t) <= near for t in ends if t < end)


def _to_zero(s: Series, at: int, size: float, usual: float) -> bool:
    """Whether a probe shows zero after a leap, and did not before."""
    before, after = (abs(float(np.median(v))) for v in (s.values[at - 3 : at], s.values[at : at + 3]))
    return after <= max(_ZERO * abs(size), usual) and before > _WAS * after


def _stuck(run: Run, series: Sequence[Series]) -> list[_Found]:
    """Temperatures that stand still while the others go on."""
    if run.temperatures is None:
        return []
    n = len(run.temperatures.time)
    columns = {s.name: np.full(n, np.nan) for s in series}
    for s in series:
        columns[s.name][s.row] = s.values
    named = {s.name: s for s in series}
    found = []
    for still in _every_standstill(Table(run.temperatures.time, columns, dict.fromkeys(columns, "degC"))):
        s = named[still.name]
        first, last = (int(np.searchsorted(s.row, row)) for row in (still.first, still.last))
        if not rests_by_rounding(s, last):
            found.append(_at_rest(s, first, last))
    return found


def _at_rest(s: Series, first: int, last: int) -> _Found:
    """A standstill of readings first .. last: of a temperature for a while, what a logger repeats."""
    repeated = s.table == "temperatures" and s.time[last] - s.time[first] <= LONGEST
    return _fault("held" if repeated else "stuck", s, first + repeated, last, s.values[first])


def _stuck_probes(run: Run, series: Sequence[Series]) -> list[_Found]:
    """Components of the TCP that stand still while the temperatures, or the other components, go on."""
    found = []
    for s in series:
        others = beside(s, run.temperatures)
        others |= {o.name: o.values for o in series if o.name != s.name and np.array_equal(o.row, s.row)}
        table = Table(s.time, {**others, s.name: s.values}, {**dict.fromkeys(others, ""), s.name: s.unit})
        found += [_fault("stuck", s, w.first, w.last, w.value) for w in _every_standstill(table) if w.name == s.name]
    return found


def _every_standstill(table: Table) -> list[Standstill]:
    """All standstills: each search tells one of a channel, so what was found is left out, and searched again."""
    found: list[Standstill] = []
    columns = {name: np.array(values, dtype=float) for name, values in table.columns.items()}
    while new := standstills(replace(table, columns=columns)):
        found += new
        for still in new:
            columns[still.name][still.first : still.last + 1] = np.nan
    return found


def _without(s: Series, faults: Iterable[_Found]) -> Series:
    """The readings of a series outside of its faults."""
    keep = np.ones(len(s.row), dtype=bool)
    for f in (f.fault for f in faults):
        if _of(f, s):
            keep[(s.row >= f.first_row) & (s.row <= f.last_row)] = False
    return s.only(keep)


def _of(fault: Fault, s: Series) -> bool:
    return fault.table == s.table and s.name in fault.channels


def _fault(kind: Kind, s: Series, first: int, last: int, size: float) -> _Found:
    """Of the readings first .. last of a series."""
    value = kind in ("rail", "stuck", "held")
    unit = "K" if s.unit == "degC" and not value else s.unit
    rows, times = (int(s.row[first]), int(s.row[last])), (float(s.time[first]), float(s.time[last]))
    return _Found(Fault(kind, s.table, (s.name,), *rows, *times, float(size), unit), _near(s))


def _near(s: Series) -> float:
    return _NEAR * float(np.median(np.diff(s.time)))


def _within(fault: Fault, others: Iterable[Fault]) -> bool:
    """Whether a standstill is what another fault of the same channel tells already."""
    return fault.kind in ("stuck", "held") and any(_overlap(o, fault) for o in others)


def _overlap(a: Fault, b: Fault) -> bool:
    """Whether two faults of the same channels have rows in common."""
    return a.channels == b.channels and a.first_row <= b.last_row and b.first_row <= a.last_row


def _at_once(a: Fault, b: Fault, near: float) -> bool:
    """Whether two faults of a kind are one event: they begin and end together, or both stand still most of the time."""
    if a.kind == "stuck":
        both = min(a.last_time, b.last_time) - max(a.first_time, b.first_time)
        return both >= _SAME * max(a.last_time - a.first_time, b.last_time - b.first_time)
    return max(abs(a.first_time - b.first_time), abs(a.last_time - b.last_time)) <= near


def _together(found: Sequence[_Found], order: Sequence[str]) -> list[Fault]:
    """One fault where several channels, or places of one, have the same one at the same time."""
    merged: list[_Found] = []
    for one in found:
        f = one.fault
        for k, other in enumerate(merged):
            o = other.fault
            if (f.kind, f.table) == (o.kind, o.table) and _at_once(f, o, max(one.near, other.near)):
                channels = tuple(sorted({*f.channels, *o.channels}, key=order.index))
                first, last = min(f, o, key=lambda x: x.first_row), max(f, o, key=lambda x: x.last_row)
                both = Fault(
                    f.kind, f.table, channels, first.first_row, last.last_row, first.first_time, last.last_time,
                    max(f.size, o.size, key=abs), f.unit,
                )  # fmt: skip
                merged[k] = replace(other, fault=both)
                break
        else:
            merged.append(one)
    return [m.fault for m in merged]

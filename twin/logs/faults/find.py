"""What is wrong with the measured channels of a run: each fault once, those of several channels at once together."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from twin.logs.faults.breaks import noise, rail
from twin.logs.faults.cold_start import begins_apart
from twin.logs.faults.fault import Fault, Kind
from twin.logs.faults.leaps import changes, leaps, leapt_together
from twin.logs.faults.series import Series, beside, tcp_series, temperature_series
from twin.logs.run import Run, Table
from twin.logs.stuck import standstills

_NEAR = 1.5  # usual steps: what is no farther apart in time is one event
_BACK = 0.3  # of the larger of two leaps: they are there and back where their sum is less
_ZERO = 0.05  # of a probe's leap: as near to zero it is set to zero
_WAS = 10.0  # times nearer to zero than before


@dataclass(frozen=True)
class _Found:
    """A fault of one series, and the time within which another one is the same event."""

    fault: Fault
    near: float  # s


def faults_of(run: Run) -> list[Fault]:
    """The faults of temperatures.csv and tcp.csv, in the order of table and time.

    Each channel is judged by what it does itself elsewhere; series of less than 20 readings, and leaps within six
    readings of an end, are not. Times must increase, as `read_run` demands. Nothing is changed in the run.
    """
    temperatures, tcp = temperature_series(run), tcp_series(run)
    spliced = _splices(temperatures)
    found = [*spliced, *_stuck_temperatures(run, temperatures), *_stuck_probes(run, tcp)]
    for s in (*temperatures, *tcp):
        known = [f for f in found if f.fault.kind == "splice" or s.name in f.fault.channels]
        broken = _breaks_and_leaps(s, known)
        rails = [b.fault for b in broken if b.fault.kind in ("rail", "noise")]
        found = [f for f in found if not _within(f.fault, rails)] + broken
    if apart := begins_apart(run, temperatures):
        s = next(s for s in temperatures if s.name == apart.name)
        broken_at_once = any(s.name in f.fault.channels and f.fault.first_row == s.row[0] for f in found)
        if not broken_at_once:
            kind: Kind = "offset" if apart.cold else "offset_or_warm"
            found.append(_fault(kind, s, 0, len(s.row) - 1, apart.size))
    order = [*(run.temperatures.columns if run.temperatures is not None else ()), "dx", "dy", "dz"]
    return sorted(_together(found, order), key=lambda f: (f.table != "temperatures", f.first_row))


def _splices(series: Sequence[Series]) -> list[_Found]:
    together = leapt_together(series, [changes(s) for s in series])
    found = []
    for row, sizes in together.items():
        s = next(s for s in series if s.name in sizes and (s.row == row).any())
        later = [r for r in together if r > row]
        last = int(np.searchsorted(s.row, min(later))) - 1 if later else len(s.row) - 1
        one = _fault("splice", s, int(np.searchsorted(s.row, row)), last, max(sizes.values(), key=abs))
        found.append(replace(one, fault=replace(one.fault, channels=tuple(sizes))))
    return found


def _breaks_and_leaps(s: Series, known: Sequence[_Found]) -> list[_Found]:
    """Faults of one series beside those that are known: what begins or ends there is told already."""
    found = [_fault("noise", s, n.first, n.last, n.size) for n in noise(s)]
    sound = np.ones(len(s.row), dtype=bool)
    for f in found:
        sound[(s.row >= f.fault.first_row) & (s.row <= f.fault.last_row)] = False
    quiet = s.only(sound)
    if len(quiet.row) < 2:
        return found
    change = changes(quiet)
    near = _near(s)
    ends = [t for f in (*known, *found) for t in (f.fault.first_time, f.fault.last_time)]
    at = [
        (i, size)
        for i, size in leaps(quiet, change)
        if not any(abs(quiet.time[i] - t) <= 2.0 * near for t in ends if t < s.time[-1])
    ]
    while at:
        (i, size), at = at[0], at[1:]
        stays = rail(quiet, i)
        if stays is not None:
            found.append(_fault("rail", quiet, i, stays.last, stays.size))
            at = [(k, z) for k, z in at if k > stays.last + 1]
        elif at and abs(size + at[0][1]) <= _BACK * max(abs(size), abs(at[0][1])):
            found.append(_fault("leap", quiet, i, at[0][0] - 1, size))
            at = at[1:]
        else:
            kind: Kind = "rezero" if s.table == "tcp" and _to_zero(quiet, i, size, change.usual) else "leap"
            found.append(_fault(kind, quiet, i, len(quiet.row) - 1, size))
    return found


def _to_zero(s: Series, at: int, size: float, usual: float) -> bool:
    """Whether a probe shows zero after a leap, and did not before."""
    before, after = (abs(float(np.median(v))) for v in (s.values[at - 3 : at], s.values[at : at + 3]))
    return after <= max(_ZERO * abs(size), usual) and before > _WAS * after


def _stuck_temperatures(run: Run, series: Sequence[Series]) -> list[_Found]:
    if run.temperatures is None or not series:
        return []
    named = {s.name: s for s in series}
    return [
        _fault("stuck", s, int(np.searchsorted(s.row, still.first)), int(np.searchsorted(s.row, still.last)), still.value)
        for still in standstills(run.temperatures)
        if (s := named.get(still.name)) is not None
    ]  # fmt: skip


def _stuck_probes(run: Run, series: Sequence[Series]) -> list[_Found]:
    """Components of the TCP that stand still while the temperatures, or the other components, go on."""
    found = []
    for s in series:
        others = beside(s, run.temperatures)
        others |= {o.name: o.values for o in series if o.name != s.name and np.array_equal(o.row, s.row)}
        table = Table(s.time, {**others, s.name: s.values}, {**dict.fromkeys(others, ""), s.name: s.unit})
        for still in standstills(table):
            if still.name == s.name:
                found.append(_fault("stuck", s, still.first, still.last, still.value))
    return found


def _fault(kind: Kind, s: Series, first: int, last: int, size: float) -> _Found:
    """Of the readings first .. last of a series."""
    value = kind in ("rail", "stuck")
    unit = "K" if s.unit == "degC" and not value else s.unit
    rows, times = (int(s.row[first]), int(s.row[last])), (float(s.time[first]), float(s.time[last]))
    return _Found(Fault(kind, s.table, (s.name,), *rows, *times, float(size), unit), _near(s))


def _near(s: Series) -> float:
    return _NEAR * float(np.median(np.diff(s.time)))


def _within(fault: Fault, others: Iterable[Fault]) -> bool:
    """Whether a standstill is what another fault of the same channel tells already."""
    return fault.kind == "stuck" and any(
        o.channels == fault.channels and o.first_row <= fault.last_row and fault.first_row <= o.last_row for o in others
    )


def _together(found: Sequence[_Found], order: Sequence[str]) -> list[Fault]:
    """One fault where several channels, or places of one, have the same one at the same time."""
    merged: list[_Found] = []
    for one in found:
        f = one.fault
        for k, other in enumerate(merged):
            o = other.fault
            apart = max(abs(f.first_time - o.first_time), abs(f.last_time - o.last_time))
            if (f.kind, f.table) == (o.kind, o.table) and apart <= max(one.near, other.near):
                channels = tuple(sorted({*f.channels, *o.channels}, key=order.index))
                larger = max(o, f, key=lambda x: abs(x.size))
                first, last = min(f.first_row, o.first_row), max(f.last_row, o.last_row)
                both = replace(larger, channels=channels, first_row=first, last_row=last)
                merged[k] = replace(other, fault=both)
                break
        else:
            merged.append(one)
    return [m.fault for m in merged]

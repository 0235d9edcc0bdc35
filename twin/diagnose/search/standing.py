"""What stands of several causes once the sealed runs are open: the weaker one may be what they refute, and no more."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from twin.calibrate.fit.measured import Measured
from twin.diagnose.faults.acted import ended, units_of
from twin.diagnose.faults.fault import Family
from twin.diagnose.faults.table import fault_of, what
from twin.diagnose.result.diagnosis import Cause
from twin.diagnose.result.spot import Spot
from twin.diagnose.search.accepted import Accepted, settled
from twin.diagnose.search.forward import naming, stands
from twin.diagnose.search.look import Search
from twin.diagnose.search.sealed import Judged, judged, less_likely
from twin.diagnose.search.verdict import verdict_of, with_faults

REFUTED_LATER = "With it the sealed run is significantly less likely"


def standing(
    found: Search, y: np.ndarray, families: Sequence[Family], faults: Sequence[Cause], opened: Sequence[Measured],
    seed: int,
) -> tuple[Search, Judged]:  # fmt: skip
    """A search in y (m,) and its headline, held against the measurements of the sealed runs: without the faults of
    sensors that these refute."""
    found, refuted = _with_sound_sensors(found, y, families, opened, seed)
    found, told = _of_machine(found, y, families, faults, opened, seed)
    return found, replace(told, less="; ".join(text for text in (refuted, told.less) if text))


def _of_machine(
    found: Search, y: np.ndarray, families: Sequence[Family], faults: Sequence[Cause], opened: Sequence[Measured],
    seed: int,
) -> tuple[Search, Judged]:  # fmt: skip
    """The causes in the machine held against the sealed runs.

    Where these refute several causes in the machine together, the weakest goes and the others are fitted and judged
    again. If they are refuted down to the last one, so is all that was found. Where they refute what has come to stay,
    and it may have ended with the runs that were looked at, they refute that it stays. What comes in every run that was
    looked at may come in a sealed one, too: it is refuted only where that run has it at no hours of the others either,
    and where the run speaks for such hours it is predicted with them.
    """

    def held_against(now: Search, told_of: Search | None = None) -> Judged:
        verdict, causes = verdict_of(told_of or now, families)
        if verdict == "unknown":  # judged is the calibration beside faulty channels then, not what was tried
            now = beside_sensors(now, y, families)
        return judged(now, y, *with_faults(verdict, causes, faults), families, opened, seed)

    whole = held_against(found)
    if whole.refuted and (over := _ended(found)) is not found and not (told := held_against(over)).refuted:
        names = " and ".join(f"{what(c.family)} at {c.place}" for c in told.causes if c.windows)
        return over, replace(told, less=f"named until the end of the diagnosed runs: {names}. {REFUTED_LATER}")
    for run, again in () if whole.confirmed else _recurring(found, opened):
        told = held_against(again, found)
        if told.confirmed or (told.extension and (whole.refuted or whole.size)):
            return again, replace(told, less=f"the sealed run is predicted with what switches, at its hours of {run}")
    now, told, gone = found, whole, list[Accepted]()
    while told.refuted and (weakest := _weakest(now, families)):
        gone.append(weakest)
        now = without(now, y, weakest)
        if not all(stands(now.detector, a) for a in now.accepted):
            return found, whole
        told = held_against(now)
    if told.refuted or not gone or told.verdict == "unknown":
        return found, whole
    names = " and ".join(f"{what(a.hypothesis.family)} at {a.hypothesis.name}" for a in gone)
    less = f"withdrawn: {names}, with which the other causes predict the sealed run significantly worse"
    return now, replace(told, less=less)


def _with_sound_sensors(
    found: Search, y: np.ndarray, families: Sequence[Family], opened: Sequence[Measured], seed: int
) -> tuple[Search, str]:
    """The search without faults of temperature sensors that would go on in the sealed runs and that these refute, the
    weakest first, and a note: they are significantly less likely than with channels as they are read, by the same model
    or by one that was fitted to them so. Of other faults the sealed runs say nothing: a sensor may be repaired."""
    notes = list[str]()
    for h in [a.hypothesis for a in sorted(found.accepted, key=lambda a: a.statistic)] if opened else ():
        a, fault = next(a for a in found.accepted if a.hypothesis is h), fault_of(h)  # refitted if another one has gone
        if not (_of_sensor(a, families) and (fault.exchanges or fault.lasts)):
            continue
        read = replace(found, accepted=tuple(b for b in found.accepted if b is not a))
        other = without(found, y, a)
        told = less_likely(found, other, opened, seed) or less_likely(found, read, opened, seed)
        if told and all(stands(other.detector, b) for b in other.accepted):
            found, spot = other, Spot.read(h.name)
            names = f"{spot.words if fault.exchanges else f'sensor {spot.name}'} ({h.when.name})"
            notes.append(f"withdrawn: {names}, with which the sealed run is less likely; {told}")
    return found, "; ".join(notes)


def _ended(found: Search) -> Search:
    """The search with causes that have come to stay ended with the fitted runs; itself where there is none."""
    study, accepted = found.detector.study, list[Accepted]()
    for a in found.accepted:
        h = ended(study, a.hypothesis)
        accepted.append(a if h is a.hypothesis else replace(a, hypothesis=h, units=units_of(study, h)))
    changed = any(a is not b for a, b in zip(accepted, found.accepted, strict=True))
    return replace(found, accepted=tuple(accepted)) if changed else found


def _recurring(found: Search, opened: Sequence[Measured]) -> Iterator[tuple[str, Search]]:
    """The search with causes that switch, where all of them do so in every fitted run, at the hours of one of these in
    the sealed runs as well."""
    study = found.detector.study
    runs = {name for name, _ in study.fitted_runs}
    switching = [a for a in found.accepted if a.units and a.hypothesis.when.windows and not a.hypothesis.when.bell]
    if not switching or any({w.run for w in a.hypothesis.when.windows} != runs for a in switching):
        return
    for run in sorted(runs):
        accepted = list[Accepted]()
        for a in found.accepted:
            h, own = a.hypothesis, [w for w in a.hypothesis.when.windows if w.run == run and a in switching]
            more = [replace(w, run=sealed.name) for sealed in opened for w in own]
            h = replace(h, when=replace(h.when, windows=(*h.when.windows, *more)))
            accepted.append(replace(a, hypothesis=h, units=units_of(study, h)) if more else a)
        yield run, replace(found, accepted=tuple(accepted))


def _weakest(found: Search, families: Sequence[Family]) -> Accepted | None:
    """Of several causes that are no faulty sensors."""
    own = [a for a in found.accepted if not _of_sensor(a, families)]
    return min(own, key=lambda a: a.statistic) if len(own) > 1 else None


def without(found: Search, y: np.ndarray, one: Accepted) -> Search:
    """A search in y (m,) as if a cause had not been named."""
    return naming(found, y, found.x, [a for a in found.accepted if a is not one])


def beside_sensors(found: Search, y: np.ndarray, families: Sequence[Family]) -> Search:
    """A search in y (m,) with the causes that are faulty temperature sensors alone, and a calibration beside these."""
    kept = tuple(a for a in found.accepted if _of_sensor(a, families))
    x, covariance = settled(found.detector, y, kept)
    return replace(found, accepted=kept, x=x, covariance=covariance)


def _of_sensor(a: Accepted, families: Sequence[Family]) -> bool:
    return any(f.name == a.hypothesis.family and f.group == "sensor" for f in families)

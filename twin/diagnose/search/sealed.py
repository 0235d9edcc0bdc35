"""The sealed runs judge the headline: what names a cause in the machine must predict runs that were not looked at.

They never make a name: a sensor fault, or an event of the runs that were looked at, shows in no other run. But causes
of the machine are withdrawn with which the sealed runs are less likely, beyond chance, than with a recalibrated model:
that something is there all the same is said where the other runs leave no doubt.
Where they are likelier with another size that the data allow, they refute the size alone: the name stays, and nothing
is written. Such sizes are the smallest of the 95 % interval, and for a declared number what the settled calibration
makes of it without its tolerance. What is told of a declared number is judged beside a calibration of all others, and a
factor of a signal beside one that leaves the sources which read it as declared. A number that calibration alone moved
out of its tolerance is judged beside the calibration that keeps it in, and needs this confirmation where only the fit
behind the scores is sure of it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from twin.calibrate.fit.measured import Measured
from twin.diagnose.evidence.settled import settled_alone
from twin.diagnose.faults.fault import Family
from twin.diagnose.faults.table import fault_of, what
from twin.diagnose.result.diagnosis import Cause, Gain, Verdict
from twin.diagnose.result.numbers import quantity, rms
from twin.diagnose.search.accepted import Accepted, freed, settled
from twin.diagnose.search.by_calibration import CALIBRATED
from twin.diagnose.search.declared import imitating, with_signal
from twin.diagnose.search.detector import Detector
from twin.diagnose.search.gain import Channel, channels_of, gains, likelihood_ratio
from twin.diagnose.search.look import Search
from twin.diagnose.search.policy import SearchPolicy


@dataclass(frozen=True)
class Judged:
    """A headline after the sealed runs were opened."""

    verdict: Verdict
    causes: tuple[Cause, ...]
    extension: tuple[Cause, ...]  # what belongs into the description
    gains: tuple[Gain, ...]
    note: str = ""  # why a name was withdrawn
    size: str = ""  # why its size was
    less: str = ""  # which of several was withdrawn, beside which the others would have been
    refuted: bool = False  # all that was named in the machine is withdrawn
    confirmed: bool = False  # the sealed runs are likelier with it, beyond chance


def judged(
    found: Search, y: np.ndarray, verdict: Verdict, causes: Sequence[Cause], families: Sequence[Family],
    opened: Sequence[Measured], seed: int,
) -> Judged:  # fmt: skip
    """The headline of a search in y (m,), held against the measurements of the sealed runs, the last of its study."""
    kept = tuple(c for c in causes if c.history != CALIBRATED or _stays(found, y, c, opened, seed))
    if len(kept) < len(causes):
        gone = " and ".join(f"{what(c.family)} at {c.place}" for c in causes if c not in kept)
        note = f"withdrawn: {gone}. Calibration without its tolerance predicts the sealed run no better"
        left = verdict if any(c.history == CALIBRATED for c in kept) else "sensor" if kept else "nothing"
        return Judged(left, kept, (), gains(_channels(found, opened), seed, found.detector.policy), note)
    found = _beside_declared(found, y)
    entries = {f.name: f for f in families}
    named = verdict in ("named", "out_of_tolerance", "ambiguous", "signal")
    extension = tuple(
        c for c in causes
        if named and c.history != CALIBRATED and c.family in entries and entries[c.family].changes(c)
    )  # fmt: skip
    channels, policy = _channels(found, opened), found.detector.policy
    table, worth = gains(channels, seed, policy), _worth(channels, seed, policy)
    by_fit = _told_by_fit(found)
    names = " and ".join(dict.fromkeys(f"{what(c.family)} at {c.place}" for c in extension))
    if not extension or worth >= (1 if by_fit and opened else 0):
        if extension and (bad := _worse(table)):
            note = f"not written: {names}. With it the channels that it moves are predicted worse, most of all {bad}"
            return Judged(verdict, tuple(causes), (), table, size=note, confirmed=worth > 0)
        return Judged(verdict, tuple(causes), extension, table, confirmed=bool(extension) and worth > 0)
    for accepted in other_sizes(found, y):
        x, _ = settled(found.detector, y, accepted)
        if _worth(_channels(replace(found, accepted=accepted, x=x), opened), seed, policy) > 0:
            lead = next(a for a in accepted if a.hypothesis.family == extension[0].family)
            told = f"{fault_of(lead.hypothesis).curve.told(float(lead.amplitude[0])):.3g} {lead.hypothesis.batch.unit}"
            note = f"not written: {names}, since another size predicts the sealed run better, such as {told}"
            return Judged(verdict, tuple(causes), (), table, size=note)
    if by_fit:
        rest = tuple(c for c in causes if c not in extension)
        note = f"withdrawn: {names}. Only the detection fit supports it, and it predicts the sealed run no better"
        return Judged("sensor" if rest else "nothing", rest, (), table, note)
    note = (
        f"withdrawn: {names}. It fits the diagnosed runs but predicts the sealed run significantly "
        f"worse, most of all {_worst(channels)} recalibrated"
    )
    if rivals := list(dict.fromkeys(f"{what(r.family)} at {r.place}" for c in extension for r in c.rivals)):
        note += f". Not tested on the sealed run, and nearly as likely in the others: {', '.join(rivals)}"
    rest = tuple(c for c in causes if c not in extension)
    left = "unknown" if _evident(found) else "sensor" if rest else "nothing"
    return Judged(left, rest, (), table, note, refuted=True)


def _worse(table: Sequence[Gain]) -> str:
    """The channel that the causes move and that is predicted significantly worse with them, and most so, where all of
    its unit that they move in its run are worse together (rms), if not beyond chance; "" where none is."""
    moved = [g for g in table if g.affected and np.isfinite(g.extended)]
    worse = [
        g for g in moved
        if g.ci95[1] < 0.0
        and sum(c.extended**2 - c.recalibrated**2 for c in moved if (c.run, c.unit) == (g.run, g.unit)) > 0.0
    ]  # fmt: skip
    if not worse:
        return ""
    most = max(worse, key=lambda g: g.extended / g.recalibrated)
    after, before = (quantity(value, most.unit) for value in (most.extended, most.recalibrated))
    return f"{most.channel} of {most.run}: residual {after} (rms) with it, {before} recalibrated"


def _evident(found: Search) -> bool:
    """Whether something is there though its name was refuted: heat of any history that passes, or a cause that explains
    so much more than it needs that its misfits would pass. A name that has just passed was chance."""
    heat = max(found.steps[0].parts.values(), default=0.0)
    strong = any(a.statistic > found.detector.policy.later * a.threshold for a in found.accepted)
    return heat > found.detector.thresholds["unknown"] or strong


def _beside_declared(found: Search, y: np.ndarray) -> Search:
    """The search beside a calibration that keeps as declared the numbers that were named, and those that imitate a
    factor of a signal: one that moves them itself predicts as well as the model that was told."""
    study, held = found.detector.study, set[int]()
    for h in (a.hypothesis for a in found.accepted):
        held.update(freed(study, h))
        if (fault := fault_of(h)).corrects:
            place, factor = fault.factor(h.name)
            held.update(np.flatnonzero(imitating(study, with_signal(study, fault.bare(place), factor))).tolist())
    return replace(found, x0=settled_alone(found.detector.fitter, y, held=sorted(held))[0]) if held else found


def _told_by_fit(found: Search) -> bool:
    """Whether the cause is a declared number out of its tolerance of which only the fit behind the scores is sure."""
    unsettled = {own.index for own in found.loose if not own.settled}
    return any(j in unsettled for a in found.accepted[:1] for j in freed(found.detector.study, a.hypothesis))


def _channels(found: Search, opened: Sequence[Measured]) -> tuple[Channel, ...]:
    """Of all sealed runs."""
    first = len(found.detector.study.runs) - len(opened)
    return tuple(
        c for k, m in enumerate(opened, start=first) for c in channels_of(found, k, m, _noise(found.detector, m))
    )


def _stays(found: Search, y: np.ndarray, cause: Cause, opened: Sequence[Measured], seed: int) -> bool:
    """Whether the sealed runs allow a number that calibration alone moved: of a calibration in which it has the value
    that it has without its tolerance. Without a sealed run it stays."""
    known = [p.path for p in found.detector.study.probed.parameters]
    own = next(own for own in found.loose if known[own.index] == cause.parameter)
    x, _ = settled_alone(found.detector.fitter, y, (own.index,))
    x[own.index] = own.x
    worth = _worth(_channels(replace(found, x=x), opened), seed, found.detector.policy)
    return worth > 0 or (worth == 0 and (own.settled or not opened))


def _worth(channels: Sequence[Channel], seed: int, policy: SearchPolicy) -> int:
    """Whether the sealed runs are likelier with the causes (1), less likely (-1), or neither beyond chance."""
    low, high = likelihood_ratio(channels, seed, policy)
    return int(low > 0.0) - int(high < 0.0)


def less_likely(found: Search, other: Search, opened: Sequence[Measured], seed: int) -> str:
    """The channel that speaks most against a search, where the sealed runs are significantly less likely with it than
    with another one; "" where they are not."""
    policy, both = found.detector.policy, zip(_channels(found, opened), _channels(other, opened), strict=True)
    compared = [
        replace(a, errors=[a.errors[0], b.errors[2], a.errors[2]], moved=_apart(a, b) > policy.noticed * a.noise)
        for a, b in both
    ]  # fmt: skip
    if _worth(compared, seed, policy) >= 0:
        return ""
    return f"{_worst(compared)} without"


def _worst(channels: Sequence[Channel]) -> str:
    """The moved channel that the last model predicts worse than the second one by most standard deviations of noise,
    with what both leave of it."""
    worst = max((c for c in channels if c.moved), key=lambda c: float(rms(c.errors[2]) - rms(c.errors[1])) / c.noise)
    after, before = (quantity(float(rms(worst.errors[k])), worst.unit) for k in (2, 1))
    return f"{worst.name}: residual {after} (rms) with it, {before}"


def _apart(a: Channel, b: Channel) -> float:
    """By how much two searches predict a channel otherwise (rms, in its unit)."""
    return float(rms(a.errors[2] - b.errors[2]))


def other_sizes(found: Search, y: np.ndarray) -> Iterator[tuple[Accepted, ...]]:
    """The causes with sizes that the runs that were looked at allow besides the told ones."""
    detector = found.detector
    yield tuple(_smallest(a, detector.policy.sure) for a in found.accepted)
    one = found.accepted[0]
    for j in freed(detector.study, one.hypothesis) if len(found.accepted) == 1 else ():
        x, _ = settled_alone(detector.fitter, y, (j,))
        size, _ = fault_of(one.hypothesis).amplitude(float(x[j] * detector.study.scale[j]))
        yield (replace(one, amplitude=np.array([size])),)


def _smallest(a: Accepted, sure: float) -> Accepted:
    """A cause at the end of its 95 % interval that is nearer to nothing; an exact factor as it is."""
    value = abs(float(a.amplitude[0]))
    if a.hypothesis.batch.fixed or value == 0.0:
        return a
    sigma = np.hypot(np.sqrt(max(float(a.covariance[0, 0]), 0.0)), fault_of(a.hypothesis).uncertain(value))
    return replace(a, amplitude=max(1.0 - sure * sigma / value, 0.0) * a.amplitude)


def _noise(detector: Detector, m: Measured) -> tuple[np.ndarray, np.ndarray]:
    """Of a sealed run's sensors (s,) and TCP components (3,): as in the first fitted run."""
    sensors, tcp = detector.whiten.channels[0]
    own = detector.study.runs[0].measured.sensors
    known = dict(zip(own, sensors.sigma, strict=True))
    return np.array(
        [known.get(s, float(np.median(sensors.sigma)) if len(own) else detector.policy.thermocouple) for s in m.sensors]
    ), tcp.sigma

"""Declared numbers that calibration alone has moved out of their tolerance, as causes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.evidence.fitter import bounds
from twin.diagnose.evidence.pulls import Loose
from twin.diagnose.faults.table import family_of_parameter, fault_of, what
from twin.diagnose.result.diagnosis import Cause, Rival
from twin.diagnose.result.spot import Of, Spot
from twin.diagnose.search.accepted import parameter_of, readings_columns
from twin.diagnose.search.contest import bent
from twin.diagnose.search.detector import Detector
from twin.diagnose.search.look import Search, distinct
from twin.diagnose.search.rivals import in_the_air, reading_beside, rival_of, sensor_between
from twin.diagnose.search.strained import beside, often
from twin.rom.parameter import Parameter

CALIBRATED = "by calibration"  # history of a cause that calibration absorbs: it is no extension of the model


def strained_of(found: Search) -> tuple[Cause, ...]:
    """Declared parameters that calibration alone moved out of their tolerance, at their values without one. Of one that
    has come near a bound of the calibration, the interval reaches as far as physics allows. A rival does a tenth at
    least of what they do: what passes its threshold beside them and could not be named, and what explains more than a
    number does without its tolerance, more than its family does by chance, and brings the number back. One that is
    within its tolerance where the farthest has none is that one's doing, or, where it explains as much without its own,
    its rival."""
    result, detector = list[Cause](), found.detector
    least = 1.0 - detector.policy.covers
    for own in found.loose:
        if own.follows:
            continue
        p = detector.study.probed.parameters[own.index]
        place, (gain, ci95, unit) = _place(p), _told(detector, own)
        rivals = [rival_of(h, cosine, reading_beside(h)) for h, cosine in own.rivals]
        a = np.sign(own.x) * _response(detector, own.index)
        for h in distinct([*_unnamed(found), *_likelier(found, own)]):
            cosine = _cosine(a, readings_columns(detector, h) @ np.array(h.amplitude))
            if _of_number(h, place) or cosine**2 < least:
                continue
            alone = p.kind == "expansion" or fault_of(h).read
            remedy = _measured(p) if alone else in_the_air(h) or sensor_between(place, h.name)
            rivals.append(rival_of(h, cosine, remedy))
        as_likely = (o for o in found.loose if o.follows and not result and o.told >= own.told - detector.policy.close)
        rivals += [_rival_number(detector, own, other) for other in as_likely]
        result.append(Cause(
            family=family_of_parameter(p), place=place, parameter=p.path, amplitude=gain, ci95=ci95, unit=unit,
            statistic=own.strain**2, threshold=1.0, history=CALIBRATED, rivals=tuple(rivals),
        ))  # fmt: skip
    return tuple(sorted(result, key=lambda c: -c.statistic))


def not_named(found: Search, causes: Sequence[Cause]) -> str:
    """A note on what passes its threshold beside numbers that calibration moved, has nothing to do with them, and could
    not be named; "" where there is nothing."""
    told = {c.place for c in causes} | {r.place for c in causes for r in c.rivals}
    if not any(c.history == CALIBRATED for c in causes):
        return ""
    more = [h for h in _unnamed(found) if not any(_of_number(h, place) for place in told)]
    names = ", ".join(dict.fromkeys(f"{what(h.family)} at {h.name} ({h.when.name})" for h in more))
    return f"not named in addition, as its score passes its threshold but its refit does not: {names}" if names else ""


def _of_number(h: Hypothesis, place: str) -> bool:
    """Whether a hypothesis is about the declared number of a place: the offset of an environment at all times, neither
    in hours nor with height."""
    return h.name == place and not (Spot.read(place).of is Of.ENVIRONMENT and (h.when.windows or h.batch.unit != "K"))


def _unnamed(found: Search) -> list[Hypothesis]:
    return [h for h in found.steps[-1].ranked if h.statistic > found.detector.thresholds[h.family]]


def _likelier(found: Search, own: Loose) -> list[Hypothesis]:
    detector, policy = found.detector, found.detector.policy
    limit = detector.pulls.fitted.limit[own.index]
    return [
        h for h in found.steps[-1].ranked
        if h.statistic > max(own.told + policy.close, often(detector, h.family)) and not bent(detector, h)
        and abs(beside(detector, found.fitted, own.index, h)) < limit
    ]  # fmt: skip


def _told(detector: Detector, own: Loose) -> tuple[float, tuple[float, float], str]:
    """A number without its tolerance, as a factor with its 95 % interval; of what is declared as nought, or may be that
    within its tolerance, the value."""
    p, sure, ends = detector.study.probed.parameters[own.index], detector.policy.sure, bounds(detector.study)
    ratio = p.scale == "log" or (p.kind == "expansion" and abs(p.nominal) > p.sigma)
    unit, one = ("1", p.nominal) if ratio else (p.unit, 1.0)
    gain, *both = (p.value(own.x + z * own.sigma) / one for z in (0.0, -sure, sure))
    low, high = sorted(both)
    lowest, highest = (detector.policy.nearly * float(end[own.index]) for end in ends)
    if own.settled and not lowest < own.x < highest and (far := _farthest(detector, own.index, own.x)) is not None:
        low, high = (low, max(high, far)) if own.x > 0.0 else (min(low, far), high)
    return gain, (low, high), unit


def _rival_number(detector: Detector, first: Loose, other: Loose) -> Rival:
    """Another number out of its tolerance as the rival of the farthest."""
    p, (gain, ci95, unit) = detector.study.probed.parameters[other.index], _told(detector, other)
    cosine = _cosine(*(np.sign(own.x) * _response(detector, own.index) for own in (first, other)))
    remedy = _measured(detector.study.probed.parameters[first.index], p)
    return Rival(family_of_parameter(p), _place(p), CALIBRATED, gain, unit, other.strain**2, cosine, remedy, ci95)


def _measured(*numbers: Parameter) -> str:
    return f"a measurement of {', or of '.join(p.path for p in numbers)}{',' if numbers[1:] else ''} by itself"


def _place(p: Parameter) -> str:
    """What a declared number belongs to, as other causes call it: a node by its name alone."""
    entry = p.path.split(".")[: 3 if p.component >= 0 else 2]  # of a table in a table, as [tcp.expansion]
    return ".".join(entry).removeprefix("nodes.")


def _cosine(a: np.ndarray, b: np.ndarray) -> float:
    """Of two white responses (m,)."""
    return float(a @ b) / max(float(np.linalg.norm(a) * np.linalg.norm(b)), 1e-30)


def _response(detector: Detector, j: int) -> np.ndarray:
    """(m,) white, to a declared number."""
    return detector.whiten(detector.fitter.linear(np.zeros(len(detector.study.scale)))[1][:, j])


def _farthest(detector: Detector, j: int, x: float) -> float | None:
    """The factor of a declared number that physics allows, the largest for x > 0, the smallest for x < 0; None where
    no range is known."""
    for batch in detector.columns.batches:
        fault = fault_of(batch)
        for name, largest in zip(batch.places, batch.largest, strict=False) if fault.declared else ():
            if parameter_of(detector.study, name) == j:
                return fault.curve.told(float(np.sign(x)) * largest)
    return None

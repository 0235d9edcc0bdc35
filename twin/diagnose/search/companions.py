"""What a cause must explain beside others, whose misfits look like causes.

A response that is wrong by a twentieth leaves 0.05^2 of what it explains, wherever. Most of what a cause does may be
imitated by calibration, and the error of it is not: where another cause would act at the same part, or in the same
history, it may be that error, of all that the first one does: beside a loss that grows with its own temperature, heat
at its bearing in two hours.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.faults.table import fault_of
from twin.diagnose.model.study import Study, own_place
from twin.diagnose.result.spot import Of, Spot
from twin.diagnose.search.accepted import Accepted, misfits
from twin.diagnose.search.detector import FLOOR, Detector

Limit = Callable[[Hypothesis], float]  # the statistic that a name needs


def limits_beside(detector: Detector, accepted: Sequence[Accepted]) -> Limit:
    """The statistic that every name needs beside accepted causes: its threshold alone where there is none."""
    policy, study = detector.policy, detector.study
    acting = [a for a in accepted if a.units]
    least = policy.later * max(FLOOR, detector.least) if accepted else 0.0
    anywhere = policy.misfit * max((a.statistic for a in acting), default=0.0)
    of_all = [(a.hypothesis, misfits(detector, a.hypothesis, a.amplitude)) for a in acting]

    def limit(h: Hypothesis) -> float:
        akin = max((left for one, left in of_all if _akin(study, one, h)), default=0.0)
        return max(detector.thresholds[h.family] + max(least, akin), anywhere)

    return limit


def _akin(study: Study, one: Hypothesis, other: Hypothesis) -> bool:
    """Whether another cause in the machine acts at the part of one, or in its history."""
    if fault_of(other).read:
        return False
    drives = one.when.signal, other.when.signal
    alike = drives[0] == drives[1] if any(drives) else one.when.name == other.when.name
    return alike or bool(parts_of(study, one.name) & parts_of(study, other.name))


def parts_of(study: Study, name: str) -> set[str]:
    """The parts that a surface, a film or a source belongs to."""
    return {Spot.read(surface).part for surface in surfaces_of_place(study, name)}


def surfaces_of_place(study: Study, name: str) -> set[str]:
    """A surface, all of a film, the one that a source heats, or would heat in its place, or both that are joined."""
    spot, places = Spot.read(name), study.probed.places
    if spot.of is Of.FILM:
        return {p.name for p in places if p.film == spot.name}
    if spot.of is Of.SOURCE:
        sources = study.probed.base.load_model.sources
        own = [own_place(study, j) for j, s in enumerate(sources) if s.name == spot.name and not s.contact]
        return {places[p].name for p in own if p is not None} | ({spot.partner} if spot.partner else set())
    return {spot.name, spot.partner} if spot.between else {name}

"""The next experiment: of one more run, or one more sensor, what lowers the detection limit of a suspicion most.

A detection limit is (sqrt(threshold) + z) / sqrt(I) with I the information about a size after everything calibratable
is projected out; a declared number has one by calibration, too (`limits.seen_from`). An experiment adds to I. The
detector's I of today is what counts; what an experiment adds is computed without the learned modes of model discrepancy
(`foreseen`), and reduced by the share of I that they leave today: the same discrepancy, as large in the new run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from twin.diagnose.evidence.batch import RIDGE, Batch, Hypothesis
from twin.diagnose.evidence.sight import Sight, sight
from twin.diagnose.faults.elements import Key
from twin.diagnose.faults.table import fault_of
from twin.diagnose.plan.actuators import actuators_of
from twin.diagnose.plan.experiments import AGAIN, experiments_of, longest_of
from twin.diagnose.plan.foreseen import AT, Foreseen, begins, foreseen
from twin.diagnose.plan.suspicion import Suspicion, known_suspicions
from twin.diagnose.result.plan import Apart, Foresight, Plan, Proposal, Separation
from twin.diagnose.result.spot import Spot
from twin.diagnose.search.detector import Detector
from twin.diagnose.search.limits import over_histories, seen_from
from twin.logs.run import Run
from twin.machine.description import Machine
from twin.progress import Progress, silent

LEAST = 0.05  # of the information without learned modes that today's has with them; less is rounding of what is blind
SENSORS = 8  # places of another sensor that a plan lists for a suspicion: their gains differ little then
ASSUMPTIONS = (
    "one more run, as long as the longest of these, with its instruments (noise, bins, TCP rows) and in the same air",
    "the description is unchanged, and its discrepancy from the machine is as large in the new run as in these",
    "the thresholds are today's: a run of other loads has its own, and loads that heat a machine more may raise them",
    "another sensor reads the mean temperature of its surface or node, with the noise of the median sensor",
    "a switching cause acts in the new run at the same hours as in these, and persists",
)


_P = TypeVar("_P", Proposal, Separation)


@dataclass(frozen=True)
class Basis:
    """The columns (u,) of the detector that hypotheses of a plan are combinations of."""

    columns: tuple[int, ...]
    hours: tuple[tuple[str, str, int] | None, ...]  # kind, place and first step in its run of what acts in a block

    def spread(self, own: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """(q, 2 u) of weights (q, L) of columns own (L,): what acts in today's runs, then in the new one.

        An hour of the new run is one, in however many runs of today something acts then: of equal hours the strongest
        counts, and belongs to the first amplitude that has one.
        """
        q, u = len(weights), len(self.columns)
        place = {c: i for i, c in enumerate(self.columns)}
        result = np.zeros((q, 2 * u))
        for c in np.flatnonzero(np.any(weights, axis=0)):
            result[:, place[int(own[c])]] += weights[:, c]
        taken: dict[tuple[str, str, int], tuple[int, int]] = {}
        for row, today in enumerate(result[:, :u]):
            for c in np.flatnonzero(today):
                hour = self.hours[c]
                if hour is None:
                    continue
                first, other = taken.get(hour, (row, -1))
                if first == row and (other < 0 or abs(today[c]) > abs(today[other])):
                    if other >= 0:
                        result[row, u + other] = 0.0
                    result[row, u + c] = today[c]
                    taken[hour] = (row, int(c))
        return result


def make_plan(
    detector: Detector, machine: Machine, runs: Sequence[Run], suspicions: Sequence[Suspicion],
    pairs: Sequence[tuple[Hypothesis, Hypothesis]], noise: float, progress: Progress = silent,
) -> Plan:  # fmt: skip
    """What every experiment would bring for each suspicion, and each pair that these data cannot separate.

    runs: those that the detector's study is fitted to, as measured; noise [K] of one reading.
    """
    study = detector.study
    longest = longest_of(runs)
    load = study.probed.base.load_model
    actuators = actuators_of(load, [study.runs[k].run.signals for k in study.fitted])
    places = [p.name for p in study.probed.places if not Spot.read(p.name).pad]
    sensors = study.runs[longest].measured.sensors
    experiments = experiments_of(load, runs[longest], sensors, actuators, places)
    columns = _needed(detector, suspicions, pairs)
    key_of = {c: key for key, c in detector.index.items()}
    keys = [key_of[c] for c in columns]
    made = list(foreseen(detector, machine, runs, experiments, keys, noise, progress))
    f, _, projector = detector.fitter.linear(np.zeros(len(study.probed.parameters)))
    now = sight(detector.columns, projector, np.zeros(len(f)))
    basis = Basis(tuple(columns), tuple(_hour(detector, key) for key in keys))
    stated = known_suspicions(detector)
    lone = tuple(_foresight(detector, now, s, stated[s], basis, made) for s in suspicions)
    return Plan(lone, tuple(_apart(a, b, basis, made, detector.policy.apart) for a, b in pairs), ASSUMPTIONS)


def _needed(
    detector: Detector, suspicions: Sequence[Suspicion], pairs: Sequence[tuple[Hypothesis, Hypothesis]]
) -> list[int]:
    """The detector's columns that their hypotheses are combinations of."""
    found: set[int] = set()
    for s in suspicions:
        for _, batch, p in s.batches(detector):
            used = np.any([np.any(batch.histories[h].weights, axis=0) for h in s.histories(batch)], axis=0)
            found |= set(batch.columns[p][used].tolist())
    for pair in pairs:
        for h in pair:
            own, weights = h.combination()
            found |= set(own[np.any(weights, axis=0)].tolist())
    return sorted(found)


def _listed(ordered: Sequence[_P]) -> list[_P]:
    """All loads, and of sensors the best."""
    best = [p for p in ordered if p.experiment.startswith(AT)][:SENSORS]
    return [p for p in ordered if not p.experiment.startswith(AT) or p in best]


def _foresight(
    detector: Detector, now: Sight, s: Suspicion, stated: float, basis: Basis, made: Sequence[Foreseen]
) -> Foresight:
    """stated: its limit today. What is read and not in proportion to its size has another one than by its derivative,
    which counts for what experiments bring."""
    batches = s.batches(detector)
    told = fault_of(batches[0][1]).curve.told
    today = np.inf
    best = np.full(len(made), np.inf)
    for k, batch, p in batches:
        chosen = s.histories(batch)
        information = now.ready[k].information[p, chosen]
        today = min(today, _limit(detector, batch, p, information, chosen))
        W = np.stack([basis.spread(batch.columns[p], batch.histories[h].weights) for h in chosen])  # (h, q, 2 u)
        for e, f in enumerate(made):
            without, then = (_information(F, W) for F in (f.before, f.after))
            share = np.clip(information / np.maximum(without, 1e-30), LEAST, 1.0)
            more = information + share * np.maximum(then - without, 0.0)
            best[e] = min(best[e], _limit(detector, batch, p, more, chosen))
    if np.isfinite(stated):
        today, best = stated, best * stated / today
    proposals = [
        Proposal(f.name, f.words, told(float(size)), float(today / size)) for f, size in zip(made, best, strict=True)
    ]
    proposals.sort(key=lambda one: -one.gain)
    again = next(p.limit for p in proposals if p.experiment == AGAIN)
    largest = [told(batch.largest[p]) for _, batch, p in batches if batch.largest]
    return Foresight(
        s.family, s.place, s.unit, told(float(today)), again, max(largest, default=None),
        detector.thresholds[s.family], s.windowed, tuple(_listed(proposals)),
    )  # fmt: skip


def _limit(detector: Detector, batch: Batch, place: int, information: np.ndarray, chosen: Sequence[int]) -> float:
    """Of the information (h,) of chosen histories, as `limits.limits_at` takes it."""
    histories = [batch.histories[h] for h in chosen]
    sizes = seen_from(detector, batch, place, information, histories)
    return float(over_histories(histories, np.maximum(sizes, batch.smallest)))


def _hour(detector: Detector, key: Key) -> tuple[str, str, int] | None:
    kind, place, history = key
    first = begins(detector.elements.histories, history)
    return None if first is None else (kind, place, first)


def _information(F: np.ndarray, W: np.ndarray) -> np.ndarray:
    """(h,) of the first amplitudes, of weights W (h, q, 2 u)."""
    own = np.einsum("hql,lm,hrm->hqr", W, F, W, optimize=True)
    trace = np.trace(own, axis1=1, axis2=2)[:, None, None]
    inverse = np.linalg.inv(own + (trace * RIDGE + 1e-12) * np.eye(own.shape[1]))
    return np.asarray(1.0 / np.maximum(inverse[:, 0, 0], 1e-30))


def _apart(a: Hypothesis, b: Hypothesis, basis: Basis, made: Sequence[Foreseen], apart: float) -> Apart:
    """What each experiment makes of LR (1 - cos^2), with the first one true at its fitted size."""

    def fitted(h: Hypothesis) -> np.ndarray:
        own, weights = h.combination()
        return basis.spread(own, (np.asarray(h.amplitude) @ weights)[None])[0]

    one, two = fitted(a), fitted(b)

    def explained(F: np.ndarray) -> tuple[float, float]:
        aa, bb, ab = float(one @ F @ one), float(two @ F @ two), float(one @ F @ two)
        return aa, max(aa - ab**2 / max(bb, 1e-30), 0.0)

    found = []
    for f in made:
        aa, before = explained(f.before)
        share = float(np.clip(a.statistic / max(aa, 1e-30), LEAST, 1.0))
        found.append((f, share * before, share * explained(f.after)[1]))
    separations = sorted((Separation(f.name, f.words, then) for f, _, then in found), key=lambda s: -s.expected)
    today = float(np.median([before for _, before, _ in found])) if found else 0.0
    return Apart(f"{a.family} {a.name}", f"{b.family} {b.name}", today, apart, tuple(_listed(separations)))

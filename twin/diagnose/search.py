"""Forward selection: name the best cause, refit everything exactly, look again, until nothing passes its threshold.

Every refit may show that a cause was a stopgap for another: what no longer explains half its threshold, or has become
too small to name or negative, is dropped and not looked at again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from twin.diagnose.accepted import Accepted, exchanged, freed, parameter_of, readings_columns
from twin.diagnose.acted import CONDUCTS, units_of
from twin.diagnose.batch import Hypothesis, best
from twin.diagnose.contest import beginning, judged, misfit, proof
from twin.diagnose.fitter import Fitted
from twin.diagnose.growth import grown
from twin.diagnose.lost import lost_candidates
from twin.diagnose.refit import refit
from twin.diagnose.search_declared import declared_candidates
from twin.diagnose.settled import settled
from twin.diagnose.sight import Sight, sight
from twin.diagnose.sizes import sized_candidates
from twin.diagnose.study import K, Study
from twin.diagnose.unknown import Heat, evidence
from twin.diagnose.yardstick import Yardstick

PULLED = 2.5  # standard deviations, of what tolerances allow a settled parameter, beyond which it is out of tolerance
BEYOND = 3.0  # prior standard deviations likewise of one that was fitted with errors of form
TOLD = 0.94  # variance of a settled parameter that says something of its own
MOST = 3  # causes
LATER = 2.5  # times its threshold that a cause beside another one needs: the first one's misfits look like causes
TRIES = 3  # rounds of candidates that the exact model refuses
COVERS = 0.9  # of the evidence for heat of any history that a name must explain
WINDOWS = 4  # in which a cause comes and goes at one place; what does so more often has a history that no name tells
FEW = 2  # windows likewise that a cause may have and still leave heat where it is
SEVERAL = ("initial_state",)  # families that come part by part: one of them explains a share
ALIKE = 0.9  # cosine of what a signal's factor and a declared number do, from which the one may be the other
AHEAD = 12  # of those that pass, how many get further windows before the best is chosen
NAMED = 0.7  # share of its own threshold that a name needs where another one passes
STANDS = 0.5  # share of its threshold that a cause must explain beside the others
NEAR = 10.0  # likelihood-ratio units within which another explanation is a rival


@dataclass(frozen=True)
class Step:
    """What the search saw before it accepted something, or stopped."""

    ranked: tuple[Hypothesis, ...]  # the best of every family and place
    cosine: np.ndarray  # (n, n) among the ranked
    observed: dict[str, float]  # per family, and "unknown"
    parts: dict[str, float]  # evidence of unknown heat per part


@dataclass(frozen=True)
class Search:
    """The whole search."""

    yardstick: Yardstick
    x0: np.ndarray  # (n,) settled without a cause
    x: np.ndarray  # (n,) and with the accepted ones
    accepted: tuple[Accepted, ...]
    steps: tuple[Step, ...]  # one more than were accepted, the dropped ones among them
    residual: np.ndarray  # (m,) linearised, of the last fit, accepted amplitudes left in
    g: np.ndarray  # (n_columns,) after the accepted ones
    heat: Heat  # likewise
    covariance: np.ndarray  # (n, n) of x


def search(yard: Yardstick, y: np.ndarray, most: int = MOST) -> Search:
    """Causes in measurements y (m,) of the fitted runs, NaN where something is missing."""
    fitted = yard.fitter(y)
    x0, covariance = settled(yard, y, ())
    declared = declared_candidates(yard, y, fitted)
    relaxed = _strained(yard, y, fitted, x0, covariance)
    if relaxed and (closed := _closed(yard, y, fitted, declared, relaxed, x0)):
        return closed
    accepted, steps = list[Accepted](), list[Step]()
    refused, fruitless, imitated = set[tuple[str, str]](), 0, False
    while True:
        seen, ranked, step = _look(yard, fitted, () if accepted or refused else declared)
        if restless := _restless(yard, accepted, step.parts):
            imitated = True
            fitted, accepted = _without(yard, y, fitted, accepted, restless)
            seen, ranked, step = _look(yard, fitted)
        steps.append(step)
        parts = step.parts
        used = sum((len(a.units) for a in accepted), 0)
        limits = {name: (LATER if accepted else 1.0) * value for name, value in yard.thresholds.items()}
        alarm = any(h.statistic > limits[h.family] and (h.family, h.name) not in refused for h in ranked)
        passing = [
            h for h in ranked
            if alarm and h.statistic > NAMED * limits[h.family] and used + h.batch.q <= K
            and (h.family, h.name) not in refused and not _again(h, accepted)
        ]  # fmt: skip
        if not passing or len(accepted) >= most or fruitless >= TRIES or imitated:
            break
        proved, others = judged(
            yard, exchanged(yard.study, y, accepted), fitted, [_with_more_windows(seen, h) for h in passing[:AHEAD]]
        )
        standing = [h for h in proved if proof(yard, h) > NAMED * limits[h.family]]
        if not any(proof(yard, h) > limits[h.family] for h in standing):
            refused.update((h.family, h.name) for h in proved)
            fruitless += 1
            continue
        # heat of any history pays for its freedom: a name that explains less than that has imitated it
        free = max(parts.values(), default=0.0)
        if free > yard.thresholds["unknown"]:
            standing = [
                h for h in standing
                if (h.statistic > COVERS * free or h.family in SEVERAL)
                and (len(h.when.windows) <= WINDOWS or h.when.bell is not None or h.name.startswith("environment."))
            ]  # fmt: skip
            if not standing:
                break
        chosen = standing[0]
        rivals = _rivals(yard, fitted, chosen, [*standing, *others, *ranked])
        start = np.array(chosen.amplitude)
        units = units_of(yard.study, chosen)
        accepted.append(
            Accepted(chosen, units, start, np.eye(len(start)), chosen.statistic, yard.thresholds[chosen.family], rivals)
        )
        fitted, accepted = refit(yard, y, beginning(fitted.x), accepted)
        while weak := [a for a in accepted if not _stands(a)]:
            refused.update((a.hypothesis.family, a.hypothesis.name) for a in weak)
            fitted, accepted = _without(yard, y, fitted, accepted, weak)
        if in_turn := _in_turn(yard.study, accepted):
            imitated = True
            fitted, accepted = _without(yard, y, fitted, accepted, in_turn)
    x, covariance = settled(yard, y, accepted) if accepted else (x0, covariance)
    return Search(yard, x0, x, tuple(accepted), tuple(steps), fitted.residual, seen.g, seen.heat, covariance)


def _without(
    yard: Yardstick, y: np.ndarray, fitted: Fitted, accepted: Sequence[Accepted], dropped: Sequence[Accepted]
) -> tuple[Fitted, list[Accepted]]:
    """The fit with the accepted causes that are not dropped."""
    left = [a for a in accepted if a not in dropped]
    return refit(yard, y, fitted.x, left) if left else (yard.fitter(y), left)


def _look(yard: Yardstick, fitted: Fitted, more: Sequence[Hypothesis] = ()) -> tuple[Sight, list[Hypothesis], Step]:
    """All hypotheses there and some more, the best of every family and place first."""
    white = yard.whiten(fitted.residual)
    seen = sight(yard.columns, fitted.projector, white)
    lost = lost_candidates(yard.lost, yard.columns.batches, fitted.projector, white)
    sized = sized_candidates(yard, fitted.projector, white)
    ranked = _distinct(sorted([*best(seen.ready, seen.g), *lost, *sized, *more], key=lambda h: -h.statistic))
    top = ranked[:10]
    return seen, ranked, Step(tuple(top), _cosines(yard, fitted, top), seen.largest(), evidence(seen.heat, seen.g))


def _closed(
    yard: Yardstick, y: np.ndarray, before: Fitted, declared: Sequence[Hypothesis], relaxed: tuple[Fitted, Accepted],
    x0: np.ndarray,
) -> Search | None:  # fmt: skip
    """The search that ends with one declared number out of its tolerance; None where that leaves something, or where
    something else that was seen before explains more. Signals that explain as much are its rivals."""
    fitted, one = relaxed
    _, ranked, first = _look(yard, before, declared)
    seen, left, last = _look(yard, fitted)
    misfits = (1.0 - COVERS) * one.statistic  # that it may leave
    room = max(yard.thresholds["unknown"], misfits)
    if not _weak(yard, left, misfits) or max(last.parts.values(), default=0.0) > room:
        return None
    removed = misfit(yard, before) - misfit(yard, fitted)
    others = max((h.statistic - NEAR * any(h is d for d in declared) for h in ranked), default=0.0)
    if not _weak(yard, ranked) and removed < others:
        return None
    # both begin at the declared number: what either explains is the same but for what is left
    as_much = (replace(h, statistic=h.statistic - removed + one.statistic) for h in declared)
    rivals = tuple((h, 1.0) for h in as_much if h.statistic > one.statistic - NEAR and _reads(yard, h, one))
    one = replace(one, hypothesis=replace(one.hypothesis, statistic=one.statistic), rivals=rivals)
    x, covariance = settled(yard, y, (one,))
    return Search(yard, x0, x, (one,), (first, last), fitted.residual, seen.g, seen.heat, covariance)


def _reads(yard: Yardstick, signal: Hypothesis, one: Accepted) -> bool:
    """Whether a factor of a signal does what a declared number does: it is read there, and nearly nowhere else."""
    (j,) = freed(yard.study, one.hypothesis)
    pair = np.column_stack([
        readings_columns(yard, signal)[:, 0],
        yard.whiten(yard.fitter.surrogate.at(np.zeros(len(yard.study.bench.parameters)))[1][:, j]),
    ])  # fmt: skip
    gram = pair.T @ pair
    return bool(abs(gram[0, 1]) > ALIKE * np.sqrt(gram[0, 0] * gram[1, 1]))


def _weak(yard: Yardstick, ranked: Sequence[Hypothesis], misfits: float = 0.0) -> bool:
    """Whether nothing is strong enough to be named beside another cause."""
    return all(h.statistic < max(LATER * yard.thresholds[h.family], misfits) for h in ranked)


def _strained(
    yard: Yardstick, y: np.ndarray, fitted: Fitted, x0: np.ndarray, covariance: np.ndarray
) -> tuple[Fitted, Accepted] | None:
    """The declared source or film that calibration moves farthest, freed of its tolerance; None if all are within.

    x0 (n,), covariance (n, n): settled. Where tolerances are right, x0 has the variance 1 - covariance.
    """
    variance = np.diag(covariance)
    pulls = np.where(variance < TOLD, x0 / np.sqrt(np.maximum(1.0 - variance, 1.0 - TOLD)), 0.0)
    strain = np.maximum(np.abs(pulls) / PULLED, np.abs(fitted.x) / BEYOND)
    found = []
    for batch in yard.columns.batches:
        for i, name in enumerate(batch.places if batch.kind in ("gain", *CONDUCTS) else ()):
            if (j := parameter_of(yard.study, name)) is None:
                continue
            always = next(h for h in batch.histories if not h.windows)
            size = float(fitted.x[j] * yard.study.scale[j])
            if batch.kind in CONDUCTS:
                size = float(np.expm1(size))
            likelihood = float((PULLED * strain[j]) ** 2)
            found.append(Hypothesis(batch, i, always, likelihood, (size,), float(yard.study.scale[j] ** -2.0)))
    top = max(found, key=lambda h: h.statistic, default=None)
    if top is None or top.statistic < PULLED**2:
        return None
    units = units_of(yard.study, top)
    one = Accepted(top, units, np.array(top.amplitude), np.eye(1), top.statistic, PULLED**2, ())
    fitted, (one,) = refit(yard, y, beginning(fitted.x), [one])
    change, sigma = float(one.amplitude[0]), float(np.sqrt(one.covariance[0, 0]))
    if not sigma > 0.0:  # it has run to where it changes nothing
        return None
    if top.batch.kind in CONDUCTS:  # as a logarithm: derivatives at many times a film say little of the film itself
        change, sigma = float(np.log1p(change)), sigma / (1.0 + change)
    return fitted, replace(one, statistic=(change / sigma) ** 2)


def _with_more_windows(seen: Sight, h: Hypothesis) -> Hypothesis:
    k = next(i for i, own in enumerate(seen.ready) if own.batch is h.batch)
    return grown(h, seen.g, seen.blocks[k][h.place])


def _again(h: Hypothesis, accepted: Sequence[Accepted]) -> bool:
    return any(h.family == a.hypothesis.family and h.name == a.hypothesis.name and h.when.name == a.hypothesis.when.name
               for a in accepted)  # fmt: skip


def _in_turn(study: Study, accepted: Sequence[Accepted]) -> list[Accepted]:
    """Causes that come and go at one part, of several families or twice at one place: together they imitate a history
    that none has."""
    passing = [(a, _parts(study, a.hypothesis.name)) for a in accepted if a.hypothesis.when.windows and a.units]
    return [
        a for a, own in passing
        if any(own & other and b is not a and _differ(a.hypothesis, b.hypothesis) for b, other in passing)
    ]  # fmt: skip


def _differ(a: Hypothesis, b: Hypothesis) -> bool:
    return a.family != b.family or a.name == b.name


def _restless(yard: Yardstick, accepted: Sequence[Accepted], parts: dict[str, float]) -> list[Accepted]:
    """Causes that come and go more than FEW times and leave heat at their part: a history that no name tells."""
    return [
        a for a in accepted
        if len(a.hypothesis.when.windows) > FEW and a.hypothesis.when.bell is None and a.units
        and any(parts.get(p, 0.0) > LATER * yard.thresholds["unknown"] for p in _parts(yard.study, a.hypothesis.name))
    ]  # fmt: skip


def _parts(study: Study, name: str) -> set[str]:
    """The parts that a surface or a film belongs to."""
    head, _, rest = name.partition(".")
    if head == "films":
        return {p.name.partition(".")[0] for p in study.bench.places if p.film == rest}
    return {head}


def _stands(a: Accepted) -> bool:
    """Whether a cause still explains something beside the others."""
    batch = a.hypothesis.batch
    if batch.fixed:
        return True
    first = float(a.amplitude[0])
    return (
        float(a.amplitude @ np.linalg.pinv(a.covariance, hermitian=True) @ a.amplitude) > STANDS * a.threshold
        and abs(first) >= 0.5 * batch.smallest
        and (batch.sign == 0 or batch.sign * first > 0.0)
    )


def _distinct(ranked: Sequence[Hypothesis]) -> list[Hypothesis]:
    """The best of every family, place and kind."""
    seen: set[tuple[str, str, str]] = set()
    result = []
    for h in ranked:
        key = (h.family, h.name, h.batch.kind)
        if key not in seen:
            seen.add(key)
            result.append(h)
    return result


def _direction(yard: Yardstick, h: Hypothesis) -> np.ndarray:
    """(m,) white response at the fitted amplitudes."""
    return np.asarray(readings_columns(yard, h) @ np.array(h.amplitude))


def _cosines(yard: Yardstick, fitted: Fitted, hypotheses: Sequence[Hypothesis]) -> np.ndarray:
    if not hypotheses:
        return np.zeros((0, 0))
    D = np.stack([_direction(yard, h) for h in hypotheses], axis=1)
    gram = D.T @ fitted.projector(D)
    size = np.sqrt(np.maximum(np.diag(gram), 1e-30))
    return np.asarray(np.clip(gram / np.outer(size, size), -1.0, 1.0))


def _rivals(
    yard: Yardstick, fitted: Fitted, chosen: Hypothesis, ranked: Sequence[Hypothesis]
) -> tuple[tuple[Hypothesis, float], ...]:
    """Other explanations nearly as likely, with their cosines."""
    others, seen = [], {(chosen.family, chosen.name, chosen.batch.kind)}
    for h in sorted(ranked, key=lambda h: -h.statistic):
        key = (h.family, h.name, h.batch.kind)
        if key not in seen and h.statistic > max(chosen.statistic - NEAR, 0.5 * yard.thresholds[h.family]):
            seen.add(key)
            others.append(h)
    others = others[:8]
    cosine = _cosines(yard, fitted, [chosen, *others])
    return tuple((h, float(cosine[0, i + 1])) for i, h in enumerate(others))

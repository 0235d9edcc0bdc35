"""From a search to a verdict, its causes in the words of a description, and what is left unknown."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from twin.diagnose.evidence.fitter import bounds
from twin.diagnose.faults.fault import Described, Family
from twin.diagnose.faults.table import fault_of
from twin.diagnose.model.study import COMPONENTS, Study
from twin.diagnose.result.diagnosis import Cause, Pull, Unknown, Verdict
from twin.diagnose.result.spot import Spot
from twin.diagnose.search.accepted import Accepted, freed
from twin.diagnose.search.any_heat import heat_blocks
from twin.diagnose.search.by_calibration import strained_of
from twin.diagnose.search.look import Search
from twin.diagnose.search.policy import POLICY, SearchPolicy
from twin.diagnose.search.rivals import as_good, rival_beside
from twin.rom.parameter import OF_LAWS


def cause_of(a: Accepted, study: Study, policy: SearchPolicy = POLICY) -> Cause:
    """A cause as reports and edits take it. The interval counts that the model's own form is wrong (`Fault.own`)."""
    h, fault = a.hypothesis, fault_of(a.hypothesis)
    value, variance = float(a.amplitude[0]), max(float(a.covariance[0, 0]), 0.0)
    sigma = 0.0 if h.batch.fixed else float(np.hypot(np.sqrt(variance), fault.uncertain(value)))
    told = fault.curve.told
    low, high = value - policy.sure * sigma, value + policy.sure * sigma
    if value > 0.0:  # what a conductance has gained is known by a factor, what it has lost by a share
        change, spread = fault.log_change(value, sigma)
        low, high = (fault.amplitude(change + z * spread)[0] for z in (-policy.sure, policy.sure))
    if h.batch.sign:  # the interval ends where physics does
        low, high = (max(low, 0.0), high) if h.batch.sign > 0 else (low, min(high, 0.0))
    size = told(value), told(low), told(high)
    said = fault.described(study, Described(h.name, size, h.when.windows), a.amplitude, a.covariance)
    value, low, high = said.size
    if fault.corrects:
        low, high = _factors(a)
    if fault.exchanges:  # there is no size
        value, low, high = (math.nan,) * 3
    settings = said.settings
    if h.when.signal:
        units = {s.name: s.unit for s in study.probed.base.load_model.signals}
        settings = settings | {"reference": h.when.reference, "reference_unit": units.get(h.when.signal, "")}
    return Cause(
        family=h.family, place=said.place, parameter="", amplitude=value, ci95=(low, high), unit=h.batch.unit,
        statistic=float(a.statistic), threshold=float(a.threshold), history=h.when.name, signal=h.when.signal,
        exponent=h.when.exponent, windows=said.windows, settings=settings,
        rivals=tuple(rival_beside(a.hypothesis, other, cosine, policy) for other, cosine in a.rivals),
    )  # fmt: skip


def _factors(a: Accepted) -> tuple[float, float]:
    """The smallest and the largest of the exact factors of one signal that explain nearly as much."""
    told = [fault_of(h).factor(h.name) for h in (a.hypothesis, *(h for h, _ in a.rivals)) if fault_of(h).corrects]
    factors = [factor for signal, factor in told if signal == told[0][0]]
    return min(factors), max(factors)


def verdict_of(found: Search, families: Sequence[Family]) -> tuple[Verdict, tuple[Cause, ...]]:
    """The verdict, and the causes it rests on."""
    entries, sensors = {f.name: f for f in families}, {f.name for f in families if f.group == "sensor"}
    thresholds, policy = found.detector.thresholds, found.detector.policy
    left = max(found.steps[-1].parts.values(), default=0.0)
    relaxed = any(freed(found.detector.study, a.hypothesis) for a in found.accepted)
    # calibration had imitated what is in the machine before, as far as tolerances went
    imitated = [a.statistic for a in found.accepted if a.units or fault_of(a.hypothesis).parameter]
    before = max([*found.steps[0].parts.values(), *imitated], default=0.0)
    causes = tuple(cause_of(a, found.detector.study, found.detector.policy) for a in found.accepted)
    much = left > thresholds["unknown"] and (not causes or left > policy.remainder * before)
    if much and not _more_alike(found, left):
        # a declaration is not corrected while something else is at work; a sensor is not part of the machine
        return "unknown", tuple(c for c in causes if c.family in sensors)
    if not causes:
        if found.poor:  # whose parameters go wherever they hide its form
            return "too_poor", ()
        if not (strained := strained_of(found)):
            return "nothing", ()
        return "ambiguous" if strained[0].rivals else "out_of_tolerance", strained
    chosen, lead = found.accepted[0], found.accepted[0].hypothesis
    # a tolerance tells it, and it has passed no threshold: what explains as much was chosen with it
    unproved = relaxed and chosen.threshold < thresholds[lead.family]
    for other, _ in chosen.rivals:
        alike = other.family == lead.family and Spot.read(other.name).owner == Spot.read(lead.name).owner
        # two histories of one place, and two factors of one signal, are written otherwise into the description
        two = fault_of(lead).corrects or (lead.when.signal and other.when.name != lead.when.name)
        same = alike and not two
        # heat where a source may be is one of many like it, and would not be named alone: beside that source it is
        there = fault_of(lead).elsewhere and other.batch.unit == "W" and Spot.read(lead.name).partner == other.name
        passes = as_good(other, lead, policy) and (there or other.statistic >= thresholds[other.family])
        if not same and (unproved or passes):
            return "ambiguous", causes
    # a sensor at fault does not keep what is beside it out of the description
    others = [c for c in causes if c.family not in sensors]
    if not others:
        return "sensor", causes
    first, entry = others[0], entries.get(others[0].family)
    if entry is None:
        return "named", causes
    if entry.group == "signal":
        return "signal", causes
    whole = entry.declared and first.history == "always" and Spot.read(first.place).declared
    return ("out_of_tolerance" if whole else "named"), causes


def _more_alike(found: Search, left: float) -> bool:
    """Whether as many causes as a search takes are all of a family that comes part by part, and one more of them
    explains what is left: nothing about a body that was warm is unknown."""
    alike = {(a.hypothesis.family, Spot.read(a.hypothesis.name).within) for a in found.accepted}
    best, policy = next(iter(found.steps[-1].ranked), None), found.detector.policy
    return (
        len(found.accepted) >= policy.causes and best is not None and fault_of(best).several
        and alike == {(best.family, Spot.read(best.name).within)} and best.statistic > policy.covers * left
    )  # fmt: skip


def unknown_of(found: Search) -> Unknown | None:
    """The unknown heat, where its evidence passes."""
    if not found.entering:
        return None
    (first, *others), study = found.entering, found.detector.study
    blocks, told, histories = heat_blocks(study), first.told, {}
    for k, (name, dt) in zip(study.fitted, study.fitted_runs, strict=True):
        own = [b for b, (i, _, _) in enumerate(blocks) if i == k]
        when = tuple((blocks[b][1] + blocks[b][2]) / 2 * dt for b in own)
        histories[name] = (when, tuple(map(float, told.heat[own])), tuple(map(float, told.sigma[own])))
    correlated = []
    for signal in study.runs[0].run.signals:
        means = []
        for i, start, end in blocks:
            values = study.runs[i].run.signals.get(signal)
            means.append(float(np.abs(values[start:end]).mean()) if values is not None else 0.0)
        if np.ptp(means) > 0 and np.ptp(told.heat) > 0:
            correlated.append((signal, float(np.corrcoef(means, told.heat)[0, 1])))
    correlated.sort(key=lambda s: -abs(s[1]))
    return Unknown(
        first.part, first.surface, first.evidence, found.detector.thresholds["unknown"], histories,
        tuple(correlated[:5]), tuple(own.surface for own in others),
    )  # fmt: skip


def _changes(change: np.ndarray, study: Study) -> dict[str, np.ndarray]:
    """(n,) K and m by channel: rms over the run in which it is changed most by each column (m, n)."""
    found: dict[str, np.ndarray] = {}
    for planned, T, w in study.split(change):
        for names, values in ((planned.measured.sensors, T), (COMPONENTS, w)):
            rms = np.sqrt(np.mean(np.square(values), axis=0)) if values.size else np.zeros((0, change.shape[1]))
            found |= {name: np.maximum(own, found.get(name, 0.0)) for name, own in zip(names, rms, strict=False)}
    return found


def pulls_of(found: Search) -> tuple[Pull, ...]:
    """How far the last fit moved every declared parameter, and the causes those whose place they take."""
    study = found.detector.study
    low, high = bounds(study)
    sigma = np.sqrt(np.maximum(np.diag(found.covariance), 0.0))
    x = np.clip(found.x, low, high)
    changes = _changes(found.detector.fitter.linear(np.zeros(len(x)))[1] * x, study)
    pulls = [
        Pull(p.path, p.nominal, float(np.clip(p.value(float(c)), p.low, p.high)), float(s), float(c), p.unit,
             changes={name: float(own[j]) for name, own in changes.items()})
        for j, (p, c, s) in enumerate(zip(study.probed.parameters, x, sigma, strict=True)) if p.kind not in OF_LAWS
    ]  # fmt: skip
    for a in found.accepted:
        change, spread = float(a.amplitude[0]), float(np.sqrt(max(a.covariance[0, 0], 0.0)))
        change, spread = fault_of(a.hypothesis).log_change(change, spread)
        for j in freed(study, a.hypothesis):  # held at its declared value in x
            p, pull = study.probed.parameters[j], change / float(study.scale[j])
            pulls[j] = Pull(p.path, p.nominal, p.value(pull), spread / float(study.scale[j]), pull, p.unit, freed=True)
    return tuple(pulls)


def with_faults(
    verdict: Verdict, causes: tuple[Cause, ...], faults: Sequence[Cause]
) -> tuple[Verdict, tuple[Cause, ...]]:
    """The verdict with what was found without a search: sensors that stand still, leap or break."""
    return "sensor" if faults and verdict in ("nothing", "too_poor") else verdict, (*faults, *causes)

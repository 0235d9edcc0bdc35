"""From a search to a verdict, its causes in the words of a description, and what is left unknown."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.evidence.fitter import bounds
from twin.diagnose.evidence.pulls import Loose
from twin.diagnose.evidence.unknown import history
from twin.diagnose.faults.fault import Described, Family
from twin.diagnose.faults.table import family_of_parameter, fault_of
from twin.diagnose.model.study import Study
from twin.diagnose.result.diagnosis import Cause, Pull, Rival, Unknown, Verdict
from twin.diagnose.result.spot import Spot
from twin.diagnose.search.accepted import Accepted, freed, parameter_of, readings_columns
from twin.diagnose.search.detector import Detector
from twin.diagnose.search.look import Search
from twin.diagnose.search.policy import POLICY, SearchPolicy
from twin.rom.parameter import OF_LAWS, Parameter

CALIBRATED = "by calibration"  # history of a cause that calibration absorbs: it is no extension of the model


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
    settings = said.settings | ({"reference": h.when.reference} if h.when.signal else {})
    return Cause(
        family=h.family, place=said.place, parameter="", amplitude=value, ci95=(low, high), unit=h.batch.unit,
        statistic=float(a.statistic), threshold=float(a.threshold), history=h.when.name, signal=h.when.signal,
        exponent=h.when.exponent, windows=said.windows, settings=settings,
        rivals=tuple(_rival(a.hypothesis, other, cosine, policy) for other, cosine in a.rivals),
    )  # fmt: skip


def _factors(a: Accepted) -> tuple[float, float]:
    """The smallest and the largest of the exact factors of one signal that explain nearly as much."""
    told = [fault_of(h).factor(h.name) for h in (a.hypothesis, *(h for h, _ in a.rivals)) if fault_of(h).corrects]
    factors = [factor for signal, factor in told if signal == told[0][0]]
    return min(factors), max(factors)


def rival_of(h: Hypothesis, cosine: float, remedy: str = "", policy: SearchPolicy = POLICY) -> Rival:
    """A hypothesis in a row of a table. Its interval is that of an amplitude that enters linearly, of which the
    statistic is (amplitude / sigma)^2; an exact factor has none."""
    value, place, fault = h.amplitude[0], h.name, fault_of(h)
    if fault.corrects:
        place, factor = fault.factor(place)
        return Rival(h.family, place, h.when.name, factor, h.batch.unit, h.statistic, cosine, remedy)
    half = policy.sure * abs(value) / math.sqrt(h.statistic) if h.statistic > 0.0 and not h.batch.fixed else math.nan
    told = fault.curve.told
    ci95 = (told(value - half), told(value + half))
    return Rival(h.family, place, h.when.name, told(value), h.batch.unit, h.statistic, cosine, remedy, ci95)


def _rival(chosen: Hypothesis, other: Hypothesis, cosine: float, policy: SearchPolicy) -> Rival:
    apart = min(chosen.statistic, other.statistic) * (1.0 - cosine**2) > policy.apart
    return rival_of(other, cosine, "" if apart and not _as_good(other, chosen, policy) else remedy(chosen, other))


def _as_good(other: Hypothesis, lead: Hypothesis, policy: SearchPolicy) -> bool:
    """Whether another hypothesis explains what the leading one does, but for chance and the error of its response: the
    data have decided nothing then, however unlike each other they are."""
    price = policy.amplitude * (other.batch.q - lead.batch.q)
    return other.statistic - price > lead.statistic - max(policy.close, policy.misfit * lead.statistic)


def remedy(a: Hypothesis, b: Hypothesis) -> str:
    """What would tell two causes apart that these data do not."""
    wrong = next((h for h in (a, b) if fault_of(h).corrects), None)
    if wrong is not None:
        return _reading(wrong)
    if a.name != b.name and a.when.name == b.when.name:
        return sensor_between(a.name, b.name)
    if a.name == b.name and fault_of(a).read and fault_of(b).read:
        return f"a longer run, measured twice as often: {a.when.name} and {b.when.name} differ there"
    signals = [h.when.signal for h in (a, b) if h.when.signal]
    if a.name == b.name and a.when.signal and a.when.signal == b.when.signal:
        return f"a run with {a.when.signal} held for 2 h each at a third, two thirds and all of its range"
    if signals:
        return f"a run in which {' and '.join(dict.fromkeys(signals))} work alone, and one in which they rest"
    if a.name == b.name:
        both = f"{a.family} and {b.family}"
        return f"a run in which the air is 5 K colder, and one that cools from standstill: {both} differ there"
    return f"temperature sensors at {a.name} and at {b.name}"


def sensor_between(a: str, b: str) -> str:
    return f"a temperature sensor between {a} and {b}, nearer to one of them"


def _reading(h: Hypothesis) -> str:
    """What tells whether a signal is declared rightly."""
    signal, _ = fault_of(h).factor(h.name)
    return f"one reading of {signal} beside an instrument, or what the drive's manual says it logs"


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
        passes = _as_good(other, lead, policy) and other.statistic >= thresholds[other.family]
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


def strained_of(found: Search) -> tuple[Cause, ...]:
    """Declared parameters that calibration alone moved out of their tolerance, at their values without one. Of one that
    has come near a bound of the calibration, the interval reaches as far as physics allows. What passes its threshold
    beside them and could not be named is their rival."""
    result, detector = [], found.detector
    unnamed = [h for h in found.steps[-1].ranked if h.statistic > detector.thresholds[h.family]]
    sure, ends = detector.policy.sure, detector.policy.nearly * np.array(bounds(detector.study))
    for own in found.loose:
        p = detector.study.probed.parameters[own.index]
        # a factor; of what is declared as nought the value itself
        unit, one = ("1", p.nominal) if p.nominal else (p.unit, 1.0)
        gain, *ends95 = (p.value(own.x + z * own.sigma) / one for z in (0.0, -sure, sure))
        low, high = sorted(ends95)
        if own.settled and not ends[0, own.index] < own.x < ends[1, own.index]:
            far = _farthest(detector, own.index, own.x)
            low, high = (low, max(high, far)) if own.x > 0.0 else (min(low, far), high)
        place = _place(p)
        rivals = [rival_of(h, cosine, _reading(h)) for h, cosine in own.rivals]
        others = (h for h in unnamed if h.name != place)
        rivals += [rival_of(h, _cosine(detector, own, h), sensor_between(place, h.name)) for h in others]
        result.append(Cause(
            family=family_of_parameter(p), place=place, parameter=p.path, amplitude=gain, ci95=(low, high), unit=unit,
            statistic=own.strain**2, threshold=1.0, history=CALIBRATED, rivals=tuple(rivals),
        ))  # fmt: skip
    return tuple(sorted(result, key=lambda c: -c.statistic))


def _place(p: Parameter) -> str:
    """What a declared number belongs to, as other causes call it: a node by its name alone."""
    entry = p.path.split(".")[: 3 if p.component >= 0 else 2]  # of a table in a table, as [tcp.expansion]
    return ".".join(entry).removeprefix("nodes.")


def _cosine(detector: Detector, own: Loose, h: Hypothesis) -> float:
    """Of what a declared number out of its tolerance and a hypothesis do."""
    a = np.sign(own.x) * detector.whiten(detector.fitter.linear(np.zeros(len(detector.study.scale)))[1][:, own.index])
    b = readings_columns(detector, h) @ np.array(h.amplitude)
    return float(a @ b) / max(float(np.linalg.norm(a) * np.linalg.norm(b)), 1e-30)


def _farthest(detector: Detector, j: int, x: float) -> float:
    """The factor of a declared number that physics allows, the largest for x > 0, the smallest for x < 0; 1 where no
    range is known."""
    for batch in detector.columns.batches:
        fault = fault_of(batch)
        for name, largest in zip(batch.places, batch.largest, strict=False) if fault.declared else ():
            if parameter_of(detector.study, name) == j:
                return fault.curve.told(float(np.sign(x)) * largest)
    return 1.0


def unknown_of(found: Search) -> Unknown | None:
    """The unknown heat, where its evidence passes."""
    detector = found.detector
    parts = found.steps[-1].parts
    if not parts or max(parts.values()) <= detector.thresholds["unknown"]:
        return None
    part = max(parts, key=lambda p: parts[p])
    surface, heat, sigma = history(found.heat, found.g, part)
    study = detector.study
    histories = {}
    blocks = detector.elements.histories.blocks
    for k, (name, dt) in zip(study.fitted, study.fitted_runs, strict=True):
        own = [b for b, (i, _, _) in enumerate(blocks) if i == k]
        when = tuple((blocks[b][1] + blocks[b][2]) / 2 * dt for b in own)
        histories[name] = (when, tuple(map(float, heat[own])), tuple(map(float, sigma[own])))
    correlated = []
    for signal in study.runs[0].run.signals:
        means = []
        for i, start, end in blocks:
            values = study.runs[i].run.signals.get(signal)
            means.append(float(np.abs(values[start:end]).mean()) if values is not None else 0.0)
        if np.ptp(means) > 0 and np.ptp(heat) > 0:
            correlated.append((signal, float(np.corrcoef(means, heat)[0, 1])))
    correlated.sort(key=lambda s: -abs(s[1]))
    return Unknown(part, surface, parts[part], detector.thresholds["unknown"], histories, tuple(correlated[:5]))


def _moves(change: np.ndarray, study: Study) -> tuple[np.ndarray, np.ndarray]:
    """(n,) K and (n,) m: rms over its run of the sensor, and the TCP component, that a column (m, n) changes most."""
    T, w = np.zeros(change.shape[1]), np.zeros(change.shape[1])
    for _, *of_run in study.split(change):
        for most, values in zip((T, w), of_run, strict=True):
            if values.size:
                np.maximum(most, np.sqrt(np.mean(np.square(values), axis=0)).max(axis=0), out=most)
    return T, w


def pulls_of(found: Search) -> tuple[Pull, ...]:
    """How far the last fit moved every declared parameter, and the causes those whose place they take."""
    study = found.detector.study
    low, high = bounds(study)
    sigma = np.sqrt(np.maximum(np.diag(found.covariance), 0.0))
    x = np.clip(found.x, low, high)
    moves = _moves(found.detector.fitter.linear(np.zeros(len(x)))[1] * x, study)
    pulls = [
        Pull(p.path, p.nominal, float(np.clip(p.value(float(c)), p.low, p.high)), float(s), float(c), p.unit,
             temperature_change=float(T), displacement_change=float(w))
        for p, c, s, T, w in zip(study.probed.parameters, x, sigma, *moves, strict=True) if p.kind not in OF_LAWS
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

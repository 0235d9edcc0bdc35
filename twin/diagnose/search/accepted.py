"""Causes that a search has accepted, and what the model with them says."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np

from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.evidence.consistency import Size
from twin.diagnose.evidence.fitter import bounds
from twin.diagnose.evidence.settled import settle, settled_alone
from twin.diagnose.faults.acted import slots_with, units_of
from twin.diagnose.faults.fault import Unit
from twin.diagnose.faults.table import fault_of
from twin.diagnose.model.over_runs import over_runs
from twin.diagnose.model.slots import Slots
from twin.diagnose.model.study import Study
from twin.diagnose.result.spot import Spot
from twin.diagnose.search.detector import Derivatives, Detector

OWN = ("gain", "conductance", "total")  # how parameters of sources, films, contacts and joints are called there


@dataclass(frozen=True, eq=False)  # two are the same if they are one: arrays have no truth value
class Accepted:
    """A cause with its amplitudes after the last refit."""

    hypothesis: Hypothesis
    units: tuple[Unit, ...]  # none where it acts on what is read
    amplitude: np.ndarray  # (q,)
    covariance: np.ndarray  # (q, q)
    statistic: float
    threshold: float
    rivals: tuple[tuple[Hypothesis, float], ...]  # nearly as likely, with the cosine to this one
    by_run: tuple[Size, ...] = ()  # the first amplitude in each fitted run alone, after the last refit


def as_scored(study: Study, h: Hypothesis, threshold: float = 0.0) -> Accepted:
    """A hypothesis as a cause of the size that it scores with, before any refit; its covariance is not known yet."""
    amplitude = np.array(h.amplitude)
    return Accepted(h, units_of(study, h), amplitude, np.eye(len(amplitude)), h.statistic, threshold, ())


def parameter_of(study: Study, name: str) -> int | None:
    """The parameter of this path, or of what this is called OWN; None where `[[parameters]]` leaves it out."""
    paths = [p.path for p in study.probed.parameters]
    return next((paths.index(p) for p in (name, *(f"{name}.{own}" for own in OWN)) if p in paths), None)


def freed(study: Study, h: Hypothesis) -> list[int]:
    """The parameter, if any, whose place a cause takes: it stays as declared, for the two would share one change."""
    if not fault_of(h).declared or h.when.windows or h.when.signal:
        return []
    j = parameter_of(study, h.name)
    return [] if j is None else [j]


def untied_beside(study: Study, accepted: Sequence[Accepted]) -> list[int]:
    """The parameters that have no tolerance beside causes: of sources that emit by a law of another shape."""
    replaced = [a.hypothesis.name for a in accepted if fault_of(a.hypothesis).replaces]
    return [j for name in replaced if (j := parameter_of(study, name)) is not None]


def possible(detector: Detector, h: Hypothesis, amplitude: float) -> bool:
    """Whether physics allows a first amplitude of a hypothesis, within what the form of the model may have wrong; that
    of a known size always."""
    uncertain = detector.policy.sure * fault_of(h).uncertain(abs(amplitude))
    return h.batch.fixed or h.batch.possible(h.place, amplitude, uncertain)


def jacobian(
    detector: Detector, x: np.ndarray, causes: Sequence[tuple[Hypothesis, np.ndarray]], closely: bool
) -> np.ndarray:
    """(m, n) of the outputs by the parameters at x (n,) beside causes of these amplitudes (q,); the column of a number
    whose place a cause takes is empty. closely: with what parameters do to the response to strong ones.

    Causes that take a parameter's place are put there, for a film of nine times its size changes what every other
    parameter does. Conductances beyond their bounds, corrected signals and strong causes get derivatives made anew, as
    no surrogate knows of them, unless this diagnosis has made some nearer than `anew`: it goes on from these.
    """
    study = detector.study
    low, high = bounds(study)
    there, held, anew = x.copy(), list[int](), False
    for h, amplitude in causes:
        for j in freed(study, h):
            there[j] = fault_of(h).log_change(float(amplitude[0]))[0] / study.scale[j]
            held.append(j)
            anew |= fault_of(h).conducts and not low[j] <= there[j] <= high[j]
    beside = [(h, a) for h, a in causes if fault_of(h).corrects or (closely and strong(detector, h))]
    J = detector.fitter.surrogate.at(there)[1]
    if anew or beside:
        J += _unknown_to_surrogate(detector, there, J, beside)
    J[:, held] = 0.0
    return J


def strong(detector: Detector, h: Hypothesis) -> bool:
    """Whether an error of a twentieth of the response to a cause would pass for another cause. Not where the cause has
    the place of a parameter, beside whose change the surrogate knows what others do, nor in a poor model, whose slow
    errors hold more. A source that is elsewhere is strong whatever its size: the surrogate knows what its number does
    where the source is not."""
    if not units_of(detector.study, h) or freed(detector.study, h):
        return False
    if detector.poor:
        return fault_of(h).elsewhere
    return fault_of(h).elsewhere or misfits(detector, h, h.amplitude) > min(detector.thresholds.values())


def misfits(detector: Detector, h: Hypothesis, amplitude: Sequence[float] | np.ndarray) -> float:
    """What the response to a cause of an amplitude (q,) may leave, as it is wrong by a twentieth. Of the response as it
    is: calibration may imitate nearly all of it, and does not imitate the error."""
    response = readings_columns(detector, h) @ np.asarray(amplitude)
    return detector.policy.misfit * float(response @ response)


def _unknown_to_surrogate(
    detector: Detector, there: np.ndarray, known: np.ndarray, causes: Sequence[tuple[Hypothesis, np.ndarray]]
) -> np.ndarray:
    """(m, n) by which derivatives of the exact model at parameters there (n,) beside causes differ from those known
    (m, n) of the surrogate: there, or at the nearest point within `anew` where this diagnosis has made them."""
    study = detector.study
    units = [u for h, _ in causes for u in units_of(study, h)]
    sizes = [float(v) for _, a in causes for v in a]
    at = np.concatenate([there, *(_coordinates(detector, h, a) for h, a in causes)])
    names = tuple((h.family, h.name, h.when.signal, len(h.when.windows)) for h, _ in causes)
    near = [(float(np.abs(at - d.there).max()), d.J) for d in detector.derivatives if d.causes == names]
    distance, J = min(near, key=lambda own: own[0], default=(np.inf, np.zeros(0)))
    if distance < detector.policy.anew:
        return J

    def of_run(k: int) -> np.ndarray:
        return study.jacobian(k, there, slots_with(study, detector.elements, units, k), sizes)[:, : len(there)]

    J = np.vstack(over_runs(of_run, study.fitted)) - known
    detector.derivatives.append(Derivatives(names, at, J))
    return J


def _coordinates(detector: Detector, h: Hypothesis, amplitude: np.ndarray) -> np.ndarray:
    """What tells where derivatives beside a cause were made, in units by which they change: the factor of a signal, the
    logarithm of other sizes, edges of windows in units of their prior."""
    sizes = amplitude if fault_of(h).corrects else np.sign(amplitude) * np.log(np.maximum(np.abs(amplitude), 1e-30))
    edges = [edge for w in h.when.windows for edge in (w.start, w.end)]
    return np.concatenate([sizes, np.array(edges) / detector.policy.edge_prior])


def gains_of(study: Study, accepted: Sequence[Accepted]) -> list[tuple[int, int]]:
    """(amplitude, parameter) of causes that are a declared parameter beyond its tolerance."""
    return [
        (own.start, j)
        for a, own in zip(accepted, spans(accepted), strict=True)
        if fault_of(a.hypothesis).parameter and (j := parameter_of(study, a.hypothesis.name)) is not None
    ]


def spans(accepted: Sequence[Accepted]) -> list[slice]:
    """Where the amplitudes of each cause are among those of all."""
    ends = np.cumsum([0, *(len(a.amplitude) for a in accepted)]).tolist()
    return [slice(i, j) for i, j in pairwise(ends)]


def shifted(study: Study, x: np.ndarray, gains: Sequence[tuple[int, int]], amplitude: np.ndarray) -> np.ndarray:
    """(n,) the parameters with the shifts of causes that are parameters, in prior standard deviations."""
    there = x.copy()
    for i, j in gains:
        there[j] += amplitude[i] / study.scale[j]
    return there


def with_shifts(study: Study, accepted: Sequence[Accepted], x: np.ndarray) -> np.ndarray:
    """(n,) likewise, at the amplitudes of the accepted."""
    if not accepted:
        return x
    return shifted(study, x, gains_of(study, accepted), np.concatenate([a.amplitude for a in accepted]))


def readings_columns(detector: Detector, h: Hypothesis) -> np.ndarray:
    """(m, q) white first-order responses of a hypothesis: exact for what is read, but where that is curved."""
    columns, weights = h.combination()
    return np.asarray(detector.columns.raw[:, columns].astype(float) @ weights.T)


def read_change(
    detector: Detector, h: Hypothesis, amplitude: np.ndarray, x: np.ndarray, accepted: Sequence[Accepted] = ()
) -> np.ndarray:
    """(m,) white change by a cause at its amplitude (q,), by what acts in the machine to first order; x (n,), accepted:
    parameters and causes of the motion that is read otherwise."""
    if fault_of(h).exchanges:  # `exchanged` has left nothing of it
        return np.zeros(detector.columns.raw.shape[0])
    if fault_of(h).stepped:
        return detector.whiten(curved_change(detector, h, float(amplitude[0]), motion(detector, x, accepted)))
    return np.asarray(readings_columns(detector, h) @ amplitude)


Motion = Callable[[int], np.ndarray]  # states (n + 1, r) of run k


def motion(detector: Detector, x: np.ndarray | None, accepted: Sequence[Accepted] = ()) -> Motion:
    """Of parameters x (n,) with causes that act in the machine, each run stepped once; None: of the nominal machine,
    which costs no step."""
    if x is None:
        return lambda k: detector.nominal[k].states
    return cache(lambda k: detector.study.states(k, x, *acting(detector, accepted, k)))


def curved_change(detector: Detector, h: Hypothesis, size: float, states: Motion) -> np.ndarray:
    """(m,) change of what is measured by what is stepped."""
    return fault_of(h).change(detector.study, states, h.name, size)


def curved_slope(detector: Detector, h: Hypothesis, size: float, states: Motion) -> np.ndarray:
    """(m,) its derivative by the size."""
    by = detector.policy.aside * max(abs(size), h.batch.smallest)
    more, less = (curved_change(detector, h, size + d, states) for d in (by, -by))
    return np.asarray((more - less) / (2.0 * by))


def in_place(T: np.ndarray, sensors: Sequence[str], accepted: Sequence[Accepted]) -> np.ndarray:
    """(b, s) temperatures T of sensors with those back in place that were found swapped."""
    order = list(range(len(sensors)))
    for a in accepted:
        spot = Spot.read(a.hypothesis.name)
        pair = (spot.name, spot.partner) if fault_of(a.hypothesis).exchanges else ()
        if pair and set(pair) <= set(sensors):
            i, j = (list(sensors).index(name) for name in pair)
            order[i], order[j] = order[j], order[i]
    return T[:, order]


def exchanged(study: Study, y: np.ndarray, accepted: Sequence[Accepted]) -> np.ndarray:
    """(m,) measurements y with the channels back in place that were found swapped: exact, whatever the parameters."""
    if not any(fault_of(a.hypothesis).exchanges for a in accepted):
        return y
    y = y.copy()
    for planned, T, _ in study.split(y):
        T[:] = in_place(T, planned.measured.sensors, accepted)
    return y


def outputs_with(detector: Detector, accepted: Sequence[Accepted], x: np.ndarray) -> np.ndarray:
    """(m,) of all fitted runs with the causes that act in the machine; x (n,) already shifted."""
    study = detector.study
    return np.concatenate(over_runs(lambda k: study.outputs(k, x, *acting(detector, accepted, k)), study.fitted))


def acting(detector: Detector, accepted: Sequence[Accepted], k: int) -> tuple[Slots | None, Sequence[float]]:
    """What acts in the machine in run k, with its amplitudes; None where no cause does."""
    units = [u for a in accepted for u in a.units]
    if not units:
        return None, ()
    amplitudes = [v for a in accepted if a.units for v in a.amplitude]
    return slots_with(detector.study, detector.elements, units, k), amplitudes


def settled(detector: Detector, y: np.ndarray, accepted: Sequence[Accepted]) -> tuple[np.ndarray, np.ndarray]:
    """The delivered calibration beside causes, whose amplitudes stay: parameters (n,) in prior standard deviations of
    measurements y (m,), and their covariance (n, n)."""
    if not accepted:
        return settled_alone(detector.fitter, y)
    study, surrogate = detector.study, detector.fitter.surrogate
    y = exchanged(study, y, accepted)
    reading = [a for a in accepted if not a.units and not fault_of(a.hypothesis).parameter]
    held = [j for a in accepted for j in freed(study, a.hypothesis)]

    def outputs(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        f, J = surrogate.at(with_shifts(study, accepted, x))
        J[:, held] = 0.0
        return f, J

    def left(x: np.ndarray) -> np.ndarray:
        there = with_shifts(study, accepted, x)
        read = np.zeros(len(y))
        for a in reading:
            read += read_change(detector, a.hypothesis, a.amplitude, there, accepted)
        return detector.whiten(y - outputs_with(detector, accepted, there)) - read

    return settle(detector.fitter, outputs, left, untied_beside(study, accepted))

"""Causes that a search has accepted, and what the model with them says."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.evidence.consistency import Size
from twin.diagnose.evidence.fitter import bounds
from twin.diagnose.faults.acted import CONDUCTS, Unit, slots_with, units_of
from twin.diagnose.faults.readings import lagged, late, play
from twin.diagnose.model.study import Study
from twin.diagnose.search.detector import Detector

CURVED = ("slip", "clock", "lag")  # kinds that act on what is read, and not in proportion to their size
OWN = ("gain", "conductance", "total")  # how parameters of sources, films, contacts and joints are called there
ASIDE = 0.1  # of a size, by which such a one is moved for its derivative


@dataclass(frozen=True)
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


def parameter_of(study: Study, name: str) -> int | None:
    """The parameter of this path, or the gain of this source or film, or the conductance of this contact or joint.

    None where `[[parameters]]` leaves it out.
    """
    paths = [p.path for p in study.probed.parameters]
    return next((paths.index(p) for p in (name, *(f"{name}.{own}" for own in OWN)) if p in paths), None)


def freed(study: Study, h: Hypothesis) -> list[int]:
    """The parameter, if any, that a cause takes the place of: it stays at its declared value.

    Side by side the two would share one change.
    """
    if h.batch.kind not in ("gain", *CONDUCTS) or h.when.windows or h.when.signal:
        return []
    j = parameter_of(study, h.name)
    return [] if j is None else [j]


def jacobian(
    detector: Detector, x: np.ndarray, causes: Sequence[tuple[Hypothesis, float]], before: np.ndarray | None = None
) -> np.ndarray:
    """(m, n) derivatives by the parameters at x (n,), with causes of these amplitudes.

    The surrogate knows nothing of causes, and a film of nine times its size changes what every other parameter does:
    those that take a parameter's place are put there. Conductances beyond their bounds, where no surrogate holds, and
    beside a signal that is corrected, get derivatives made anew, unless there are some from `before`. A number's own
    column is left empty.
    """
    study = detector.study
    low, high = bounds(study)
    there, held = x.copy(), list[int]()
    corrected = [(h, amplitude) for h, amplitude in causes if h.batch.kind == "signal"]
    anew = bool(corrected)
    for h, amplitude in causes:
        for j in freed(study, h):
            size = amplitude if h.batch.kind == "gain" else float(np.log1p(amplitude))
            there[j] = size / study.scale[j]
            held.append(j)
            anew |= h.batch.kind != "gain" and not low[j] <= there[j] <= high[j]
    if not anew:
        J = detector.fitter.surrogate.at(there)[1]
    elif before is not None:
        J = before
    else:
        units, sizes = [u for h, _ in corrected for u in units_of(study, h)], [a for _, a in corrected]
        J = np.vstack([
            study.jacobian(k, there, slots_with(study, detector.elements, units, k), sizes)[:, : len(x)]
            for k in study.fitted
        ])  # fmt: skip
    J[:, held] = 0.0
    return J


def gains_of(study: Study, accepted: Sequence[Accepted]) -> list[tuple[int, int]]:
    """(amplitude, parameter) of causes that are a declared parameter beyond its tolerance."""
    result, first = [], 0
    for a in accepted:
        if a.hypothesis.batch.kind == "gain" and (j := parameter_of(study, a.hypothesis.name)) is not None:
            result.append((first, j))
        first += len(a.amplitude)
    return result


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
    """(m, q) white first-order responses of a hypothesis: exact for what acts on what is read, but for `CURVED`."""
    columns, weights = h.combination()
    return np.asarray(detector.columns.raw[:, columns].astype(float) @ weights.T)


def read_change(detector: Detector, h: Hypothesis, amplitude: np.ndarray, x: np.ndarray) -> np.ndarray:
    """(m,) white change by what acts on what is read, at its amplitude (q,); none of swapped channels.

    x (n,): parameters that a clock's run is stepped with.
    """
    if h.batch.kind == "swapped":  # `exchanged` has left nothing of it
        return np.zeros(detector.columns.raw.shape[0])
    if h.batch.kind in CURVED:
        return detector.whiten(curved_change(detector, h, float(amplitude[0]), x))
    return np.asarray(readings_columns(detector, h) @ amplitude)


def curved_change(detector: Detector, h: Hypothesis, size: float, x: np.ndarray | None) -> np.ndarray:
    """(m,) likewise of the kinds CURVED, in what is measured; x None: of the nominal machine, which costs no step."""
    study = detector.study
    if h.batch.kind == "slip":
        return size * play(study, detector.nominal, h.name.removeprefix("tcp."), abs(size))
    run = h.name.removeprefix("runs.")
    states = {
        k: detector.nominal[k].states if x is None else study.states(k, x)
        for k in study.fitted if study.runs[k].run.name == run or h.batch.kind == "lag"
    }  # fmt: skip
    if h.batch.kind == "lag":
        return size * lagged(study, states, h.name.removeprefix("sensors."), max(size, h.batch.smallest))
    return size * late(study, states, size)


def curved_slope(detector: Detector, h: Hypothesis, size: float, x: np.ndarray) -> np.ndarray:
    """(m,) its derivative by the size."""
    by = ASIDE * max(abs(size), h.batch.smallest)
    more, less = (curved_change(detector, h, size + d, x) for d in (by, -by))
    return np.asarray((more - less) / (2.0 * by))


def in_place(T: np.ndarray, sensors: Sequence[str], accepted: Sequence[Accepted]) -> np.ndarray:
    """(b, s) temperatures T of sensors with those back in place that were found swapped."""
    order = list(range(len(sensors)))
    for a in accepted:
        pair = a.hypothesis.name.removeprefix("sensors.").split("<>") if a.hypothesis.batch.kind == "swapped" else []
        if pair and set(pair) <= set(sensors):
            i, j = (list(sensors).index(name) for name in pair)
            order[i], order[j] = order[j], order[i]
    return T[:, order]


def exchanged(study: Study, y: np.ndarray, accepted: Sequence[Accepted]) -> np.ndarray:
    """(m,) measurements y with the channels back in place that were found swapped: exact, whatever the parameters."""
    if not any(a.hypothesis.batch.kind == "swapped" for a in accepted):
        return y
    parts, first = [], 0
    for k in study.fitted:
        planned = study.runs[k]
        own = y[first : first + planned.size].copy()
        (b, s), _ = planned.shapes
        own[: b * s] = in_place(own[: b * s].reshape(b, s), planned.measured.sensors, accepted).ravel()
        parts.append(own)
        first += planned.size
    return np.concatenate(parts)


def stepped(detector: Detector, accepted: Sequence[Accepted], k: int, x: np.ndarray) -> np.ndarray:
    """(size,) outputs of run k with the causes that act in the machine; x (n,) already shifted."""
    study = detector.study
    units = [u for a in accepted for u in a.units]
    if not units:
        return study.outputs(k, x)
    amplitudes = [v for a in accepted if a.units for v in a.amplitude]
    return study.outputs(k, x, slots_with(study, detector.elements, units, k), amplitudes)

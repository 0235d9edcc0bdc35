"""Causes that a search has accepted, and what the model with them says."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.diagnose.acted import Unit, slots_with
from twin.diagnose.batch import Hypothesis
from twin.diagnose.readings import play
from twin.diagnose.study import Study
from twin.diagnose.yardstick import Yardstick


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


def parameter_of(study: Study, name: str) -> int | None:
    """The parameter of this path, or the gain of this source or film; None where `[[parameters]]` leaves it out."""
    paths = [p.path for p in study.bench.parameters]
    return next((paths.index(path) for path in (name, f"{name}.gain") if path in paths), None)


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


def readings_columns(yard: Yardstick, h: Hypothesis) -> np.ndarray:
    """(m, q) white first-order responses of a hypothesis: exact for what acts on what is read, but for a play."""
    columns, weights = h.combination()
    return np.asarray(yard.columns.raw[:, columns].astype(float) @ weights.T)


def read_columns(yard: Yardstick, a: Accepted, amplitude: np.ndarray) -> np.ndarray:
    """(m, q) white responses of a cause that acts on what is read, at its amplitude (q,); none of swapped channels."""
    if a.hypothesis.batch.kind == "swapped":  # `exchanged` has left nothing of it
        return np.zeros((yard.columns.raw.shape[0], len(amplitude)))
    if a.hypothesis.batch.kind == "slip":
        name = a.hypothesis.name.removeprefix("tcp.")
        return yard.whiten(play(yard.study, yard.nominal, name, abs(float(amplitude[0]))))[:, None]
    return readings_columns(yard, a.hypothesis)


def exchanged(study: Study, y: np.ndarray, accepted: Sequence[Accepted]) -> np.ndarray:
    """(m,) measurements y with the channels back in place that were found swapped: exact, whatever the parameters."""
    swaps = [a.hypothesis.name for a in accepted if a.hypothesis.batch.kind == "swapped"]
    if not swaps:
        return y
    parts, first = [], 0
    for k in study.fitted:
        planned = study.runs[k]
        own = y[first : first + planned.size].copy()
        (b, s), _ = planned.shapes
        T, names = own[: b * s].reshape(b, s), list(planned.measured.sensors)
        for name in swaps:
            pair = name.removeprefix("sensors.").split("<>")
            if set(pair) <= set(names):
                i, j = (names.index(n) for n in pair)
                T[:, [i, j]] = T[:, [j, i]]
        parts.append(own)
        first += planned.size
    return np.concatenate(parts)


def stepped(yard: Yardstick, accepted: Sequence[Accepted], k: int, x: np.ndarray) -> np.ndarray:
    """(size,) outputs of run k with the causes that act in the machine; x (n,) already shifted."""
    study = yard.study
    units = [u for a in accepted for u in a.units]
    if not units:
        return study.outputs(k, x)
    amplitudes = [v for a in accepted if a.units for v in a.amplitude]
    return study.outputs(k, x, slots_with(study, yard.elements, units, k), amplitudes)

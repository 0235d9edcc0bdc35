"""Gains and an offset on a base model whose own numbers stay as they are: the update of paper 003, bounded.

Per axis, with s the base model's TCP error and L s its answer through a lag of some hours,

    y = gain s + slow L s + offset + v            gain = 1, slow = 0, offset = 0 before anything is measured

A source that sits elsewhere than in training heats another part of the structure, which answers hours later: without
`slow` the gain would have to follow that all day, half an interval late. All three drift as random walks. How far and
how fast is not known beforehand: a bank of filters with small to large variances runs side by side, weighted by how
well each predicted the measurements so far (multiple-model estimation, Magill, IEEE Trans. Automatic Control 10, 1965).
Against the weaknesses of paper 003's eq (7), gain = measured / simulated (erratum E-003-5):

- dead zone: a part smaller than `dead` times the noise does not teach its gain;
- bounds: gains and offset stay inside theirs;
- gate: a measurement beyond `gate` predicted standard deviations is left out, unless the next one agrees with it;
- slew (`twin.calibrate.update_slew`): the correction never jumps.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

HOUR = 3600.0


@dataclass(frozen=True)
class GainPrior:
    """What is known of gain, slow gain and offset before anything is measured; standard deviations, m, s."""

    sigma: tuple[float, float, float] = (0.1, 0.3, 2e-6)  # 1, 1, m
    walk: tuple[float, float, float] = (0.02, 0.05, 1e-6)  # per square root of an hour
    keep: tuple[float, float, float] = (0.5, 0.5, 0.0)  # share of what was learnt that a new segment begins with
    bank: tuple[float, ...] = (0.25, 0.5, 1.0, 2.0, 4.0)  # multiples of sigma and walk
    lag: float = 10800.0  # s, of the slow answer
    low: tuple[float, float, float] = (0.0, -2.0, -50e-6)  # bounds
    high: tuple[float, float, float] = (3.0, 2.0, 50e-6)
    noise: float = 1e-6  # m, of a measurement without a sigma of its own
    dead: float = 3.0  # times the noise
    gate: float = 4.0  # times the predicted standard deviation


MEAN = np.array([1.0, 0.0, 0.0])


@dataclass(frozen=True)
class GainState:
    """b filters of a bank, a axes; gain, slow gain and offset of each."""

    time: float  # s
    mean: np.ndarray  # (b, a, 3)
    covariance: np.ndarray  # (b, a, 3, 3)
    weight: np.ndarray  # (b, a), sums to one over the bank
    left_out: np.ndarray  # (a,) the innovation [m] of a measurement just gated, else NaN

    def to_json(self) -> dict[str, Any]:
        """Numbers that are read back exactly; NaN as null."""
        gated = [None if np.isnan(v) else v for v in self.left_out.tolist()]
        arrays = {name: getattr(self, name).tolist() for name in ("mean", "covariance", "weight")}
        return {"time_s": self.time, **arrays, "left_out": gated}

    @classmethod
    def from_json(cls, d: Mapping[str, Any]) -> GainState:
        gated = np.array([np.nan if v is None else v for v in d["left_out"]], dtype=float)
        return cls(float(d["time_s"]), np.array(d["mean"]), np.array(d["covariance"]), np.array(d["weight"]), gated)


@dataclass(frozen=True)
class Told:
    """What became of one component of a measurement."""

    axis: int
    innovation: float  # m, measured minus predicted before it was assimilated
    sigma: float  # m, of that
    accepted: bool


def begin(prior: GainPrior, time: float, axes: int = 3) -> GainState:
    """The base model as it is."""
    b = len(prior.bank)
    variance = np.outer(prior.bank, prior.sigma) ** 2
    covariance = np.tile((variance[:, None] * np.eye(3))[:, None], (1, axes, 1, 1))
    return GainState(time, np.tile(MEAN, (b, axes, 1)), covariance, np.full((b, axes), 1.0 / b), np.full(axes, np.nan))


def begin_segment(prior: GainPrior, state: GainState, time: float) -> GainState:
    """A new test after an interruption of unknown length: a share of what was learnt is kept, the rest is the prior."""
    fresh = begin(prior, time, state.mean.shape[1])
    keep = np.array(prior.keep)
    mean = fresh.mean + keep * (state.mean - fresh.mean)
    covariance = keep[:, None] * state.covariance * keep + (1.0 - keep**2) * fresh.covariance
    return replace(state, time=time, mean=mean, covariance=covariance, left_out=fresh.left_out)


def wait(prior: GainPrior, state: GainState, time: float) -> GainState:
    """The state at a later time [s]: nothing is known of the drift but its size."""
    hours = max(0.0, time - state.time) / HOUR
    variance = np.outer(prior.bank, prior.walk) ** 2 * hours
    return replace(state, time=max(time, state.time), covariance=state.covariance + variance[:, None, None] * np.eye(3))


def lagged(prior: GainPrior, slow: np.ndarray, base: np.ndarray, dt: float) -> np.ndarray:
    """L s after dt [s] with the base model's TCP error at `base`, of any shape, from L s before."""
    return np.asarray(base + (slow - base) * np.exp(-dt / prior.lag))


def predict(prior: GainPrior, state: GainState, parts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """TCP error (a,) m and its standard deviation (a,), without noise, from the base model's s and L s (a, 2)."""
    rows = np.append(parts, np.ones((len(parts), 1)), axis=1)
    each = np.einsum("am,bam->ba", rows, state.mean)
    mean = (state.weight * each).sum(axis=0)
    variance = np.einsum("am,bamn,an->ba", rows, state.covariance, rows) + (each - mean) ** 2
    return mean, np.sqrt((state.weight * variance).sum(axis=0))


def assimilate(
    prior: GainPrior, state: GainState, parts: np.ndarray, measured: np.ndarray, sigma: float | None = None
) -> tuple[GainState, tuple[Told, ...]]:
    """Learn a measurement (a,) m at the state's time, NaN where not measured; sigma [m] of each component."""
    noise = prior.noise if sigma is None or not np.isfinite(sigma) else sigma
    predicted, deviation = predict(prior, state, parts)
    mean, covariance = state.mean.copy(), state.covariance.copy()
    weight, left_out = state.weight.copy(), state.left_out.copy()
    told = []
    for a in np.flatnonzero(np.isfinite(measured)):
        innovation, total = float(measured[a] - predicted[a]), float(np.hypot(deviation[a], noise))
        far = abs(innovation) > prior.gate * total
        agrees = abs(innovation - left_out[a]) <= prior.gate * np.hypot(total, noise)
        accepted = not far or bool(agrees)
        told.append(Told(int(a), innovation, total, accepted))
        left_out[a] = np.nan if accepted else innovation
        if not accepted:
            continue
        # twice far off in the same way: the machine has changed, so no more is known than at the beginning
        teaching = np.append(np.where(np.abs(parts[a]) > prior.dead * noise, parts[a], 0.0), 1.0)
        whole = np.append(parts[a], 1.0)
        P = begin(prior, state.time, 1).covariance[:, 0] if far else covariance[:, a]
        v = measured[a] - mean[:, a] @ whole
        S = np.einsum("m,bmn,n->b", teaching, P, teaching) + noise**2
        gain = P @ teaching / S[:, None]
        mean[:, a] = np.clip(mean[:, a] + gain * v[:, None], prior.low, prior.high)
        left = np.eye(3) - gain[:, :, None] * teaching
        covariance[:, a] = left @ P @ left.transpose(0, 2, 1) + noise**2 * gain[:, :, None] * gain[:, None, :]
        log = -0.5 * (v**2 / S + np.log(S)) + np.log(weight[:, a])
        share = np.exp(log - log.max())
        weight[:, a] = np.maximum(share / share.sum(), 1e-4)  # no filter is ever given up
        weight[:, a] /= weight[:, a].sum()
    return GainState(state.time, mean, covariance, weight, left_out), tuple(told)


def gain_003(simulated: np.ndarray, measured: np.ndarray) -> np.ndarray:
    """Paper 003 eq (7) as printed: gain_UP = measured / simulated, per axis; singular at zero (E-003-5)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(measured / simulated)

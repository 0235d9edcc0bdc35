"""What a model leaves of a measurement: noise that remembers, and errors of the model's form.

Noise: a first-order autoregression per channel, estimated and capped. Air moves; counting 144 bins of a sensor as 144
independent witnesses makes intervals far too small. Every channel is whitened as r_t - phi r_(t-1), with the same
operator on residual and Jacobian (generalised least squares; Cochrane, Orcutt 1949, with the first row of Prais,
Winsten 1954). phi is capped: an uncapped one absorbs slow effects.

Form: meshes end somewhere, sensors stand a little off, and near a source both matter: what a watt of each source does
at each sensor is known to a few per cent only, of every sensor and source independently. Its covariance is low-rank,
tau^2 sum_j g_j g_j^T with g_j the sensitivity of the channel to ln(parameter j), and to its own rise. Without it these
errors go into the sources next to the sensors, with intervals that are far too small (Kennedy, O'Hagan, J. R. Statist.
Soc. B 63, 2001, on what a calibration without discrepancy does).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

CAP = 0.98
LEAST_ROWS = 12  # of a channel, for an estimate of its own


@dataclass(frozen=True)
class Channels:
    """One sigma and one phi per channel (c,)."""

    sigma: np.ndarray  # of the innovation, in the channel's unit
    phi: np.ndarray

    def whiten(self, values: np.ndarray) -> np.ndarray:
        """values (n, c, ...) -> the same, of unit variance; NaN interrupts a channel and yields zero.

        After a gap a channel starts anew with its stationary variance.
        """
        shape = (1, -1, *([1] * (values.ndim - 2)))
        phi, sigma = self.phi.reshape(shape), self.sigma.reshape(shape)
        before = np.concatenate([np.full_like(values[:1], np.nan), values[:-1]])
        first = np.sqrt(1.0 - phi**2) * values
        white = np.where(np.isfinite(before), values - phi * before, first) / sigma
        return np.where(np.isfinite(white), white, 0.0)


@dataclass(frozen=True)
class Noise:
    """Channels (c) of a run with model discrepancy: k effects of unit prior variance each."""

    channels: Channels
    form: np.ndarray  # (n, c, k), NaN where nothing was measured
    weight: np.ndarray | None = None  # (n, c) of each row (`twin.calibrate.fit.weights`); None: all alike

    def __post_init__(self) -> None:
        white = self._white(self.form)
        parts = [np.linalg.svd(white[:, c], full_matrices=False)[:2] for c in range(white.shape[1])]
        object.__setattr__(self, "_modes", parts)

    def whiten(self, values: np.ndarray) -> np.ndarray:
        """values (n, c, ...) -> the same, of unit variance: (1 + U S^2 U^T)^(-1/2) after the channels; NaN: zero."""
        white = self._white(values)
        for c, (U, s) in enumerate(self._modes):  # type: ignore[attr-defined]
            part = white[:, c].reshape(len(white), int(np.prod(white.shape[2:])))
            part = part - U @ ((1.0 - 1.0 / np.sqrt(1.0 + s**2))[:, None] * (U.T @ part))
            white[:, c] = part.reshape(white[:, c].shape)
        return white

    def without_form(self, residual: np.ndarray) -> np.ndarray:
        """residual (n, c) less the most likely share of the model discrepancy: what is left is noise."""
        result = residual.copy()
        white, form = self._white(residual), self._white(self.form)
        for c in range(residual.shape[1]):
            F = form[:, c]
            result[:, c] -= self.form[:, c] @ np.linalg.solve(F.T @ F + np.eye(F.shape[1]), F.T @ white[:, c])
        return result

    def _white(self, values: np.ndarray) -> np.ndarray:
        white = self.channels.whiten(values)
        if self.weight is None:
            return white
        return white * np.sqrt(self.weight).reshape(*self.weight.shape, *([1] * (values.ndim - 2)))


def white(floor: np.ndarray) -> Channels:
    """Channels without memory, of standard deviations floor (c,)."""
    return Channels(np.asarray(floor, dtype=float), np.zeros(len(floor)))


def estimated(residual: np.ndarray, floor: np.ndarray, cap: float = CAP) -> Channels:
    """phi and innovation of residuals (n, c), NaN where missing; the innovation is at least floor (c,).

    The floor is what the instrument itself scatters: no fit is better known than its sensors. phi is estimated about
    zero, not about the mean: an offset is memory too.
    """
    phi, sigma = np.zeros(residual.shape[1]), np.asarray(floor, dtype=float).copy()
    for c in range(residual.shape[1]):
        r = residual[:, c]
        pair = np.isfinite(r[1:]) & np.isfinite(r[:-1])
        if pair.sum() < LEAST_ROWS:
            good = r[np.isfinite(r)]
            if len(good):
                sigma[c] = max(sigma[c], float(np.sqrt(np.mean(good**2))))
            continue
        now, last = r[1:][pair], r[:-1][pair]
        if last @ last <= len(last) * floor[c] ** 2:  # nothing beyond the instrument's own: white, as stated
            continue
        # white noise of the instrument biases phi towards zero: take its variance out of the denominator
        power = max(float(last @ last) - len(last) * floor[c] ** 2, 0.1 * float(last @ last))
        phi[c] = float(np.clip(now @ last / power, 0.0, cap))
        sigma[c] = max(sigma[c], float(np.sqrt(np.mean((now - phi[c] * last) ** 2))))
    return Channels(sigma, phi)

"""Outputs as a quadratic function of the parameters: exact derivatives, kept, instead of stepping the model again.

Calibration needs the Jacobian where it ends: two parameters of large and nearly equal effect are a weak direction only
at the point where they nearly cancel.

    y(t) = y0 + J t + 1/2 t^T H t,     t_j = (e^u - 1) / (1 + s_j (e^u - 1))

in which temperatures are nearly linear: where a share s of the conductance by which heat leaves is the parameter's, its
rise goes with 1 / (1 - s + s e^u). Powers and expansions have s = 0.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from twin.build.workers import each
from twin.diagnose.model.over_runs import over_runs
from twin.diagnose.model.study import Study
from twin.errors import ModelError
from twin.progress import Progress, silent

STEP = 0.8  # prior standard deviations between the two Jacobians of a second derivative
STRONG = 50.0  # units of noise, summed over all rows, by which a parameter must move outputs to be bent
UNITS = 0.05, 1e-6  # K, m: what counts
CONDUCTS = ("film", "joint", "contact")  # kinds that have a share


@dataclass(frozen=True)
class Surrogate:
    """m outputs of the fitted runs, n parameters x in prior standard deviations."""

    scale: np.ndarray  # (n,) u = scale x
    log: np.ndarray  # (n,) bool: u is a logarithm, else t = u
    share: np.ndarray  # (n,) s
    y0: np.ndarray  # (m,)
    J: np.ndarray  # (m, n) by t
    H: np.ndarray  # (m, n, n) float32, by t

    def t(self, x: np.ndarray) -> np.ndarray:
        """(n,) coordinates in which outputs are nearly linear."""
        u = self.scale * x
        change = np.expm1(np.where(self.log, u, 0.0))
        return np.where(self.log, change / (1.0 + self.share * change), u)

    def rate(self, x: np.ndarray) -> np.ndarray:
        """(n,) dt/dx."""
        change = np.expm1(np.where(self.log, self.scale * x, 0.0))
        return self.scale * (1.0 + change) / (1.0 + self.share * change) ** 2

    def at(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Outputs (m,) and their Jacobian (m, n) by x."""
        t = self.t(x)
        D = self.J + self.H @ t.astype(np.float32)
        f = self.y0 + 0.5 * (self.J @ t + D @ t)
        D *= self.rate(x)  # in place: it is large, and `at` is called for every step of every fit
        return f, D


def jacobian_of(study: Study, x: np.ndarray) -> np.ndarray:
    n = len(study.probed.parameters)
    return np.vstack(over_runs(lambda k: study.jacobian(k, x)[:, :n], study.fitted))


def make_surrogate(study: Study, progress: Progress = silent) -> Surrogate:
    """From exact Jacobians: the nominal one, and one per parameter that moves outputs far."""
    n = len(study.probed.parameters)
    y0, J = study.all_outputs(np.zeros(n)), jacobian_of(study, np.zeros(n)) / study.scale
    _refuse_nan(study, J, y0)
    log = np.array([p.scale != "linear" for p in study.probed.parameters], dtype=bool)
    unit = study.joined(lambda _: UNITS)
    bare = Surrogate(study.scale, log, _shares(study, y0, J, unit), y0, J, np.zeros((0, n, n), dtype=np.float32))
    strong = np.flatnonzero(np.linalg.norm(J * study.scale / unit[:, None], axis=0) > STRONG)
    points = [STEP * np.eye(n)[i] for i in strong]
    with progress("derivatives by the parameters", len(points)) as advance:
        made = each(jacobian_of, study, points, lambda _: advance(""))
    H = np.zeros((len(y0), n, n), dtype=np.float32)
    for i, x, jac in zip(strong, points, made, strict=True):
        H[:, :, i] = (jac / bare.rate(x) - J) / bare.t(x)[i]
    # what a strong parameter does to a weak one is known; two weak ones bend nothing that counts
    for i in np.setdiff1d(np.arange(n), strong):
        H[:, strong, i] = H[:, i, strong]
    both = np.ix_(np.arange(len(y0)), strong, strong)
    H[both] = (H[both] + H[both].transpose(0, 2, 1)) / 2
    return replace(bare, H=H)


def _shares(study: Study, y0: np.ndarray, J: np.ndarray, unit: np.ndarray) -> np.ndarray:
    """(n,) s, of outputs at STEP: they change by t J, t = c / (1 + s c) with c = e^u - 1, so that s = 1 / t - 1 / c."""
    shares = np.zeros(len(study.scale))
    for i in (i for i, p in enumerate(study.probed.parameters) if p.kind in CONDUCTS and p.scale != "linear"):
        x = STEP * np.eye(len(shares))[i]
        along, c = J[:, i] / unit, np.expm1(STEP * study.scale[i])
        t = along @ ((study.all_outputs(x) - y0) / unit) / max(along @ along, 1e-300)
        shares[i] = np.clip(1.0 / t - 1.0 / c, 0.0, 1.0) if t > 0.0 else 0.0
    return shares


def _refuse_nan(study: Study, J: np.ndarray, y0: np.ndarray) -> None:
    """Raises ModelError where outputs or derivatives are no numbers: every statistic of them would be zero."""
    bad = [p.path for p, column in zip(study.probed.parameters, J.T, strict=True) if not np.isfinite(column).all()]
    if bad or not np.isfinite(y0).all():
        what = f"the derivative by {bad[0]} (and {len(bad) - 1} more)" if bad else "what the model predicts"
        raise ModelError(
            f"{what} is not finite in these runs", study.probed.base.name,
            "look for a law outside its range in these loads: twin check, twin losses --explain",
        )  # fmt: skip

"""Transfer-function models of paper 003, eqs (1) to (3), kept by poles and residues.

y(k) = Σ_m direct_m u_m(k) + Σ_i Σ_m Re[c_i r_im x_im(k)],   x_im(k+1) = p_i x_im(k) + u_m(k)

where c_i is 1 for a real pole and 2 for one of a conjugate pair. Poles lie inside the unit circle, or there is no
model: it is stable by construction. Every pole is a filter of its own, so that rounding stays what it is. The direct
form of eq (3) adds up coefficients that nearly cancel (erratum E-003-6): see
`twin.calibrate.transfer_function.direct_form`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal

import numpy as np
from scipy.signal import lfilter

from twin.errors import ModelError

Hold = Literal["zero", "linear"]


@dataclass(frozen=True)
class TransferFunction:
    """p poles, m inputs; units are those of output per input, for example m/K. Raises ModelError where unstable."""

    dt: float  # s, sampling interval
    poles: np.ndarray  # (p,) complex; imaginary parts >= 0, above zero for one of a conjugate pair
    residues: np.ndarray  # (p, m) complex; real where the pole is
    direct: np.ndarray  # (m,) effect of u(k) on y(k)

    def __post_init__(self) -> None:
        if not (np.isfinite(self.poles).all() and np.isfinite(self.residues).all() and np.isfinite(self.direct).all()):
            raise ModelError(
                "a transfer function that is not finite", "", "identify it on other data or of lower order"
            )
        if not (np.abs(self.poles) < 1.0).all():
            what = f"an unstable transfer function: a pole of magnitude {np.abs(self.poles).max():.9g}"
            raise ModelError(what, "", "identify it by output error, whose poles are stable, or of lower order")
        if (self.poles.imag < 0.0).any():
            raise ModelError("conjugate poles are given once, with positive imaginary parts", "", "remove the others")

    @property
    def n_inputs(self) -> int:
        return len(self.direct)

    @property
    def multiplicity(self) -> np.ndarray:
        """(p,): 1 for a real pole, 2 for a pair."""
        return np.where(self.poles.imag > 0.0, 2.0, 1.0)

    @property
    def dc_gain(self) -> np.ndarray:
        """(m,) what a step of 1 of each input settles at."""
        return self.direct + ((self.multiplicity / (1.0 - self.poles)) @ self.residues).real

    @property
    def time_constants(self) -> np.ndarray:
        """(p,) s: of the decay of each pole; 0 for a pole at zero."""
        with np.errstate(divide="ignore"):
            return -self.dt / np.log(np.abs(self.poles))

    def rest(self) -> np.ndarray:
        """(p, m) complex zeros: the state of a machine in equilibrium."""
        return np.zeros_like(self.residues, dtype=complex)

    def advance(self, state: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Output (n,) over inputs u (n, m) or (n,) from a state (p, m), and the state after them, to go on from."""
        u = _columns(u, self.n_inputs)
        y = u @ self.direct
        after = np.array(state, dtype=complex)
        if not len(u):
            return y, after
        for i, (pole, weight) in enumerate(zip(self.poles, self.multiplicity, strict=True)):
            p = pole if pole.imag > 0.0 else pole.real
            start = after[i : i + 1] if pole.imag > 0.0 else after[i : i + 1].real
            x, last = lfilter([0.0, 1.0], [1.0, -p], u, axis=0, zi=start)
            y = y + weight * (x @ self.residues[i]).real
            after[i] = last[0]
        return y, after

    def simulate(self, u: np.ndarray, starts: Sequence[int] = (0,)) -> np.ndarray:
        """Output (n,) over inputs u (n, m) or (n,), at rest at every row in `starts`: each test has its own state."""
        u = _columns(u, self.n_inputs)
        return np.concatenate([self.advance(self.rest(), u[a:b])[0] for a, b in pieces(starts, len(u))])

    def step_response(self, n: int, which: int = 0) -> np.ndarray:
        """(n,) response to a step of 1 of one input at k = 0; closed form, not stepped."""
        k = np.arange(n)[:, None]
        decayed = (1.0 - self.poles[None, :] ** k) / (1.0 - self.poles)
        return self.direct[which] + (decayed @ (self.multiplicity * self.residues[:, which])).real

    def rise_time(self, level: float, which: int = 0) -> float:
        """Time [s] at which the step response first reaches `level` of its final value, between the samples.

        level below 1 and so far from it that it is reached within 30 time constants; NaN where the gain is zero.
        """
        slowest = float(self.time_constants.max(initial=self.dt))
        response = self.step_response(int(np.ceil(30.0 * slowest / self.dt)) + 2, which)
        gain = self.dc_gain[which]
        reached = response / gain >= level if gain != 0.0 else np.zeros(len(response), dtype=bool)
        if not reached.any():
            return float("nan")
        k = int(np.argmax(reached))
        if k == 0:
            return 0.0
        before, after = response[k - 1] / gain, response[k] / gain
        return self.dt * (k - 1 + float((level - before) / (after - before)))

    def to_json(self) -> dict[str, Any]:
        """Poles and residues as numbers that are read back exactly."""
        return {
            "dt_s": self.dt,
            "poles": [[p.real, p.imag] for p in self.poles.tolist()],
            "residues": [[[r.real, r.imag] for r in row] for row in self.residues.tolist()],
            "direct": self.direct.tolist(),
        }

    @classmethod
    def from_json(cls, d: dict[str, Any]) -> TransferFunction:
        direct = np.array(d["direct"], dtype=float)
        poles = np.array([complex(*p) for p in d["poles"]], dtype=complex)
        residues = np.array([[complex(*r) for r in row] for row in d["residues"]], dtype=complex)
        return cls(float(d["dt_s"]), poles, residues.reshape(len(poles), len(direct)), direct)


def first_order_lags(tau: np.ndarray, gain: np.ndarray, dt: float, hold: Hold = "linear") -> TransferFunction:
    """The sum of lags with time constants tau (p,) s > 0 and gains (p,) or (p, m): poles exp(-dt/tau).

    hold: the input between its samples, linear or the last one kept (then y follows u one sample later). Exact for
    inputs of that kind.
    """
    tau = np.asarray(tau, dtype=float)
    gain = np.asarray(gain, dtype=float).reshape(len(tau), -1)
    a = np.exp(-dt / tau)[:, None]
    if hold == "zero":
        return TransferFunction(dt, a[:, 0] + 0j, gain * (1.0 - a) + 0j, np.zeros(gain.shape[1]))
    mean = (tau[:, None] / dt) * (1.0 - a)  # of exp(-s/tau) over an interval
    return TransferFunction(dt, a[:, 0] + 0j, gain * (1.0 - a) * mean + 0j, (gain * (1.0 - mean)).sum(axis=0))


def pieces(starts: Sequence[int], n: int) -> list[tuple[int, int]]:
    """Ranges [begin, end) of rows that belong together. Raises ModelError unless starts increase from 0 inside n."""
    edges = [*starts, n]
    if edges[0] != 0 or any(a > b for a, b in pairwise(edges)):
        raise ModelError(f"starts {list(starts)} do not increase from 0 to {n}", "", "give the first row of each test")
    return list(pairwise(edges))


def _columns(u: np.ndarray, m: int) -> np.ndarray:
    """(n, m) from (n, m), or (n,) where m is 1. Raises ModelError otherwise."""
    u = np.asarray(u, dtype=float)
    u = u[:, None] if u.ndim == 1 else u
    if u.ndim != 2 or u.shape[1] != m:
        raise ModelError(f"inputs of shape {u.shape} for a transfer function of {m}", "", "give one column per input")
    return u

"""Transfer functions by output error (paper 003, identification; stable parametrisation by erratum E-003-6).

The model is simulated from its inputs alone and its output fitted to the measured one. Only the poles are searched for:
given them, the residues follow by linear least squares in every step (variable projection, Golub and Pereyra 1973).
Poles are searched as logarithms of time constants, and of frequencies for pairs, so that every trial is stable.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import lfilter

from twin.calibrate.transfer_function.model import Hold, TransferFunction, pieces
from twin.errors import ModelError

MOST_STARTS = 6  # of the search


def fit_oe(
    u: np.ndarray,
    y: np.ndarray,
    dt: float,
    order: int = 2,
    pairs: int = 0,
    hold: Hold = "linear",
    direct: bool = False,
    starts: Sequence[int] = (0,),
) -> TransferFunction:
    """Transfer function of `order` poles from inputs u (n, m) or (n,) to y (n,), sampled every dt [s].

    pairs: how many of them are conjugate pairs (thermal ones are real: 0). hold: the inputs between samples. direct: a
    free direct effect of u(k) on y(k) as well. NaN in y: not measured; y may be as sparse as R-tests are. starts: first
    rows of tests, at rest there. y and u are deviations from that rest. Time constants are sought up to ten times the
    longest test.

    Raises ModelError where fewer values were measured than there are unknowns.
    """
    u = np.asarray(u, dtype=float)
    u = u[:, None] if u.ndim == 1 else u
    if order < 1 or not 0 <= 2 * pairs <= order:
        raise ModelError(f"order {order} with {pairs} pairs", "", "an order of 1 or more, at most half of it pairs")
    tests = pieces(starts, len(u))
    measured = np.isfinite(y)
    target = np.asarray(y, dtype=float)[measured]
    unknowns = order * (1 + u.shape[1]) + (u.shape[1] if direct else 0)
    if len(target) < unknowns + 1:
        raise ModelError(f"{len(target)} values for {unknowns} unknowns", "", "lower the order, or use fewer inputs")
    longest = dt * max(b - a for a, b in tests)
    low, high = 0.1 * dt, 10.0 * longest
    real = order - 2 * pairs
    scale = float(np.linalg.norm(target)) or 1.0

    def columns(log: np.ndarray) -> np.ndarray:
        parts = [_responses(u, p, dt, hold, tests)[measured] for p in _poles(log, real, dt)]
        parts += [u[measured]] if direct else []
        return np.hstack(parts)

    def solve(log: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        x = columns(log)
        size = np.linalg.norm(x, axis=0)
        size[size == 0.0] = 1.0
        weights = np.linalg.lstsq(x / size, target, rcond=1e-10)[0] / size
        return weights, (x @ weights - target) / scale

    # frequencies: below the sampling theorem's, above one turn in the longest test
    slow_turn, fast_turn = 2.0 * np.pi / longest, np.pi / dt
    bounds = (
        np.log([*[low] * real, *[low, slow_turn / 4.0] * pairs]),
        np.log([*[high] * real, *[high, 0.98 * fast_turn] * pairs]),
    )
    best = min(
        (
            least_squares(lambda log: solve(log)[1], start, bounds=bounds, x_scale=1.0, max_nfev=60)
            for start in _first_guesses(real, pairs, dt, longest)
        ),
        key=lambda found: float(found.cost),
    )
    return _assemble(best.x, solve(best.x)[0], real, u.shape[1], dt, hold, direct)


def _poles(log: np.ndarray, real: int, dt: float) -> list[complex]:
    """exp(-dt/tau) of each real pole, exp(-dt/tau + i omega dt) of each pair."""
    values = np.exp(log)
    poles = [complex(np.exp(-dt / tau)) for tau in values[:real]]
    return poles + [complex(np.exp(dt * (-1.0 / tau + 1j * w))) for tau, w in values[real:].reshape(-1, 2)]


def _numerator(pole: complex, dt: float, hold: Hold) -> tuple[complex, complex]:
    """n0, n1 of a pole's unit response (n0 + n1 z^-1)/(1 - p z^-1), DC gain 1, exact for inputs held so."""
    if hold == "zero":
        return 0.0, 1.0 - pole
    mean = (1.0 - pole) / -np.log(pole)  # of the decay over an interval
    return 1.0 - mean, mean - pole


def _responses(u: np.ndarray, pole: complex, dt: float, hold: Hold, tests: list[tuple[int, int]]) -> np.ndarray:
    """(n, m) of a real pole, real and imaginary part (n, 2 m) of a pair: what its gains multiply."""
    numerator, p = np.array(_numerator(pole, dt, hold)), pole
    if pole.imag == 0.0:
        numerator, p = numerator.real, pole.real
    x = np.concatenate([lfilter(numerator, [1.0, -p], u[a:b], axis=0) for a, b in tests])
    return x if pole.imag == 0.0 else np.hstack([x.real, -x.imag])


def _assemble(
    log: np.ndarray, gains: np.ndarray, real: int, m: int, dt: float, hold: Hold, direct: bool
) -> TransferFunction:
    """From the gains of `_responses`: (n0 + n1 z^-1)/(1 - p z^-1) = n0 + (n1 + p n0) z^-1/(1 - p z^-1)."""
    poles = _poles(log, real, dt)
    through = gains[-m:].copy() if direct else np.zeros(m)
    residues, at = [], 0
    for pole in poles:
        pair = pole.imag != 0.0
        gain = gains[at : at + m] + (1j * gains[at + m : at + 2 * m] if pair else 0j)
        at += 2 * m if pair else m
        n0, n1 = _numerator(pole, dt, hold)
        through += (gain * n0).real
        residues.append((0.5 if pair else 1.0) * gain * (n1 + pole * n0))  # a pair counts twice
    return TransferFunction(dt, np.array(poles, dtype=complex), np.array(residues, dtype=complex), through)


def _first_guesses(real: int, pairs: int, dt: float, longest: float) -> list[np.ndarray]:
    """Logarithms of time constants spread over what a test can show, in increasing order."""
    taus = np.geomspace(max(1.5 * dt, longest / 1000.0), 0.8 * longest, max(5, real + 2))
    omegas = 2.0 * np.pi / np.geomspace(longest / 2.0, max(longest / 50.0, 4.0 * dt), 4)
    of_real = list(itertools.combinations(np.log(taus), real)) or [()]
    of_pairs = list(itertools.combinations(np.log(omegas), pairs)) or [()]
    guesses = [
        np.array([*r, *itertools.chain.from_iterable((np.log(longest / 4.0), w) for w in p)])
        for r, p in itertools.product(of_real, of_pairs)
    ]
    step = max(1, -(-len(guesses) // MOST_STARTS))
    return guesses[::step]

"""What the state filter makes of a measurement: predictions with derivatives, one scalar at a time, bounds.

Scalars are assimilated after Potter (Bierman, Factorization Methods for Discrete Sequential Estimation, 1977, II.7).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from twin.calibrate.update.state_filter import SCALES, Machine, StateEstimate, compressed
from twin.rom.poses import pose_weights


def assimilate_scalar(state: StateEstimate, row: np.ndarray, innovation: float, noise: float) -> StateEstimate:
    """Potter's update by one measurement: row (m,) its derivative, noise its standard deviation."""
    phi = row @ state.root
    variance = phi @ phi + noise**2
    direction = state.root @ phi
    a = 1.0 / variance
    root = state.root - np.outer(direction, phi) * (a / (1.0 + np.sqrt(a) * noise))
    return _moved(state, direction * (a * innovation), root)


def _moved(state: StateEstimate, change: np.ndarray, root: np.ndarray) -> StateEstimate:
    n = len(state.step.z)
    z = state.step.z + change[:n]
    return replace(state, step=replace(state.step, z=z), extra=state.extra + change[n:], root=root)


def tcp_at(machine: Machine, state: StateEstimate, position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """TCP error (3,) m at one position (n_pose_axes,) m, and its derivative (3, m) by the whole state."""
    at = machine.rows
    weights, _ = pose_weights(machine.artefact.model.pose_grid, position[None])
    G = np.tensordot(weights[0], machine.G, 1)
    raw = G @ np.asarray(state.step.z)
    factor = 1.0 + state.extra[at.extra(at.gain)]
    rows = np.zeros((3, at.n))
    rows[:, at.z] = factor[:, None] * G
    rows[:, at.gain] = np.diag(raw)
    rows[:, at.offset] = np.eye(3)
    return factor * raw + state.extra[at.extra(at.offset)], rows


def tcp_at_poses(machine: Machine, state: StateEstimate) -> np.ndarray:
    """TCP error (n_poses, 3) m."""
    at = machine.rows
    factor, shift = (state.extra[at.extra(part)] for part in (at.gain, at.offset))
    return np.asarray((machine.G @ np.asarray(state.step.z)) * (1.0 + factor) + shift)


def sensor_rows(machine: Machine) -> np.ndarray:
    """(n_sensors, m): derivative of the sensors' readings by the whole state."""
    at = machine.rows
    rows = np.zeros((len(machine.C), at.n))
    rows[:, at.z] = machine.C
    rows[:, at.bias] = np.eye(len(machine.C))
    return rows


def sensors_at(machine: Machine, state: StateEstimate) -> np.ndarray:
    """(n_sensors,) degC, biases included."""
    at = machine.rows
    T_ref = float(machine.artefact.model.reference_temperature)
    return np.asarray(T_ref + machine.C @ np.asarray(state.step.z) + state.extra[at.extra(at.bias)])


def tcp_sigma(state: StateEstimate, rows: np.ndarray) -> np.ndarray:
    """Standard deviation (3,) m of a TCP error with derivatives rows (3, m), scaled by what the innovations told."""
    return np.asarray(np.linalg.norm(rows @ state.root, axis=1) * np.sqrt(state.belief @ SCALES**2))


def judged(state: StateEstimate, rows: np.ndarray, innovation: np.ndarray, noise: float) -> StateEstimate:
    """The state after the predicted sigma has been held against an innovation (k,) m with derivatives rows (k, m).

    The prior's variances are guesses; how far off they are is learnt from the innovations (a scale of unknown size, on
    a grid; West and Harrison, Bayesian Forecasting and Dynamic Models, 1997, 4.5). The mean does not depend on it.
    """
    spread = rows @ state.root
    own, directions = np.linalg.eigh(spread @ spread.T)
    along = (directions.T @ innovation) ** 2
    variance = SCALES[:, None] ** 2 * np.maximum(own, 0.0) + noise**2
    log = -0.5 * (along / variance + np.log(variance)).sum(axis=1) + np.log(state.belief)
    weight = np.maximum(np.exp(log - log.max()), 1e-6)
    return replace(state, belief=weight / weight.sum())


def doubted(machine: Machine, state: StateEstimate, axis: int, sigma: float) -> StateEstimate:
    """The state with the offset of an axis uncertain by `sigma` [m] more; in place of the least direction."""
    at = machine.rows
    more = np.zeros((at.n, 1))
    more[at.offset.start + axis] = sigma
    return replace(state, root=compressed(machine, np.hstack([state.root, more]), state.root.shape[1]))


def bounded(machine: Machine, state: StateEstimate) -> StateEstimate:
    """The state with parameters inside their limits: the nearest in the norm of the covariance (Simon, IET Control
    Theory and Applications 4, 2010)."""
    at = machine.rows
    for _ in range(3):
        value = state.extra[at.extra(at.u)]
        target = np.clip(value, machine.limits[:, 0], machine.limits[:, 1])
        out = np.flatnonzero(np.abs(target - value) > 1e-9)
        if not len(out):
            break
        rows = state.root[at.u][out]
        gramian = rows @ rows.T
        gramian = gramian + 1e-9 * np.trace(gramian) / len(out) * np.eye(len(out))
        state = _moved(state, state.root @ (rows.T @ np.linalg.solve(gramian, (target - value)[out])), state.root)
    return state

"""What an R-test measures, exactly: eq (9) of paper 000 with homogeneous transformations.

The paper prints P_ball = T_t^-1 T_w, a matrix for a position; erratum E-000-5: the ball's centre in the frame of the
probe is p = T_t^-1 T_w p_ball. T_t leads from the bed through the tool-carrying axes to the probe, T_w through the
workpiece-carrying axes to the table. Nothing is linearised here: this is what planted errors are measured by, and the
truth that the linear fit is tested with.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from twin.calibrate.axis_errors.chain import Chain, ChainAxis
from twin.calibrate.axis_errors.errors import Ranges, axis_errors, motion, profile, translation


def rotation(coordinate: int, angle: np.ndarray | float) -> np.ndarray:
    """Rotation matrices (..., 3, 3) by `angle` (...) [rad] about x, y or z, right-handed."""
    angle = np.asarray(angle, dtype=float)
    j, k = (coordinate + 1) % 3, (coordinate + 2) % 3
    matrix = np.zeros((*angle.shape, 3, 3))
    matrix[..., coordinate, coordinate] = 1.0
    matrix[..., j, j] = matrix[..., k, k] = np.cos(angle)
    matrix[..., k, j] = np.sin(angle)
    matrix[..., j, k] = -matrix[..., k, j]
    return matrix


def transformation(turn: np.ndarray, shift: np.ndarray) -> np.ndarray:
    """Homogeneous transformations (n, 4, 4) of rotations (n, 3, 3) and translations (n, 3) [m]."""
    matrix = np.zeros((len(shift), 4, 4))
    matrix[:, :3, :3], matrix[:, :3, 3], matrix[:, 3, 3] = turn, shift, 1.0
    return matrix


def measured_displacement(
    chain: Chain,
    ranges: Ranges,
    errors: Mapping[str, float],
    position: np.ndarray,
    angle: Mapping[str, np.ndarray] | None = None,
    ball_offset: np.ndarray | None = None,
    shift: np.ndarray | None = None,
    tilt: np.ndarray | None = None,
) -> np.ndarray:
    """TCP displacement (n, 3) [m] that an R-test reads at positions (n, n_linear) [m]: tool minus workpiece, -p.

    errors: values by name ("EXX" in m, "EAX" in rad), others zero. Without errors the reading is zero.
    ball_offset (n, 3) [m]: how far the ball lies from where it is believed to be, in the frame of the table, which the
    rotary axes turn by `angle` (n,) [rad] each. shift (3,) [m], tilt (3,) [rad] about x, then y, then z through the
    functional point: of the axes against the workpiece. The probe's axes are those of the machine.
    Raises KeyError for errors that the chain does not have.
    """
    known = {e.name for e in axis_errors(chain)}
    if unknown := sorted(set(errors) - known):
        raise KeyError(f"no such errors: {', '.join(unknown)}")
    s = motion(chain, ranges, position)
    n = len(position)
    T_t = T_w = np.broadcast_to(np.eye(4), (n, 4, 4))
    point = np.zeros((n, 3))
    for axis in reversed(chain.linear):  # from the bed outwards on the tool side
        if axis.side > 0:
            T_t = T_t @ _moved(axis, errors, s) @ _screw(chain, ranges, axis, errors, s)
        point += axis.side * translation(axis, s)  # the ball as seen from the workpiece-carrying axes
    for axis in chain.linear:  # from the bed outwards on the workpiece side
        if axis.side < 0:
            T_w = T_w @ _screw(chain, ranges, axis, errors, s) @ _moved(axis, errors, s)
    if shift is not None or tilt is not None:
        turn = np.eye(3)
        for coordinate, value in enumerate(np.zeros(3) if tilt is None else tilt):
            turn = rotation(coordinate, value) @ turn
        rigid = transformation(turn[None], (np.zeros(3) if shift is None else shift)[None])
        T_w = T_w @ np.linalg.inv(rigid)
    if ball_offset is not None:
        point += np.einsum("nij,nj->ni", table_rotation(chain, angle or {}, n), ball_offset)
    p_ball = np.concatenate([point, np.ones((n, 1))], axis=1)[..., None]
    return np.asarray(-np.linalg.solve(T_t, T_w @ p_ball)[:, :3, 0])


def table_rotation(chain: Chain, angle: Mapping[str, np.ndarray], n: int) -> np.ndarray:
    """Orientation (n, 3, 3) of the table; angle: (n,) [rad] by letter of each rotary axis of the chain."""
    turn = np.broadcast_to(np.eye(3), (n, 3, 3))
    for axis in chain.rotary:
        turn = turn @ rotation(axis.coordinate, axis.sense * angle[axis.letter])
    return turn


def _moved(axis: ChainAxis, errors: Mapping[str, float], s: Mapping[str, np.ndarray]) -> np.ndarray:
    """The axis moves along its direction, which squareness errors turn; (n, 4, 4)."""
    direction = np.eye(3)[axis.coordinate]
    for coordinate, letter in enumerate("ABC"):
        direction = rotation(coordinate, errors.get(f"{letter}0{axis.letter}", 0.0)) @ direction
    shift = np.outer(s[axis.letter], direction)
    return transformation(np.broadcast_to(np.eye(3), (len(shift), 3, 3)), shift)


def _screw(
    chain: Chain, ranges: Ranges, axis: ChainAxis, errors: Mapping[str, float], s: Mapping[str, np.ndarray]
) -> np.ndarray:
    """The errors of motion of one axis: a small screw, (n, 4, 4)."""
    t = s[axis.letter] / ranges.half[axis.letter]
    shift, turn = np.zeros((len(t), 3)), np.broadcast_to(np.eye(3), (len(t), 3, 3))
    for error in axis_errors(chain):
        if error.axis != axis.letter or error.kind == "squareness":
            continue
        value = errors.get(error.name, 0.0) * profile(error, t)
        if error.kind == "rotation":
            turn = rotation(error.direction, value) @ turn
        else:
            shift[:, error.direction] += value
    return transformation(turn, shift)

"""Single axis errors of the linear axes (ISO 230-1) and what they do to the tool, to first order.

An axis at position s (machine coordinate, from the middle of its range, half-range L) has six errors of motion, each a
profile with one number, its value at the end of the range:

- positioning, EXX: linear, EXX s/L;
- straightness, EYX, EZX: a parabola, EYX (s/L)^2; its slope is a squareness, by ISO 230-1, and none of its own;
- roll, pitch, yaw, EAX, EBX, ECX: linear, EAX s/L, rotations of what the axis carries about X, Y, Z;

and every pair of axes a squareness: C0Y (Y to X), B0Z (Z to X), A0Z (Z to Y), rotations of the second axis' direction.
Three axes have 18 + 3 = 21. Constants of the errors of motion, and a table that tilts, add up to one shift and one
tilt of the axes against the workpiece, in which none can be told from another: those six numbers are no errors of an
axis and are kept beside them (`rigid_motion`).

Errors hold at the functional point (ISO 230-1): the tool centre point with all axes in the middle of their ranges. So a
rotation moves the tool by a lever that is the sum of the motions of all axes between this one and the tool.
The nonlinear truth is `twin.calibrate.axis_errors.htm`, eq (9) of paper 000 with erratum E-000-5.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from twin.calibrate.axis_errors.chain import LINEAR, ROTARY, Chain, ChainAxis

SHORTEST = 1e-3  # m, half-range of an axis that does not move: encoder noise is no range
Kind = Literal["positioning", "straightness", "rotation", "squareness"]


@dataclass(frozen=True)
class AxisError:
    """One error: `axis` moves, `direction` is the coordinate of the motion, or about which it rotates."""

    name: str  # "EYX"; squareness "C0Y"
    kind: Kind
    axis: str  # "X"
    direction: int  # 0, 1, 2

    @property
    def unit(self) -> str:
        return "rad" if self.kind in ("rotation", "squareness") else "m"


@dataclass(frozen=True)
class Ranges:
    """Middle and half-range of every linear axis, of positions as the control counts them [m]."""

    centre: dict[str, float]
    half: dict[str, float]

    @property
    def reach(self) -> float:
        """m: the largest half-range, the lever at which rotations are weighed against displacements."""
        return max(self.half.values())

    @classmethod
    def of(cls, chain: Chain, position: np.ndarray) -> Ranges:
        """Of positions (n, n_linear) [m], columns in the order of `chain.linear`."""
        low, high = position.min(axis=0), position.max(axis=0)
        letters = [a.letter for a in chain.linear]
        half = np.maximum((high - low) / 2.0, SHORTEST)
        return cls(
            dict(zip(letters, ((low + high) / 2.0).tolist(), strict=True)),
            dict(zip(letters, half.tolist(), strict=True)),
        )


def axis_errors(chain: Chain) -> tuple[AxisError, ...]:
    """All errors of the linear axes of a chain, in the order X, Y, Z: 21 for three axes, 13 for two, 6 for one."""
    letters = sorted(a.letter for a in chain.linear)
    errors = []
    for letter in letters:
        for k, direction in enumerate(LINEAR):
            kind: Kind = "positioning" if direction == letter else "straightness"
            errors.append(AxisError(f"E{direction}{letter}", kind, letter, k))
        errors += [AxisError(f"E{about}{letter}", "rotation", letter, k) for k, about in enumerate(ROTARY)]
    for first, second, about in (("X", "Y", 2), ("X", "Z", 1), ("Y", "Z", 0)):
        if first in letters and second in letters:
            errors.append(AxisError(f"{ROTARY[about]}0{second}", "squareness", second, about))
    return tuple(errors)


def motion(chain: Chain, ranges: Ranges, position: np.ndarray) -> dict[str, np.ndarray]:
    """Motion (n,) [m] along the machine coordinate of what each axis carries, from the middle of its range.

    position (n, n_linear) [m], columns in the order of `chain.linear`.
    """
    return {
        axis.letter: axis.sense * (position[:, k] - ranges.centre[axis.letter]) for k, axis in enumerate(chain.linear)
    }


def profile(error: AxisError, t: np.ndarray) -> np.ndarray:
    """Share (n,) of an error of motion at t = s/L (n,)."""
    return t**2 if error.kind == "straightness" else t


def design_matrix(chain: Chain, ranges: Ranges, position: np.ndarray) -> np.ndarray:
    """TCP displacement, tool minus workpiece, per unit of every error (n, 3, n_errors): m/m and m/rad.

    position (n, n_linear) [m]. To first order in the errors; rotary axes do not enter where the ball's place is known,
    since then the linear axes stand where the ball is.
    """
    s = motion(chain, ranges, position)
    axes = {a.letter: a for a in chain.linear}
    levers = _levers(chain, s)
    columns = []
    for error in axis_errors(chain):
        axis = axes[error.axis]
        unit = np.eye(3)[error.direction]
        if error.kind == "squareness":
            carried = np.outer(s[axis.letter], np.cross(unit, np.eye(3)[axis.coordinate]))
        else:
            share = profile(error, s[axis.letter] / ranges.half[axis.letter])[:, None]
            carried = share * (np.cross(unit, levers[axis.letter]) if error.kind == "rotation" else unit)
        columns.append(axis.side * carried)
    return np.stack(columns, axis=2)


def rigid_motion(chain: Chain, ranges: Ranges, position: np.ndarray) -> np.ndarray:
    """TCP displacement (n, 3, 6) per shift [m] and tilt [rad] of the axes against the workpiece: 1 and m/rad.

    All axes tilt as one, about the functional point: squarenesses are not touched. position (n, n_linear) [m].
    """
    s = motion(chain, ranges, position)
    tool = sum((axis.side * translation(axis, s) for axis in chain.linear), np.zeros((len(position), 3)))
    return np.stack(
        [np.broadcast_to(e, tool.shape) for e in np.eye(3)] + [np.cross(e, tool) for e in np.eye(3)], axis=2
    )


def effect_size(chain: Chain, ranges: Ranges) -> np.ndarray:
    """What a unit of each error does at the end of the ranges at most (n_errors,): 1 or m/rad.

    Errors times this are displacements [m], which can be compared: rotations at the largest half-range of any axis.
    """
    size: Mapping[str, float] = ranges.half
    return np.array(
        [
            {"rotation": ranges.reach, "squareness": size[e.axis]}.get(e.kind, 1.0)
            for e in axis_errors(chain)
        ]
    )  # fmt: skip


def _levers(chain: Chain, s: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Per axis the tool as seen from it (n, 3) [m], from the functional point: motions of the axes nearer the tool."""
    lever = np.zeros((len(next(iter(s.values()))), 3))
    levers = {}
    for axis in chain.linear:
        levers[axis.letter] = lever
        lever = lever + axis.side * translation(axis, s)
    return levers


def translation(axis: ChainAxis, s: Mapping[str, np.ndarray]) -> np.ndarray:
    """Error-free motion (n, 3) [m] of what an axis carries."""
    return np.outer(s[axis.letter], np.eye(3)[axis.coordinate])

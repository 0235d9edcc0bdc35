"""Rotary axes in the structure: where parts stand that turned, and what holds them to their bearings.

The two sides of a bearing are held together by their displacements over the area that they share: by the coefficients
a_k, b_k (3,) of functions f_k(rho, z) cos(m_k phi), f_k sin(m_k phi) of the place (`twin.build.bearing`),

    gap = (a_k, b_k)_inner - D_k(theta) R(theta) (a_k, b_k)_outer

in the coordinates of the inner side; R turns vectors by the angle theta, D_k the pair of functions by m_k theta. So the
inner side sees the outer one bend as it stands, and a turned bearing needs no other mesh.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.rom.elastic_ports import RigidPort
from twin.rom.parallel import rotated

# N/m, of the springs that hold the two sides of a bearing: rings are bolted to their parts, whose own stiffness against
# such loads is E times the radius, 1e10 to 1e11. Bearings yield like their description's glued contact: not at all.
HELD = 1e14


STRAIGHT = 1e-6  # rad of rotary axes: what a metre turned so far moves is a micrometre


def off_zero(axis: str) -> str:
    """The flag of code that knows the TCP error with rotary axes at zero alone: exported C, offsets of `twin live`."""
    return f"axes.{axis} off zero, TCP error of zero"


@dataclass(frozen=True)
class Turn:
    """A rotary axis that turns the tool or the work."""

    axis: str
    direction: np.ndarray  # (3,) unit vector at axis positions zero
    point: np.ndarray  # (3,) m, on the axis, mesh coordinates
    port: RigidPort  # its bearing, on the part that it turns on
    sign: int  # 1: it turns the tool, -1: the work


@dataclass(frozen=True)
class FittedPort:
    """Three columns per function: its coefficients [m] in the displacement of one side of a bearing."""

    body: int
    first: int  # column within the body's ports


@dataclass(frozen=True)
class Bearing:
    """The bearing of an axis: three springs per function."""

    turn: int
    inner: FittedPort
    outer: FittedPort
    harmonics: np.ndarray  # (k,) m of every function; cosine before sine, alone where m is zero
    first: int  # its first spring

    def turned(self, theta: float) -> np.ndarray:
        """(k, k): the functions at an angle [rad] over those at zero."""
        D, k = np.eye(len(self.harmonics)), 0
        while k < len(self.harmonics):
            if m := int(self.harmonics[k]):
                c, s = np.cos(m * theta), np.sin(m * theta)
                D[k : k + 2, k : k + 2] = [[c, -s], [s, c]]
            k += 2 if m else 1
        return D


def placed(point: np.ndarray, turns: Sequence[Turn], angles: np.ndarray) -> np.ndarray:
    """Where the axes at angles [rad] bring a point (3,) [m] of the outermost part, without the linear axes."""
    for turn, angle in zip(reversed(turns), angles[::-1], strict=True):
        if angle:
            point = turn.point + rotated(angle * turn.direction) @ (point - turn.point)
    return point


def frames(point: np.ndarray, turns: Sequence[Turn], angles: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """A point in space (3,) [m] in the coordinates of the parts that axes turn one on the other, and their rotations.

    (n + 1) points (3,) and rotations (3, 3): of what the first axis turns on, which stands as drawn, then of what each
    axis turns.
    """
    found = [(point, np.eye(3))]
    for turn, angle in zip(turns, angles, strict=True):
        point, Q = found[-1]
        R = rotated(angle * turn.direction)
        found.append((turn.point + R.T @ (point - turn.point) if angle else point, Q @ R))
    return found

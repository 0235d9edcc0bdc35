"""Six struts between a frame and a platform: poses from strut lengths and back, and how strut lengths move the tool.

Strut k joins a point a_k of the frame and a point of the platform, b_k as seen from the tool centre point p, in the
frame's axes at the zero pose. At a pose (p moved by s, the platform turned by R)

    l_k n_k = p + s + R b_k - a_k,      dl = L (v, w),      L_k = [n_k, (R b_k) x n_k]

with v, w [m, rad] a small motion of the platform at its tool centre point. L is the inverse of the Jacobian J; the same
L gives strut forces' work, so a wrench at p is L^T f. The inverse is closed, the forward problem Newton's method on L,
which has one solution near the zero pose where L stays regular. Source: Merlet, Parallel Robots, 2nd ed., ch. 2 to 4.

Expansions act as strut lengths do. A platform that is warmer by T spreads its joints about p, and a frame its joints
about the point g where it holds the other side; the struts, whose lengths that does not change, then move the tool as
if they had grown by

    -alpha T n_k . R b_k   (platform),      alpha T n_k . (a_k - g)   (frame).

With struts that grow alike, alpha T l_k, the sum is L (alpha T (p + s - g), 0): everything grows about g and nothing
turns.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from twin.errors import ModelError

CLOSE = 1e-12  # m: lengths of a pose that has been found; a thousand times rounding
STEPS = 50  # of Newton's method: five do within a stroke


@dataclass(frozen=True)
class Geometry:
    """Where the joints are at the zero pose; machine coordinates."""

    point: np.ndarray  # (3,) m, tool centre point
    base: np.ndarray  # (6, 3) m, joints on the frame
    joint: np.ndarray  # (6, 3) m, joints on the platform


@dataclass(frozen=True)
class Pose:
    """Of the platform, as seen from the zero pose."""

    shift: np.ndarray  # (3,) m, of the tool centre point
    turn: np.ndarray  # (3, 3), rotation


ZERO = Pose(np.zeros(3), np.eye(3))


def rotated(w: np.ndarray) -> np.ndarray:
    """The rotation (3, 3) by |w| rad about w (3,): Rodrigues' formula."""
    angle = float(np.linalg.norm(w))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = w / angle
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross)


def moved(pose: Pose, motion: np.ndarray) -> Pose:
    """The pose after a motion (6,) [m, rad] of the platform at its tool centre point."""
    return Pose(pose.shift + motion[:3], rotated(motion[3:]) @ pose.turn)


def levers(geometry: Geometry, pose: Pose) -> np.ndarray:
    """R b (6, 3) [m]: joints of the platform as seen from the tool centre point."""
    return np.asarray((geometry.joint - geometry.point) @ pose.turn.T)


def struts(geometry: Geometry, pose: Pose) -> tuple[np.ndarray, np.ndarray]:
    """Lengths (6,) [m] and directions (6, 3) from frame to platform."""
    between = geometry.point + pose.shift + levers(geometry, pose) - geometry.base
    length = np.linalg.norm(between, axis=1)
    return length, between / length[:, None]


def inverse(geometry: Geometry, pose: Pose) -> np.ndarray:
    """Positions (6,) [m] of the struts at a pose: their lengths less those at the zero pose."""
    return struts(geometry, pose)[0] - struts(geometry, ZERO)[0]


def lines(geometry: Geometry, pose: Pose) -> np.ndarray:
    """L (6, 6) [1, m]: change of the lengths per motion of the platform; J^-1."""
    _, n = struts(geometry, pose)
    return np.hstack([n, np.cross(levers(geometry, pose), n)])


def forward(geometry: Geometry, position: np.ndarray, start: Pose = ZERO) -> Pose:
    """The pose at strut positions (6,) [m], on the branch of `start`.

    Raises ModelError where Newton's method finds none: the struts do not close there, or the platform is singular.
    """
    wanted = struts(geometry, ZERO)[0] + np.asarray(position, dtype=float)
    pose, short = start, wanted - struts(geometry, start)[0]
    for _ in range(STEPS):
        if np.abs(short).max() <= CLOSE:
            return pose
        try:
            step = np.linalg.solve(lines(geometry, pose), short)
        except np.linalg.LinAlgError:
            break
        pose, short = _shortened(geometry, pose, step, wanted, float(np.linalg.norm(short)))
    raise ModelError(
        f"no platform pose has the strut positions {np.round(1e3 * np.asarray(position), 3).tolist()} mm",
        "struts",
        "shorten the strokes: `twin check` tries the ends of all of them",
    )


def _shortened(
    geometry: Geometry, pose: Pose, step: np.ndarray, wanted: np.ndarray, before: float
) -> tuple[Pose, np.ndarray]:
    """The pose after a Newton step, halved until lengths come closer (30 halvings: then nothing does)."""
    for _ in range(30):
        tried = moved(pose, step)
        short = wanted - struts(geometry, tried)[0]
        if np.linalg.norm(short) < before or before <= CLOSE:
            break
        step = step / 2.0
    return tried, short


def joints_spread(geometry: Geometry, pose: Pose) -> np.ndarray:
    """(6,) [m]: what strut lengths seem to gain per unit of expansion of the platform, alpha T."""
    _, n = struts(geometry, pose)
    return np.asarray(-np.einsum("kc,kc->k", n, levers(geometry, pose)))


def frame_spreads(geometry: Geometry, pose: Pose, ground: np.ndarray) -> np.ndarray:
    """(6,) [m]: the same of the frame about `ground` (3,) [m]."""
    _, n = struts(geometry, pose)
    return np.asarray(np.einsum("kc,kc->k", n, geometry.base - ground))


def worst_condition(geometry: Geometry, positions: np.ndarray, lever: float) -> float:
    """Largest condition number of L over strut positions (m, 6) [m], rotations weighed by `lever` [m]: 1 were a machine
    as stiff in all directions. Raises ModelError as `forward`."""
    weigh: Callable[[np.ndarray], np.ndarray] = lambda L: L / np.array([1.0, 1.0, 1.0, lever, lever, lever])  # noqa: E731
    return max(float(np.linalg.cond(weigh(lines(geometry, forward(geometry, p))))) for p in positions)

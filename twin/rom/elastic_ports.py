"""Where springs and the TCP take hold of a body: columns of its elastic ports, and the places these stand for.

Which functionals of the displacements they are is `twin.build.elastic_ports`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class MeanPort:
    """Three columns: the mean displacement [m] of a patch."""

    body: int
    first: int  # column within the body's ports
    centroid: np.ndarray  # (3,) m, mesh coordinates


@dataclass(frozen=True)
class RigidPort:
    """Six columns: mean displacement [m] and rotation vector [rad] of a patch."""

    body: int
    first: int
    centroid: np.ndarray  # (3,) m, mesh coordinates
    normal: np.ndarray  # (3,) area-mean outward normal: of length 1 for a plane patch

    def motion_at(self, point: np.ndarray) -> np.ndarray:
        """(3, 6): displacement at `point` (3,) [m, mesh coordinates] of the patch's rigid motion."""
        return np.hstack([np.eye(3), -cross_matrix(point - self.centroid)])


@dataclass(frozen=True)
class RailPort:
    """Three columns per segment, in order along the axis."""

    body: int
    first: int
    centroids: np.ndarray  # (n_segments, 3) m, mesh coordinates
    stations: np.ndarray  # (n_segments,) m along the axis


@dataclass(frozen=True)
class AxialPort:
    """One column: the displacement [m] along a direction at a point of a surface's centre line."""

    body: int
    first: int
    point: np.ndarray  # (3,) m, mesh coordinates


def cross_matrix(r: np.ndarray) -> np.ndarray:
    """[r]x with [r]x w = r x w."""
    return np.array([[0.0, -r[2], r[1]], [r[2], 0.0, -r[0]], [-r[1], r[0], 0.0]])

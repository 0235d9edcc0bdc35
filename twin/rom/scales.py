"""Growth of scales as rows over temperatures, at an axis position: `twin.build.encoder`, `twin.build.scales`.

The temperatures are those of nodes where the rows act on fields of the full model, and rows of W (`twin.rom.model`)
where they act on those: a strip then reads the means and slopes of its slices.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin.rom.elastic_ports import AxialPort, RigidPort


@dataclass(frozen=True)
class ScaleStrip:
    """Temperature under a scale as a function of the coordinate along it: linear within each of n slices."""

    body: int
    nodes: np.ndarray  # (m,) of the body
    borders: np.ndarray  # (n + 1,) m along the axis, in the body's mesh coordinates
    centres: np.ndarray  # (n,) m: centroids of the slices along the axis
    mean: np.ndarray  # (n, m) 1: rows of the slices' mean temperature
    slope: np.ndarray  # (n, m) 1/m: rows of the temperature's slope along the axis

    def integral(self, start: float, end: float) -> np.ndarray:
        """Row (m,) [m] of int T ds from `start` to `end` [m]; negative where `end` comes first.

        Beyond the scale's ends its last slices go on.
        """
        low, high = min(start, end), max(start, end)
        a = np.clip(np.append(-np.inf, self.borders[1:-1]), low, high)
        b = np.clip(np.append(self.borders[1:-1], np.inf), low, high)
        length = b - a
        row = length @ self.mean + (length * ((a + b) / 2 - self.centres)) @ self.slope
        return row if end >= start else -row


@dataclass(frozen=True)
class LinearEncoder:
    """The scale and reader of one axis."""

    axis: int
    along: np.ndarray  # (3,) unit vector of the axis
    sign: float  # of the carried side's shift: -1 where the reader is carried, +1 where the scale is
    reader: RigidPort
    fixing: AxialPort
    fixed_at: float  # m along the axis, in mesh coordinates
    expansion: float  # 1/K
    strip: ScaleStrip

    def facing(self, offset: np.ndarray) -> float:
        """Coordinate [m] on the scale that faces the reader; offset (3,) [m]: scale's body to reader's body by pose."""
        return float((self.reader.centroid + offset) @ self.along)

    def reader_row(self, offset: np.ndarray) -> np.ndarray:
        """(6,): axial displacement of the reading head at the scale's line per port displacement of the reader."""
        mark = self.fixing.point + (self.facing(offset) - self.fixed_at) * self.along
        return self.along @ self.reader.motion_at(mark - offset)

    def scale_row(self, offset: np.ndarray) -> np.ndarray:
        """(m,) [m/K]: growth of the scale from its fixing point to the reader per T - T_ref at `strip.nodes`."""
        return self.expansion * self.strip.integral(self.fixed_at, self.facing(offset))


@dataclass(frozen=True)
class NodeRow:
    """What a node beside the parts moves the TCP by, at every position alike."""

    body: int
    states: np.ndarray  # (1,) of the body
    per_kelvin: np.ndarray  # (3,) m/K, tool minus work

    def rows(self) -> np.ndarray:
        """TCP displacement (3, 1) [m/K] per T - T_ref of the node."""
        return self.per_kelvin[:, None]


@dataclass(frozen=True)
class AddedScale:
    """What one `[scales.NAME]` adds to the TCP displacement."""

    axis: int  # of the linear ones
    along: np.ndarray  # (3,) unit vector of the axis
    body: int
    states: np.ndarray  # (m,) of the body: nodes of the surface
    mean: np.ndarray  # (m,) 1: the surface's mean temperature
    expansion: float  # 1/K
    fixed_at: float  # m, a position of the axis

    def rows(self, position: float) -> np.ndarray:
        """TCP displacement (3, m) [m/K] per T - T_ref of the states, at a position [m] of the axis."""
        return np.outer(-self.expansion * (position - self.fixed_at) * self.along, self.mean)

"""How the temperatures of a lumped machine move its tool: given rows per kelvin, and screws that grow with the nut.

The TCP displacement is tool minus work side. A screw is held by its fixed bearing; the nut, at distance xi from it,
moves by the growth of the screw between the two,

    d(xi) = int alpha (T - T_ref) dx,

away from the bearing, and takes along the side of the machine that it holds. Held at both ends by bearings that do not
yield, its length L stays and the strain of the force between them is the same everywhere, so

    d(xi) = int_0^xi alpha (T - T_ref) dx - xi/L int_0^L alpha (T - T_ref) dx,

zero for a screw that is warm all along. For temperatures that are linear between
element borders the integral is exact, so the row is piecewise quadratic in the position of the axis. Paper 001, eq
(16.2), is a polynomial of this function along one screw.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from twin.rom.parallel import Pose, forward, frame_spreads, joints_spread, lines
from twin.rom.scales import AddedScale
from twin.rom.springs import Positions
from twin.rom.struts import Spread, StrutPlatform


@dataclass(frozen=True)
class Screw:
    """A bar that positions an axis."""

    body: int  # index of its body
    first: int  # of its states in the body
    borders: np.ndarray  # (n,) m from its start
    direction: np.ndarray  # (3,) unit vector from start to end, times -1 where the nut holds the work side
    expansion: float  # 1/K
    from_end: bool  # the fixed bearing is at the bar's end
    axis: int
    nut: float  # m from the bar's start at axis position zero
    per_position: float  # +1 or -1: how the nut moves along the bar with the axis
    held_at_both: bool = False  # between two fixed bearings that do not yield: its length stays

    def row(self, position: float) -> np.ndarray:
        """TCP displacement (3, n) [m/K] per T - T_ref of the bar's states at an axis position [m]."""
        return np.outer(self.direction, self.growth(position))

    def growth(self, position: float) -> np.ndarray:
        """(n,) [m/K]: how far the nut moves along the bar, from start to end, per T - T_ref of its states."""
        nut = float(np.clip(self.nut + self.per_position * position, self.borders[0], self.borders[-1]))
        if self.held_at_both:
            share = (nut - self.borders[0]) / (self.borders[-1] - self.borders[0])
            whole = integral(self.borders, self.borders[0], self.borders[-1])
            return self.expansion * (integral(self.borders, self.borders[0], nut) - share * whole)
        start, end = (nut, self.borders[-1]) if self.from_end else (self.borders[0], nut)
        sign = -1.0 if self.from_end else 1.0
        return sign * self.expansion * integral(self.borders, start, end)


@dataclass(frozen=True)
class LumpedStructure:
    """TCP rows of a lumped machine at any axis positions; what `twin.build.structure.Structure` is for meshes."""

    axes: tuple[str, ...]  # linear, in the order of positions
    constant: tuple[np.ndarray, ...]  # per body (3, n_b) m/K
    screws: tuple[Screw, ...]
    scales: tuple[AddedScale, ...] = ()
    platform: StrutPlatform | None = None  # its struts' screws are all of `screws`, in the order of `axes`

    @property
    def moves(self) -> bool:
        """Whether any temperature moves the tool."""
        return bool(self.screws or self.scales) or any(rows.any() for rows in self.constant)

    def rows(self, positions: Positions) -> tuple[np.ndarray, ...]:
        """(3, n_b) [m/K] per body. Raises ValueError for unknown axes or a wrong number of positions."""
        given = self._vector(positions)
        if self.platform is not None:
            pose = forward(self.platform.geometry, np.array(given))
            jacobian = self.platform.sign * np.linalg.inv(lines(self.platform.geometry, pose))[:3]
            own = self._strut_rows(given, pose)
            return tuple(rows + jacobian @ grown for rows, grown in zip(self.constant, own, strict=True))
        result = [rows.copy() for rows in self.constant]
        for screw in self.screws:
            states = slice(screw.first, screw.first + len(screw.borders))
            result[screw.body][:, states] += screw.row(given[screw.axis])
        for scale in self.scales:
            result[scale.body][:, scale.states] += scale.rows(given[scale.axis])
        return tuple(result)

    def strut_error_rows(self, positions: Positions) -> tuple[np.ndarray, ...]:
        """(6, n_b) [m/K] per body: by how much the struts are too long, which minus this in their positions cancels.

        What else moves the tool (`constant`) counts as the strut lengths that would move it so. Raises ValueError
        where no struts carry a platform.
        """
        if self.platform is None:
            raise ValueError("no struts carry a platform")
        given = self._vector(positions)
        pose = forward(self.platform.geometry, np.array(given))
        L = self.platform.sign * lines(self.platform.geometry, pose)[:, :3]
        own = self._strut_rows(given, pose)
        return tuple(grown + L @ rows for rows, grown in zip(self.constant, own, strict=True))

    def along_struts(self) -> np.ndarray:
        """(6,) 1 or -1: whether a strut grows as the nut of its screw moves from start to end."""
        assert self.platform is not None
        between = self.platform.geometry.joint - self.platform.geometry.base
        return np.sign([screw.direction @ own for screw, own in zip(self.screws, between, strict=True)])

    def _strut_rows(self, given: list[float], pose: Pose) -> tuple[np.ndarray, ...]:
        """What the struts seem to grow by, (6, n_b) [m/K] per body."""
        platform = self.platform
        assert platform is not None
        rows = [np.zeros((len(self.axes), own.shape[1])) for own in self.constant]
        for k, (screw, along, growth) in enumerate(zip(self.screws, self.along_struts(), platform.growth, strict=True)):
            states = screw.first + np.arange(len(screw.borders))
            rows[screw.body][k, states] += along * screw.growth(given[screw.axis])
            for own in growth:
                rows[own.body][k, own.states] += own.rates
        spreads: list[tuple[Spread | None, np.ndarray]] = [
            (platform.moving, joints_spread(platform.geometry, pose)),
            (platform.frame, frame_spreads(platform.geometry, pose, platform.ground)),
        ]
        for spread, gains in spreads:
            if spread is not None:
                rows[spread.body][:, spread.states] += spread.expansion * np.outer(gains, spread.mean)
        return tuple(rows)

    def pose_rows(self, poses: np.ndarray) -> tuple[np.ndarray, ...]:
        """G per body (n_poses, 3, n_b) [m/K] at poses (n_poses, n_axes) [m]."""
        return tuple(np.array(rows) for rows in zip(*(self.rows(p) for p in poses), strict=True))

    def displacement(self, positions: Positions, fields: Sequence[np.ndarray]) -> np.ndarray:
        """TCP displacement (3,) [m], tool minus work side; fields: T - T_ref (n_b,) [K] per body."""
        return np.sum([rows @ T for rows, T in zip(self.rows(positions), fields, strict=True)], axis=0)

    def _vector(self, positions: Positions) -> list[float]:
        """Positions [m] in the order of `axes`; those not named are zero."""
        named = dict(positions) if isinstance(positions, Mapping) else dict(zip(self.axes, positions, strict=True))
        if unknown := set(named) - set(self.axes):
            raise ValueError(f"no linear axes {sorted(unknown)}; there are {list(self.axes)}")
        return [float(named.get(axis, 0.0)) for axis in self.axes]


def integral(nodes: np.ndarray, start: float, end: float) -> np.ndarray:
    """Weights (n,) [m] of values at nodes (n,) [m] in the integral of their linear interpolant from start to end."""
    low, high = np.clip(start, nodes[:-1], nodes[1:]), np.clip(end, nodes[:-1], nodes[1:])
    length = high - low
    right = length * ((low + high) / 2 - nodes[:-1]) / np.diff(nodes)
    weights = np.zeros(len(nodes))
    weights[1:] += right
    weights[:-1] += length - right
    return weights

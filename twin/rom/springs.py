"""The springs between bodies and to the ground, and the TCP, as rows over port displacements at an axis position.

A moving contact's pad sits at coordinate s on its rail. With the weights w_i(s) of eq (1) of paper 000 the rail moves
there by sum w_i u_i, like a point at c = sum w_i c_i. The gap compares this with the pad's rigid motion at that point:
a motion common to both opens no gap, and a force on the pad and its opposite on the segments have neither resultant
nor moment, at every position.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from twin.rom.contact import station_weights
from twin.rom.elastic_ports import MeanPort, RailPort, RigidPort
from twin.rom.scales import AddedScale, LinearEncoder, NodeRow

Positions = Mapping[str, float] | np.ndarray  # m, by axis name (others at zero) or in the order of the linear axes


@dataclass(frozen=True)
class Guide:
    """A pad on a rail: one spring per direction."""

    rail: RailPort
    pad: RigidPort
    along: np.ndarray  # (3,) unit vector of the axis
    directions: np.ndarray  # (s, 3) unit vectors
    first: int  # its first spring


@dataclass(frozen=True)
class Ground:
    """A supported surface: springs along x, y, z where stiff."""

    port: MeanPort
    directions: np.ndarray  # (s, 3)
    first: int


@dataclass(frozen=True)
class SpringSystem:
    """All springs and the TCP; P ports of all bodies one after the other."""

    axes: tuple[str, ...]
    shifts: np.ndarray  # (n_bodies, n_axes, 3) m/m: rigid translation of a body per axis position
    offsets: np.ndarray  # (n_bodies + 1,) first port of each body
    names: tuple[str, ...]  # of the springs: "contacts.x_guide.pairs[0].normal", "supports.foot.z"
    stiffness: np.ndarray  # (s,) N/m
    guides: tuple[Guide, ...]
    grounds: tuple[Ground, ...]
    tool: RigidPort
    tool_point: np.ndarray  # (3,) m at axis positions zero
    work: RigidPort
    encoders: tuple[LinearEncoder, ...] = ()  # linear scales; axes without one are read at their screw
    scales: tuple[AddedScale, ...] = ()  # growth that encoders lack
    nodes: tuple[NodeRow, ...] = ()  # beside the parts

    def vector(self, positions: Positions) -> np.ndarray:
        """Positions (n_axes,) [m] in the order of `axes`. Raises ValueError for unknown axes or a wrong number."""
        if isinstance(positions, Mapping):
            unknown = set(positions) - set(self.axes)
            if unknown:
                raise ValueError(f"no linear axis {sorted(unknown)}; axes are {self.axes}")
            return np.array([float(positions.get(a, 0.0)) for a in self.axes])
        vector = np.asarray(positions, dtype=float)
        if vector.shape != (len(self.axes),):
            raise ValueError(f"positions of shape {vector.shape} for axes {self.axes}")
        return vector

    def gap_rows(self, positions: Positions) -> np.ndarray:
        """J (s, P): gaps of the springs [m] per port displacement; -J^T f are the forces on the ports."""
        shift = np.einsum("bak,a->bk", self.shifts, self.vector(positions))
        J = np.zeros((len(self.stiffness), int(self.offsets[-1])))
        for g in self.guides:
            rows = slice(g.first, g.first + len(g.directions))
            rail_to_pad = shift[g.pad.body] - shift[g.rail.body]
            i, right = station_weights(g.rail.stations, (g.pad.centroid + rail_to_pad) @ g.along)
            at = np.zeros(3)  # where the rail faces the pad, in the rail's mesh coordinates
            for segment, weight in ((int(i), 1.0 - right), (int(i) + 1, right)):
                column = self.offsets[g.rail.body] + g.rail.first + 3 * segment
                J[rows, column : column + 3] -= weight * g.directions
                at += weight * g.rail.centroids[segment]
            column = self.offsets[g.pad.body] + g.pad.first
            J[rows, column : column + 6] += g.directions @ g.pad.motion_at(at - rail_to_pad)
        for ground in self.grounds:
            column = self.offsets[ground.port.body] + ground.port.first
            J[ground.first : ground.first + len(ground.directions), column : column + 3] = ground.directions
        return J

    def tcp_rows(self, positions: Positions) -> np.ndarray:
        """t (3, P): displacement [m] of the tool minus the work side at the tool centre point of this pose.

        With linear scales, the reader's part of it included; the scales' own growth is in `scale_rows`.
        """
        t = self.nut_rows(positions)
        for encoder in self.encoders:
            t += np.outer(self._lever(encoder) * encoder.sign, self.reader_row(encoder, positions))
        return t

    def tilt_rows(self) -> np.ndarray:
        """(3, P): rotation [rad] of the tool minus that of the work side, the same at every position."""
        t = np.zeros((3, int(self.offsets[-1])))
        for port, sign in ((self.tool, 1.0), (self.work, -1.0)):
            column = self.offsets[port.body] + port.first + 3  # behind the mean displacement
            t[:, column : column + 3] += sign * np.eye(3)
        return t

    def scale_rows(self, positions: Positions) -> list[tuple[int, np.ndarray, np.ndarray]]:
        """What each scale, and each node beside the parts, adds: (body, states (m,), TCP displacement (3, m) [m/K])."""
        at = self.vector(positions)
        return [
            (e.strip.body, e.strip.nodes, np.outer(-self._lever(e) * e.sign, self.scale_row(e, positions)))
            for e in self.encoders
        ] + [
            *((s.body, s.states, s.rows(at[s.axis])) for s in self.scales),
            *((n.body, n.states, n.rows()) for n in self.nodes),
        ]

    def scale_row(self, encoder: LinearEncoder, positions: Positions) -> np.ndarray:
        """(m,) [m/K]: growth of a scale up to its reader per T - T_ref at its `strip.nodes`."""
        return encoder.scale_row(self._offset(encoder, positions))

    def reader_row(self, encoder: LinearEncoder, positions: Positions) -> np.ndarray:
        """(P,): axial displacement [m] of the reader minus that of its scale's fixing point."""
        row = np.zeros(int(self.offsets[-1]))
        column = self.offsets[encoder.reader.body] + encoder.reader.first
        row[column : column + 6] = encoder.reader_row(self._offset(encoder, positions))
        row[self.offsets[encoder.fixing.body] + encoder.fixing.first] -= 1.0
        return row

    def carried_by(self, encoder: LinearEncoder) -> np.ndarray:
        """(n_bodies, 3): translation of each body per [reader minus fixing point minus the scale's growth]."""
        return encoder.sign * self.shifts[:, encoder.axis]

    def _lever(self, encoder: LinearEncoder) -> np.ndarray:
        """(3,): tool minus work per shift of the carried side along the axis."""
        return self.shifts[self.tool.body, encoder.axis] - self.shifts[self.work.body, encoder.axis]

    def _offset(self, encoder: LinearEncoder, positions: Positions) -> np.ndarray:
        """(3,) [m]: how far the pose brings the reader's body along relative to the scale's."""
        shift = np.einsum("bak,a->bk", self.shifts, self.vector(positions))
        return shift[encoder.reader.body] - shift[encoder.strip.body]

    def nut_rows(self, positions: Positions) -> np.ndarray:
        """t (3, P) with every nut as the datum of its axis: `tcp_rows` of a machine without linear scales."""
        shift = np.einsum("bak,a->bk", self.shifts, self.vector(positions))
        t = np.zeros((3, int(self.offsets[-1])))
        for port, sign in ((self.tool, 1.0), (self.work, -1.0)):
            point = self.tool_point + shift[self.tool.body] - shift[port.body]  # in the body's mesh coordinates
            column = self.offsets[port.body] + port.first
            t[:, column : column + 6] += sign * port.motion_at(point)
        return t

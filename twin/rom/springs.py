"""The springs between bodies and to the ground, and the TCP, as rows over port displacements at an axis position.

A moving contact's pad sits at coordinate s on its rail. With the weights w_i(s) of eq (1) of paper 000 the rail moves
there by sum w_i u_i, like a point at c = sum w_i c_i. The gap compares this with the pad's rigid motion at that point:
a motion common to both opens no gap, and a force on the pad and its opposite on the segments have neither resultant
nor moment, at every position.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from twin.rom.contact import station_weights
from twin.rom.elastic_ports import MeanPort, RailPort, RigidPort
from twin.rom.parallel import rotated
from twin.rom.scales import AddedScale, LinearEncoder, NodeRow
from twin.rom.turning import Bearing, Turn, frames, placed

# m, by axis name (others at zero) or in the order of the linear axes; then the angles [rad] of the axes that turn
Positions = Mapping[str, float] | np.ndarray


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
    turns: tuple[Turn, ...] = ()  # rotary axes: of the tool, then of the work, each from the guides outwards
    staged: bool = True  # what turned is seen from its bearing, as at angle zero
    bearings: tuple[Bearing, ...] = ()  # of all `turns`, where bodies are cut there

    @property
    def turning(self) -> tuple[str, ...]:
        """Rotary axes, in the order of angles."""
        return tuple(turn.axis for turn in self.turns)

    def vector(self, positions: Positions) -> np.ndarray:
        """Positions (n_axes,) [m] in the order of `axes`. Raises ValueError for unknown axes or a wrong number."""
        return self._split(positions)[0]

    def angles(self, positions: Positions) -> np.ndarray:
        """Angles (n_turning,) [rad] in the order of `turns`, zero where none are given. Raises as `vector`."""
        return self._split(positions)[1]

    def _split(self, positions: Positions) -> tuple[np.ndarray, np.ndarray]:
        n, names = len(self.axes), (*self.axes, *self.turning)
        if isinstance(positions, Mapping):
            unknown = set(positions) - set(names)
            if unknown:
                raise ValueError(f"no linear axis {sorted(unknown)}; axes are {names}")
            vector = np.array([float(positions.get(a, 0.0)) for a in names])
            return vector[:n], vector[n:]
        vector = np.asarray(positions, dtype=float)
        if vector.shape == (n,):
            return vector, np.zeros(len(self.turns))
        if vector.shape != (len(names),):
            raise ValueError(f"positions of shape {vector.shape} for axes {names}")
        return vector[:n], vector[n:]

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
        for bearing in self.bearings:
            k, theta = 3 * len(bearing.harmonics), self.angles(positions)[bearing.turn]
            rows = slice(bearing.first, bearing.first + k)
            R = rotated(theta * self.turns[bearing.turn].direction)
            inner, outer = (int(self.offsets[p.body] + p.first) for p in (bearing.inner, bearing.outer))
            J[rows, inner : inner + k] += np.eye(k)
            J[rows, outer : outer + k] -= np.kron(bearing.turned(theta), R)
        return J

    def tcp_rows(self, positions: Positions) -> np.ndarray:
        """t (3, P): displacement [m] of the tool minus the work side at the tool centre point of this pose.

        With linear scales, the reader's part of it included; the scales' own growth is in `scale_rows`.
        """
        t = self.nut_rows(positions)
        for encoder in self.encoders:
            t += np.outer(self._lever(encoder) * encoder.sign, self.reader_row(encoder, positions))
        return t

    def tilt_rows(self, positions: Positions) -> np.ndarray:
        """(3, P): rotation [rad] of the tool minus that of the work side, the same wherever linear axes stand."""
        t = np.zeros((3, int(self.offsets[-1])))
        for port, _, Q in self._sides(positions):
            column = self.offsets[port.body] + port.first + 3  # behind the mean displacement
            t[:, column : column + 3] += Q
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
        t = np.zeros((3, int(self.offsets[-1])))
        for port, point, Q in self._sides(positions):
            column = self.offsets[port.body] + port.first
            t[:, column : column + 6] += Q @ port.motion_at(point)
        return t

    def tool_centre(self, positions: Positions) -> np.ndarray:
        """(3,) m: where the tool centre point is in the machine."""
        at, angles = self._split(positions)
        own = [k for k, turn in enumerate(self.turns) if turn.sign == 1]
        point = placed(self.tool_point, [self.turns[k] for k in own], angles[own])
        return np.asarray(point + at @ self.shifts[self.tool.body])

    def in_space(
        self, axis: str, point: np.ndarray, direction: np.ndarray, positions: Positions
    ) -> tuple[np.ndarray, np.ndarray]:
        """Point (3,) [m] and direction (3,) of a rotary axis that others turn, without the linear axes."""
        if axis not in self.turning:
            return point, direction
        k, angles = self.turning.index(axis), self.angles(positions)
        inner = [i for i in range(k) if self.turns[i].sign == self.turns[k].sign]
        turns = [self.turns[i] for i in inner]
        there = placed(point, turns, angles[inner])
        return there, placed(point + direction, turns, angles[inner]) - there

    def _sides(self, positions: Positions) -> Iterator[tuple[RigidPort, np.ndarray, np.ndarray]]:
        """Ports whose rigid motions, taken at a point (3,) of their mesh and times (3, 3), make up tool minus work.

        Of a machine that is not cut at its bearings, what turned moves with its bearing, and against it as at angle
        zero, in its own coordinates:  Q_0 M_1(r_0) + sum_i Q_i (M_(i+1)(r_i) - M_i(r_i)),  M_i the motion of the i-th
        bearing, the patch of tool or work behind the last, Q_i and r_i of `twin.rom.turning.frames`.
        """
        at, angles = self._split(positions)
        shift = np.einsum("bak,a->bk", self.shifts, at)
        own = {sign: [k for k, turn in enumerate(self.turns) if turn.sign == sign] for sign in (1, -1)}
        turns = {sign: [self.turns[k] for k in own[sign]] for sign in own}
        centre = self.tool_centre(positions)
        for port, sign in ((self.tool, 1), (self.work, -1)):
            found = frames(centre - shift[port.body], turns[sign], angles[own[sign]])
            ports = [turn.port for turn in turns[sign]] if self.staged else []
            for held, (r, Q), (beyond, R) in zip(ports, found[:-1], found[1:], strict=bool(ports)):
                yield held, r, sign * Q
                yield held, beyond, -sign * R
            yield port, found[-1][0], sign * found[-1][1]

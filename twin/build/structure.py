"""The elastic machine under temperature fields of the full model, at any axis position without another factorisation.

With w = H T + F p + R a of each body (`flexibility`) in the equations of `twin.rom.elastic_structure`:

    TCP displacement  = t w + growth of linear scales (`encoder`, `scales`)

T is temperature above the reference, per node of each body; tanks follow the nodes, as in the thermal model, and move
nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy.sparse import csr_array

from twin.build.cut_structure import cut_structure
from twin.build.elastic_ports import PortTable
from twin.build.elasticity import body_elasticity
from twin.build.encoder import EncoderTerms
from twin.build.flexibility import BodyFlexibility, block_count, condense
from twin.build.free_nodes import node_rows
from twin.build.linear import linear_elasticity
from twin.build.mesh import BodyMesh
from twin.build.springs import spring_system
from twin.build.workers import workers
from twin.machine.bodies import bodies_of, tanks_on
from twin.machine.description import Machine
from twin.machine.free_nodes import free_nodes
from twin.machine.turning import turning_axes
from twin.progress import Progress, silent
from twin.rom.elastic_structure import ElasticStructure
from twin.rom.scales import LinearEncoder
from twin.rom.springs import Positions

LARGEST_AT_ONCE = 100_000  # nodes of a machine whose bodies are factored at the same time


@dataclass(frozen=True)
class Structure(ElasticStructure):
    """The condensed machine with the port displacements by nodal temperatures; scales read temperatures of nodes."""

    bodies: tuple[BodyFlexibility, ...]

    def pose_rows(self, poses: np.ndarray) -> tuple[np.ndarray, ...]:
        """G per body (n_poses, 3, n_nodes_b) [m/K], the TCP displacement being sum_b G_b T_b.

        poses (n_poses, n_axes) [m], rotary axes at zero.
        """
        stacked = [np.array(z) for z in zip(*(self.rows(p) for p in poses), strict=True)]
        rows = tuple(
            (z.reshape(-1, z.shape[2]) @ body.H).reshape(len(poses), 3, -1)
            for z, body in zip(stacked, self.bodies, strict=True)
        )
        for i, pose in enumerate(poses):
            for b, nodes, growth in self.system.scale_rows(pose):
                rows[b][i][:, nodes] += growth
        return rows

    def displacement(self, positions: Positions, fields: Sequence[np.ndarray]) -> np.ndarray:
        """TCP displacement (3,) [m], tool minus work side; fields: T - T_ref (n_nodes_b,) [K] per body."""
        rows = self.rows(positions)
        w = np.sum([z @ (b.H @ T) for z, b, T in zip(rows, self.bodies, fields, strict=True)], axis=0)
        if self.cut is not None and (turned := self.turned_rows(positions)):
            for b, piece, z in zip(self.cut.owners, self.cut.structure.bodies, turned, strict=True):
                assert isinstance(piece, BodyFlexibility)
                w = w + z @ (piece.H @ fields[b])
        for b, nodes, growth in self.system.scale_rows(positions):
            w = w + growth @ fields[b][nodes]
        return w

    def encoder_terms(self, axis: str, positions: Positions, fields: Sequence[np.ndarray]) -> EncoderTerms:
        """What makes up the error along an axis, actual minus indicated; fields as in `displacement`.

        The axis' own scale only: scales of other axes act along those. Reader and scale are zero for a rotary encoder,
        and for an axis that carries both tool and work. Raises ValueError for an unknown linear axis.
        """
        if axis not in self.axes:
            raise ValueError(f"no linear axis '{axis}'; axes are {self.axes}")
        w = self._port_displacements(positions, fields)
        k = self.axes.index(axis)
        moves = self.system.shifts[:, k]
        along = moves[np.argmax(np.linalg.norm(moves, axis=1))]
        reader = scale = 0.0
        for e in self.system.encoders:
            if e.axis == k:
                lever = float((moves[self.system.tool.body] - moves[self.system.work.body]) @ along) * e.sign
                reader = lever * float(self.system.reader_row(e, positions) @ w)
                scale = -lever * self._growth(e, positions, fields)
        for added in self.system.scales:
            if added.axis == k:
                rows = added.rows(self.system.vector(positions)[k])
                scale += float(along @ rows @ fields[added.body][added.states])
        return EncoderTerms(float(along @ self.system.nut_rows(positions) @ w), reader, scale)

    def encoder_shifts(self, positions: Positions, fields: Sequence[np.ndarray]) -> np.ndarray:
        """(n_bodies, 3) [m]: what linear scales move each body by, on top of where nuts and springs hold it.

        Without `[scales]`, which act on the TCP alone.
        """
        return self.scale_shifts(positions, self._port_displacements(positions, fields), fields)

    def _growth(self, encoder: LinearEncoder, positions: Positions, fields: Sequence[np.ndarray]) -> float:
        """Growth [m] of a scale from its fixing point to its reader."""
        return float(self.system.scale_row(encoder, positions) @ fields[encoder.strip.body][encoder.strip.nodes])

    def _port_displacements(self, positions: Positions, fields: Sequence[np.ndarray]) -> np.ndarray:
        """w = H T + F p + R a (P,) of all bodies, with every nut as the datum of its axis."""
        HT = np.concatenate([b.H @ T for b, T in zip(self.bodies, fields, strict=True)])
        return self.port_displacements(positions, HT)

    def solve(self, positions: Positions, fields: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """Spring forces (s,) [N], positive where the gap opens, in the order of `system.names`, and rigid motions
        (n_bodies, 6) [m, rad about the machine origin] of the bodies on their node supports."""
        J = self.system.gap_rows(positions)
        HT = np.concatenate([b.H @ T for b, T in zip(self.bodies, fields, strict=True)])
        f, a = self._solve(J, J @ HT, np.zeros(6 * len(self.bodies)))
        scaled = a.reshape(-1, 6)
        return f, np.array([self._about_origin(i) @ scaled[i] for i in range(len(self.bodies))])


def assemble_structure(
    machine: Machine, bodies: tuple[BodyMesh, ...], progress: Progress = silent, linear: bool = False
) -> Structure:
    """Condense every body to its elastic ports, and check that no body moves freely within the strokes.

    bodies: the meshes in the order of `bodies_of`. linear: displacements between vertices are (`twin.build.linear`),
    on straight meshes. Raises DescriptionError (contacts that do not touch, pads without a
    normal) and ModelError (a mechanism, naming body and direction).
    """
    ports = PortTable(bodies)
    system = replace(spring_system(machine, bodies_of(machine), ports), nodes=node_rows(machine, bodies[0]))
    at_once = workers() if sum(body.n for body in bodies) < LARGEST_AT_ONCE else 1
    with (
        progress("elastic bodies", sum(block_count(len(names)) for names in ports.names)) as advance,
        ThreadPoolExecutor(at_once) as pool,  # sparse solvers let go of the interpreter
    ):

        def condensed(body: BodyMesh, names: list[str], U: csr_array) -> BodyFlexibility:
            found = _condensed(machine, body, names, U, linear, advance)
            more = len(tanks_on(machine, tuple(part.name for part in body.parts)))  # these bend nothing
            more += len(free_nodes(machine)) if body is bodies[0] else 0
            return replace(found, H=np.pad(found.H, ((0, 0), (0, more)))) if more else found

        flexible = list(pool.map(condensed, bodies, ports.names, ports.matrices()))
    middles = np.array([body.nodes.mean(axis=0) for body in bodies])
    size = max(float(np.linalg.norm(b.nodes - m, axis=1).max()) for b, m in zip(bodies, middles, strict=True))
    turned = len({t.body for t in turning_axes(machine)})
    with progress("bodies cut at bearings", turned) as advance:
        cut = cut_structure(
            machine, bodies, tuple(flexible),
            lambda apart, piece, names, U: _condensed(apart, piece, names, U, linear, lambda _: None),
        )  # fmt: skip
        if turned:
            advance("all pieces")
    structure = Structure(tuple(flexible), system, middles, size, cut)
    for corner in product(*(machine.axes[a].stroke for a in system.axes)):
        structure.rows(np.array(corner))
    return structure


def _condensed(
    machine: Machine, body: BodyMesh, names: list[str], U: csr_array, linear: bool, advance: Callable[[str], None]
) -> BodyFlexibility:
    solid, points = body_elasticity(machine, body), body.nodes
    if linear:
        solid, U, points = linear_elasticity(body, solid, U)
    return condense(body.name, tuple(names), U, solid, points, advance)

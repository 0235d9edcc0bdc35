"""The elastic machine: flexible bodies on springs, solved at any axis position without another factorisation.

Springs act on gaps g = J w of port displacements w; with w = H T + F p + R a of each body (`flexibility`), p = -J^T f:

    (k^-1 + J F J^T) f - J R a = J H T        compatibility, k the spring stiffnesses
                      R^T J^T f = 0           equilibrium of every body
    TCP displacement  = t w + growth of linear scales (`encoder`, `scales`)

Only J (which segments face which pad, levers) and t (levers of the tool centre point) depend on the position, so a pose
costs one dense system of the size of the springs. T is temperature above the reference, per node of each body; tanks
follow the nodes, as in the thermal model, and move nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.sparse import csr_array

from twin.build.elastic_ports import PortTable, cross_matrix
from twin.build.elasticity import body_elasticity
from twin.build.encoder import EncoderTerms, LinearEncoder
from twin.build.flexibility import BodyFlexibility, block_count, condense
from twin.build.mesh import BodyMesh
from twin.build.springs import Positions, SpringSystem, spring_system
from twin.build.workers import workers
from twin.errors import ModelError
from twin.machine.bodies import bodies_of, tanks_on
from twin.machine.description import Machine
from twin.progress import Progress, silent

LARGEST_AT_ONCE = 100_000  # nodes of a machine whose bodies are factored at the same time
FREE = 1e-9  # rigid-body stiffness (scaled to lengths) below this share of the largest is a mechanism


@dataclass(frozen=True)
class Structure:
    """The condensed machine."""

    bodies: tuple[BodyFlexibility, ...]
    system: SpringSystem
    middles: np.ndarray  # (n_bodies, 3) m: mean of each body's nodes, in mesh coordinates
    size: float  # m: largest distance of a node from its body's middle

    @property
    def axes(self) -> tuple[str, ...]:
        """Linear axes, in the order of positions."""
        return self.system.axes

    def rows(self, positions: Positions) -> tuple[np.ndarray, ...]:
        """Z_b (3, n_ports_b) per body: the TCP displacement is sum_b Z_b H_b T_b at this pose, plus `scale_rows`.

        Raises ModelError where a body can move freely.
        """
        J, t = self.system.gap_rows(positions), self.system.tcp_rows(positions)
        tF = np.hstack([part @ body.F for part, body in self._split(t)])
        tR = np.hstack([part @ modes for (part, _), modes in zip(self._split(t), self._modes(), strict=True)])
        f, _ = self._solve(J, -J @ tF.T, tR.T)  # the system is symmetric: solved for the rows of the TCP
        return tuple(part for part, _ in self._split(t + f.T @ J))

    def pose_rows(self, poses: np.ndarray) -> tuple[np.ndarray, ...]:
        """G per body (n_poses, 3, n_nodes_b) [m/K], the TCP displacement being sum_b G_b T_b.

        poses (n_poses, n_axes) [m].
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
        shifts = np.zeros((len(self.bodies), 3))
        if self.system.encoders:
            w = self._port_displacements(positions, fields)
            for e in self.system.encoders:
                off = float(self.system.reader_row(e, positions) @ w) - self._growth(e, positions, fields)
                shifts += off * self.system.carried_by(e)
        return shifts

    def _growth(self, encoder: LinearEncoder, positions: Positions, fields: Sequence[np.ndarray]) -> float:
        """Growth [m] of a scale from its fixing point to its reader."""
        return float(self.system.scale_row(encoder, positions) @ fields[encoder.strip.body][encoder.strip.nodes])

    def _port_displacements(self, positions: Positions, fields: Sequence[np.ndarray]) -> np.ndarray:
        """w = H T + F p + R a (P,) of all bodies, with every nut as the datum of its axis."""
        J = self.system.gap_rows(positions)
        HT = np.concatenate([b.H @ T for b, T in zip(self.bodies, fields, strict=True)])
        f, a = self._solve(J, J @ HT, np.zeros(6 * len(self.bodies)))
        forces = np.split(-J.T @ f, self.system.offsets[1:-1])
        elastic = [b.F @ p for b, p in zip(self.bodies, forces, strict=True)]
        rigid = [m @ x for m, x in zip(self._modes(), a.reshape(-1, 6), strict=True)]
        return HT + np.concatenate(elastic) + np.concatenate(rigid)

    def solve(self, positions: Positions, fields: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """Spring forces (s,) [N], positive where the gap opens, in the order of `system.names`, and rigid motions
        (n_bodies, 6) [m, rad about the machine origin] of the bodies on their node supports."""
        J = self.system.gap_rows(positions)
        HT = np.concatenate([b.H @ T for b, T in zip(self.bodies, fields, strict=True)])
        f, a = self._solve(J, J @ HT, np.zeros(6 * len(self.bodies)))
        scaled = a.reshape(-1, 6)
        return f, np.array([self._about_origin(i) @ scaled[i] for i in range(len(self.bodies))])

    def _split(self, rows: np.ndarray) -> list[tuple[np.ndarray, BodyFlexibility]]:
        return list(zip(np.split(rows, self.system.offsets[1:-1], axis=1), self.bodies, strict=True))

    def _about_origin(self, body: int) -> np.ndarray:
        """(6, 6): rigid motion about a body's middle, rotations times `size`, to motion about the machine origin."""
        T = np.eye(6)
        T[:3, 3:] = cross_matrix(self.middles[body]) / self.size
        T[3:, 3:] /= self.size
        return T

    def _modes(self) -> list[np.ndarray]:
        """Per body (n_ports_b, 6) port displacements of rigid motions about its middle: six modes of like size."""
        return [body.R @ self._about_origin(i) for i, body in enumerate(self.bodies)]

    def _solve(self, J: np.ndarray, gap: np.ndarray, resultant: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Spring forces f and rigid motions a of S f - B a = gap, -B^T f = resultant, with S = 1/k + J F J^T, B = J R.

        Raises ModelError where B^T S^-1 B, the stiffness of the springs and bodies against rigid motion, is singular.
        """
        parts = self._split(J)
        B = np.hstack([part @ modes for (part, _), modes in zip(parts, self._modes(), strict=True)])
        if not len(B):
            self._refuse_mechanism(np.zeros((B.shape[1],) * 2))
        S = np.diag(1.0 / self.system.stiffness) + np.sum([part @ body.F @ part.T for part, body in parts], axis=0)
        factor = cho_factor(S)
        stiffness = B.T @ cho_solve(factor, B)
        self._refuse_mechanism(stiffness)
        a = np.linalg.solve(stiffness, -resultant - B.T @ cho_solve(factor, gap))
        return cho_solve(factor, gap + B @ a), a

    def _refuse_mechanism(self, stiffness: np.ndarray) -> None:
        eigenvalues, vectors = np.linalg.eigh(stiffness)
        free = vectors[:, eigenvalues <= FREE * max(eigenvalues[-1], np.finfo(float).tiny)]
        if not free.shape[1]:
            return
        freedom = free @ free.T  # projector on the free motions
        worst = int(np.argmax(np.diag(freedom)))
        motion = np.linalg.norm(freedom[:, worst].reshape(-1, 6), axis=1)
        along = np.linalg.norm(freedom[worst])
        together = [b.name for b, m in zip(self.bodies, motion, strict=True) if m > 0.1 * along]
        name = self.bodies[worst // 6].name
        others = [n for n in together if n != name]
        kind, axis = ("moves freely along" if worst % 6 < 3 else "turns freely about"), "xyz"[worst % 3]
        raise ModelError(
            f"body '{name}' {kind} {axis}" + (f", together with {', '.join(others)}" if others else ""),
            "the structure is a mechanism",
            f"{free.shape[1]} free motion(s): give stiffness in that direction to a moving contact of the body "
            "(axial for its screw; normal, lateral for its guides) or to a support",
        )


def assemble_structure(machine: Machine, bodies: tuple[BodyMesh, ...], progress: Progress = silent) -> Structure:
    """Condense every body to its elastic ports, and check that no body moves freely within the strokes.

    bodies: the meshes in the order of `bodies_of`. Raises DescriptionError (contacts that do not touch, pads without a
    normal) and ModelError (a mechanism, naming body and direction).
    """
    ports = PortTable(bodies)
    system = spring_system(machine, bodies_of(machine), ports)
    at_once = workers() if sum(body.n for body in bodies) < LARGEST_AT_ONCE else 1
    with (
        progress("elastic bodies", sum(block_count(len(names)) for names in ports.names)) as advance,
        ThreadPoolExecutor(at_once) as pool,  # sparse solvers let go of the interpreter
    ):

        def condensed(body: BodyMesh, names: list[str], U: csr_array) -> BodyFlexibility:
            found = condense(body.name, tuple(names), U, body_elasticity(machine, body), body.nodes, advance)
            tanks = len(tanks_on(machine, tuple(part.name for part in body.parts)))  # these move nothing
            return replace(found, H=np.pad(found.H, ((0, 0), (0, tanks)))) if tanks else found

        flexible = list(pool.map(condensed, bodies, ports.names, ports.matrices()))
    middles = np.array([body.nodes.mean(axis=0) for body in bodies])
    size = max(float(np.linalg.norm(b.nodes - m, axis=1).max()) for b, m in zip(bodies, middles, strict=True))
    structure = Structure(tuple(flexible), system, middles, size)
    for corner in product(*(machine.axes[a].stroke for a in system.axes)):
        structure.rows(np.array(corner))
    return structure

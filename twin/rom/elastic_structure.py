"""The elastic machine as its ports see it: flexible bodies on springs, solved at any axis position.

Springs act on gaps g = J w of port displacements w; with w = h + F p + R a of each body, h the displacements by heat of
the supported body's ports (W x in `twin.rom.model`), p = -J^T f the forces on them and a the rigid motion:

    (k^-1 + J F J^T) f - J R a = J h          compatibility, k the spring stiffnesses
                      R^T J^T f = 0           equilibrium of every body
    TCP displacement  = t w

Only J (which segments face which pad, levers) and t (levers of the tool centre point) depend on the position, so a pose
costs one dense system of the size of the springs. Static condensation: see `twin.build.flexibility`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import block_diag, cho_factor, cho_solve

from twin.errors import ModelError
from twin.rom.elastic_ports import cross_matrix
from twin.rom.springs import Positions, SpringSystem

FREE = 1e-9  # rigid-body stiffness (scaled to lengths) below this share of the largest is a mechanism


class Mechanism(ModelError):
    """A body moves freely, alone or together with others."""

    def __init__(self, what: str, remedy: str, bodies: tuple[str, ...]):
        super().__init__(what, "the structure is a mechanism", remedy)
        self.bodies = bodies  # the one that moves most first


@dataclass(frozen=True)
class PortFlexibility:
    """A body seen from its p elastic ports."""

    name: str
    F: np.ndarray  # (p, p) m/N (or rad/(N m) ...): port displacement of the supported body per port force
    R: np.ndarray  # (p, 6) port displacement per translation [m] and rotation about the machine origin [rad]


@dataclass(frozen=True)
class ElasticStructure:
    """The machine condensed to its elastic ports."""

    bodies: tuple[PortFlexibility, ...]
    system: SpringSystem
    middles: np.ndarray  # (n_bodies, 3) m: mean of each body's nodes, in mesh coordinates
    size: float  # m: largest distance of a node from its body's middle
    cut: CutStructure | None = None  # where rotary axes turn parts of bodies

    @property
    def axes(self) -> tuple[str, ...]:
        """Linear axes, in the order of positions."""
        return self.system.axes

    def rows(self, positions: Positions) -> tuple[np.ndarray, ...]:
        """Z_b (3, n_ports_b) per body: the TCP displacement is sum_b Z_b h_b at this pose, plus `scale_rows`.

        Raises Mechanism where a body can move freely.
        """
        return self._rows(positions, self.system.tcp_rows(positions))

    def tilt_rows(self, positions: Positions) -> tuple[np.ndarray, ...]:
        """The same of the tool's rotation [rad] against the work, about x, y, z of the machine; scales turn nothing."""
        return self._rows(positions, self.system.tilt_rows(positions))

    def _rows(self, positions: Positions, t: np.ndarray) -> tuple[np.ndarray, ...]:
        """What t (k, P) reads of port displacements, per port displacement of the supported bodies, body by body."""
        J = self.system.gap_rows(positions)
        # the system is symmetric: solved for the rows of the TCP
        f, _ = self._solve(J, -J @ (self._flexibility @ t.T), (t @ self._motions).T)
        return tuple(np.split(t + f.T @ J, self.system.offsets[1:-1], axis=1))

    def port_displacements(self, positions: Positions, heat: np.ndarray) -> np.ndarray:
        """w = h + F p + R a (P,) of all bodies, with every nut as the datum of its axis.

        heat: h (P,), displacements by heat of the supported bodies' ports. Raises Mechanism where a body moves freely.
        """
        return self.motion(positions, heat)[2]

    def motion(self, positions: Positions, heat: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Forces p (P,) [N, N m] on the ports, rigid motions (n_bodies, 6) [m, rad about the machine origin], w (P,).

        What every point of a body does follows from the first two. heat and errors as of `port_displacements`.
        """
        J = self.system.gap_rows(positions)
        f, a = self._solve(J, J @ heat, np.zeros(6 * len(self.bodies)))
        p = -J.T @ f
        rigid = np.array([self._about_origin(i) @ own for i, own in enumerate(a.reshape(-1, 6))])
        return p, rigid, np.asarray(heat + self._flexibility @ p + self._motions @ a)

    def scale_shifts(self, positions: Positions, w: np.ndarray, read: Sequence[np.ndarray]) -> np.ndarray:
        """(n_bodies, 3) [m]: what linear scales move each body by, on top of where nuts and springs hold it.

        w: `port_displacements`; read: what strips of scales read of each body, temperatures of nodes or elastic inputs.
        Without `[scales]`, which act on the TCP alone.
        """
        shifts = np.zeros((len(self.bodies), 3))
        for e in self.system.encoders:
            growth = float(self.system.scale_row(e, positions) @ read[e.strip.body][e.strip.nodes])
            shifts += (float(self.system.reader_row(e, positions) @ w) - growth) * self.system.carried_by(e)
        return shifts

    def turned_rows(self, positions: Positions) -> tuple[np.ndarray, ...]:
        """What rotary axes off zero add: (3, p) per cut body over its ports, as `rows`; none where all are at zero."""
        return () if self.cut is None else self.cut.difference(positions, SpringSystem.tcp_rows)

    def turned_tilt_rows(self, positions: Positions) -> tuple[np.ndarray, ...]:
        """The same for `tilt_rows`."""
        return () if self.cut is None else self.cut.difference(positions, SpringSystem.tilt_rows)

    def refuse_mechanism(self, positions: Positions) -> None:
        """Raises Mechanism where a body can move freely, as `rows` does; displacements are not solved for."""
        J = self.system.gap_rows(positions)
        B = J @ self._motions
        if not len(B):
            self._refuse_mechanism(np.zeros((B.shape[1],) * 2))
        self._refuse_mechanism(B.T @ cho_solve(self._yielding(J), B))

    @cached_property
    def _flexibility(self) -> np.ndarray:
        """(P, P) of all ports: block diagonal."""
        return np.asarray(block_diag(*(body.F for body in self.bodies)))

    @cached_property
    def _motions(self) -> np.ndarray:
        """(P, 6 n_bodies) port displacements of rigid motions of the bodies about their middles: modes of like size."""
        return np.asarray(block_diag(*(body.R @ self._about_origin(i) for i, body in enumerate(self.bodies))))

    def _about_origin(self, body: int) -> np.ndarray:
        """(6, 6): rigid motion about a body's middle, rotations times `size`, to motion about the machine origin."""
        T = np.eye(6)
        T[:3, 3:] = cross_matrix(self.middles[body]) / self.size
        T[3:, 3:] /= self.size
        return T

    def _solve(self, J: np.ndarray, gap: np.ndarray, resultant: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Spring forces f and rigid motions a of S f - B a = gap, -B^T f = resultant, with S = 1/k + J F J^T, B = J R.

        Raises Mechanism where B^T S^-1 B, the stiffness of the springs and bodies against rigid motion, is singular.
        """
        B = J @ self._motions
        if not len(B):
            self._refuse_mechanism(np.zeros((B.shape[1],) * 2))
        factor = self._yielding(J)
        stiffness = B.T @ cho_solve(factor, B)
        self._refuse_mechanism(stiffness)
        a = np.linalg.solve(stiffness, -resultant - B.T @ cho_solve(factor, gap))
        return cho_solve(factor, gap + B @ a), a

    def _yielding(self, J: np.ndarray) -> tuple[np.ndarray, bool]:
        """S = 1/k + J F J^T, factored."""
        used = np.flatnonzero(J.any(axis=0))  # a pad faces two segments of its rail, not all
        S = np.diag(1.0 / self.system.stiffness) + J[:, used] @ self._flexibility[np.ix_(used, used)] @ J[:, used].T
        factor: tuple[np.ndarray, bool] = cho_factor(S)
        return factor

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
        raise Mechanism(
            f"body '{name}' {kind} {axis}" + (f", together with {', '.join(others)}" if others else ""),
            f"{free.shape[1]} free motion(s): give stiffness in that direction to a moving contact of the body "
            "(axial for its screw; normal, lateral for its guides) or to a support; what turns needs one off the line "
            "of the others",
            (name, *others),
        )


@dataclass(frozen=True)
class CutStructure:
    """The machine with bodies cut at the bearings of rotary axes, which hold the pieces together (`twin.rom.turning`).

    Bearings hold a few moments where bodies are glued all over, so this machine is not quite the glued one. What it
    tells is by how much turned parts bend otherwise than seen from their bearings as at angle zero, which is what the
    whole machine takes (`SpringSystem`): a correction of that, none at angles zero.
    """

    structure: ElasticStructure
    names: tuple[str, ...]  # of the cut bodies
    owners: tuple[int, ...]  # body of the machine that each of them is all of, or a piece of
    inputs: tuple[np.ndarray, ...]  # (p,) elastic inputs of the owner that are its ports

    def difference(
        self, positions: Positions, read: Callable[[SpringSystem, Positions], np.ndarray]
    ) -> tuple[np.ndarray, ...]:
        """Rows (3, p) of what is read, with turned bearings minus seen from them; none where all angles are zero."""
        system = self.structure.system
        if not system.angles(positions).any():
            return ()
        turned = self.structure._rows(positions, read(replace(system, staged=False), positions))
        straight = self.structure._rows(system.vector(positions), read(system, positions))
        return tuple(a - b for a, b in zip(turned, straight, strict=True))

"""Where springs and the TCP take hold of a body: area-mean functionals of surface patches on its displacements.

A *mean* port is the mean displacement of a patch (3 scalars), an *axial* port one component at a point. A *rigid* port
adds the patch's rotation (3 scalars), the least-squares fit of a rigid motion u + w x (x - c) to its displacements
(paper 000, Fig. 6, fits a plane to nodes: the fit over the area depends on the patch, not on its mesh). The transpose
of a port spreads a force over its patch, so that every force and moment that passes a port is conserved.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields

import numpy as np
from scipy.sparse import coo_array, csr_array

from twin.build.bearing import common_points
from twin.build.mesh import BodyMesh, PartMesh, body_mesh
from twin.build.surface import Patch, SurfacePoints, facet_nodes, patch, patch_of, segments
from twin.errors import DescriptionError
from twin.machine.bodies import split_surface
from twin.rom.elastic_ports import AxialPort, MeanPort, RailPort, RigidPort
from twin.rom.turning import FittedPort

COMPONENTS = ("ux", "uy", "uz", "rx", "ry", "rz")


@dataclass
class PortTable:
    """Collects the ports of all bodies; asking twice for the same port gives the same columns.

    Its methods raise DescriptionError for surfaces that do not exist.
    """

    bodies: tuple[BodyMesh, ...]
    names: list[list[str]] = field(default_factory=list)
    _rows: list[list[tuple[np.ndarray, np.ndarray]]] = field(default_factory=list)
    _known: dict[tuple[object, ...], MeanPort | RigidPort | RailPort | AxialPort] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.names = [[] for _ in self.bodies]
        self._rows = [[] for _ in self.bodies]

    def mean(self, surface: str) -> MeanPort:
        """The mean port of a "part.surface"."""
        key = ("mean", surface)
        if key not in self._known:
            body, offset, whole = self._patch(surface)
            self._known[key] = MeanPort(body, self._add_mean(body, offset, surface, whole), whole.centroid)
        port = self._known[key]
        assert isinstance(port, MeanPort)
        return port

    def rigid(self, surface: str) -> RigidPort:
        """The rigid port of a "part.surface"."""
        key = ("rigid", surface)
        if key not in self._known:
            body, offset, whole = self._patch(surface)
            self._known[key] = self._rigid(body, offset, surface, whole)
        port = self._known[key]
        assert isinstance(port, RigidPort)
        return port

    def seat(self, pairs: Sequence[tuple[str, str]], where: str) -> RigidPort:
        """The rigid port of the first surface's part over what it shares with those that lie on it.

        pairs: ("part.surface", the other's). Raises DescriptionError where they share nothing.
        """
        body, offset, part, _ = self._surface(pairs[0][0])
        parts = {split_surface(s)[0]: self._surface(s)[2] for pair in pairs for s in pair}
        inner, _ = common_points(body_mesh(where, tuple(parts.values())), pairs, where)
        own = [at for of, at in inner if of.name == part.name]
        joined = SurfacePoints(*(np.concatenate([getattr(at, f.name) for at in own]) for f in fields(SurfacePoints)))
        return self._rigid(body, offset, where, patch_of(part, joined))

    def rail(self, surface: str, direction: np.ndarray, n: int) -> RailPort:
        """The segments of a rail surface, `n` equal lengths along the unit vector `direction`."""
        key = ("rail", surface, tuple(direction), n)
        if key not in self._known:
            body, offset, part, facets = self._surface(surface)
            pieces = segments(part, facets, direction, n)
            firsts = [self._add_mean(body, offset, f"{surface}[{i}]", s) for i, s in enumerate(pieces)]
            centroids = np.array([s.centroid for s in pieces])
            self._known[key] = RailPort(body, firsts[0], centroids, centroids @ direction)
        port = self._known[key]
        assert isinstance(port, RailPort)
        return port

    def axial(self, surface: str, direction: np.ndarray, at: float, piece: Patch) -> AxialPort:
        """The point at coordinate `at` [m] along the unit vector `direction`, of the slice `piece` of a surface.

        Exact where the displacement is linear in the slice: what moves rigidly or grows evenly is read to the last
        digit, wherever in the slice the point lies.
        """
        key = ("axial", surface, tuple(direction), at)
        if key not in self._known:
            body, offset, _, _ = self._surface(surface)
            lever = at - float(piece.centroid @ direction)
            weights = piece.mean + lever * fitted_slope(piece, direction)
            dofs = (3 * (piece.nodes + offset)[:, None] + np.arange(3)).ravel()
            first = len(self.names[body])
            self.names[body].append(f"{surface}@{at:g}.along")
            self._rows[body].append((dofs, np.outer(weights, direction).ravel()))
            self._known[key] = AxialPort(body, first, piece.centroid + lever * direction)
        port = self._known[key]
        assert isinstance(port, AxialPort)
        return port

    def fitted(self, name: str, body: int, nodes: np.ndarray, values: np.ndarray) -> FittedPort:
        """Functions fitted to the displacements of a body: values (k, m) at its nodes (m,), one row per function."""
        first = len(self.names[body])
        for k, row in enumerate(values):
            for a in range(3):
                self.names[body].append(f"{name}[{k}].{COMPONENTS[a]}")
                self._rows[body].append((3 * nodes + a, row))
        return FittedPort(body, first)

    def slices(self, surface: str, direction: np.ndarray, n: int) -> tuple[int, int, list[Patch]]:
        """Body, first node of the part within it, and `n` equal lengths of a surface along the unit vector."""
        body, offset, part, facets = self._surface(surface)
        return body, offset, segments(part, facets, direction, n)

    def surface_mean(self, surface: str) -> tuple[int, np.ndarray, np.ndarray]:
        """Body of a "part.surface", its nodes (m,) there and the weights (m,) of their mean over it; adds no port."""
        body, offset, whole = self._patch(surface)
        return body, whole.nodes + offset, whole.mean

    def extent(self, surface: str, direction: np.ndarray, n: int) -> np.ndarray:
        """Borders (n + 1,) [m] of the slices along the unit vector, in mesh coordinates."""
        _, _, part, facets = self._surface(surface)
        s = part.nodes[facet_nodes(part, facets)[:, :3]] @ direction
        return np.linspace(s.min(), s.max(), n + 1)

    def matrices(self) -> tuple[csr_array, ...]:
        """Per body U (3n, n_ports): port displacements are U^T u, port forces load the body with U f."""
        result = []
        for body, rows in zip(self.bodies, self._rows, strict=True):
            dofs = np.concatenate([d for d, _ in rows]) if rows else np.zeros(0, dtype=int)
            values = np.concatenate([v for _, v in rows]) if rows else np.zeros(0)
            port = np.repeat(np.arange(len(rows)), [len(d) for d, _ in rows])
            result.append(coo_array((values, (dofs, port)), shape=(3 * body.n, len(rows))).tocsr())
        return tuple(result)

    def _surface(self, surface: str) -> tuple[int, int, PartMesh, np.ndarray]:
        """Body, first node of the part within it, part and facets of a "part.surface"."""
        name, face = split_surface(surface)
        for i, body in enumerate(self.bodies):
            if any(part.name == name for part in body.parts):
                part, offset = body.part(name)
                return i, offset, part, part.facets(face)
        known = ", ".join(part.name for body in self.bodies for part in body.parts)
        raise DescriptionError(f"unknown part in '{surface}'", "machine.toml", f"parts are: {known}")

    def _patch(self, surface: str) -> tuple[int, int, Patch]:
        body, offset, part, facets = self._surface(surface)
        return body, offset, patch(part, facets)

    def _rigid(self, body: int, offset: int, label: str, whole: Patch) -> RigidPort:
        first = self._add_mean(body, offset, label, whole)
        self._add_rotation(body, offset, label, whole)
        return RigidPort(body, first, whole.centroid, whole.normal)

    def _add_mean(self, body: int, offset: int, label: str, p: Patch) -> int:
        first = len(self.names[body])
        for a in range(3):
            self.names[body].append(f"{label}.{COMPONENTS[a]}")
            self._rows[body].append((3 * (p.nodes + offset) + a, p.mean))
        return first

    def _add_rotation(self, body: int, offset: int, label: str, p: Patch) -> None:
        # normal equations of min int |u - mean - w x r|^2 dA:  (tr(S) 1 - S) w = (1/A) int r x u dA
        inertia = np.trace(p.second_moment) * np.eye(3) - p.second_moment
        r_cross = np.zeros((3, 3, len(p.nodes)))  # [component of r x u, component of u, node]
        for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            r_cross[a, c], r_cross[a, b] = p.moment[b], -p.moment[c]
        fit = np.einsum("ij,jan->ina", np.linalg.inv(inertia), r_cross)
        dofs = (3 * (p.nodes + offset)[:, None] + np.arange(3)).ravel()
        for i in range(3):
            self.names[body].append(f"{label}.{COMPONENTS[3 + i]}")
            self._rows[body].append((dofs, fit[i].ravel()))


def fitted_slope(p: Patch, direction: np.ndarray) -> np.ndarray:
    """Row (m,) [1/m] at `p.nodes`: slope along the unit vector `direction` of the least-squares linear field.

    The direction must lie in the patch; slopes across it are distinguished from it.
    """
    towards = np.linalg.pinv(p.second_moment, rcond=1e-9, hermitian=True) @ direction
    return towards @ p.moment


def rigid_modes(points: np.ndarray) -> np.ndarray:
    """(3n, 6) rigid motions of points (n, 3): translations and rotations about the origin, u = t + w x x."""
    modes = np.zeros((len(points), 3, 6))
    modes[:, :, :3] = np.eye(3)
    for i, axis in enumerate(np.eye(3)):
        modes[:, :, 3 + i] = np.cross(axis, points)
    return modes.reshape(-1, 6)

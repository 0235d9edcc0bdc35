"""The shape of a warm machine for a picture: its surface displaced, by what an artefact knows.

Mostly that is all (`twin.rom.surface_motion`). Where it is not, as in artefacts of older versions and with calibrated
expansions, an artefact knows the displacements at the elastic ports of every body exactly (guides, pads, supports,
tool, work). Between them a body then is drawn as it would expand freely in the linear temperature field nearest to its
own, which is without stress:

    u(r) = alpha (T0 r + (g.r) r - g |r|^2 / 2),    T = T0 + g.r

moved rigidly onto the ports; what still differs there is spread to their neighbourhood by a Gaussian process. alpha is
the body's own: what moves its ports when all of it is 1 K warmer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from twin.rom.artefact import Artefact, SurfaceField
from twin.rom.elastic_structure import ElasticStructure
from twin.rom.springs import SpringSystem
from twin.rom.surface_motion import is_known, surface_displacements
from twin.rom.tcp import by_body, inputs, is_exact

REACH = 0.25  # of a piece's size: how far a port's own displacement reaches
AXIAL = 0.99  # cosine between a spring and the axis from which on it holds along that alone
NUGGET = 1e-4  # of its variance: ports may nearly coincide


@dataclass(frozen=True)
class Piece:
    """How the k ports and the temperatures of m nodes of a body's surface move these: a screw, or all but screws."""

    nodes: np.ndarray  # (m,) of the body's surface
    ports: np.ndarray  # (k,) column of each port's displacement along x among the ports of the machine; y, z follow
    free_nodes: np.ndarray  # (m, 3, 4) m/K, m^2/K: free expansion by T0 and g
    free_ports: np.ndarray  # (k, 3, 4)
    spread: np.ndarray  # (m, 3, k, 3) nodes by what ports differ from free expansion: rigid motion and the rest
    linear: np.ndarray  # (4, m) T0 and g by the temperatures of the nodes

    def __call__(self, rise: np.ndarray, ports: np.ndarray) -> np.ndarray:
        """Displacements (m, 3) [m]; rise (m,) K above the reference, ports (P,) of the machine."""
        field = self.linear @ rise
        residual = ports[self.ports[:, None] + np.arange(3)] - self.free_ports @ field
        return np.asarray(self.free_nodes @ field + np.tensordot(self.spread, residual, 2))


@dataclass(frozen=True)
class BodyShape:
    """The surface of one body, piece by piece."""

    pieces: tuple[Piece, ...]

    def __call__(self, rise: np.ndarray, ports: np.ndarray) -> np.ndarray:
        """Displacements (m, 3) [m]; rise (m,) K above the reference, ports (P,) of the machine."""
        moved = np.zeros((len(rise), 3))
        for piece in self.pieces:
            moved[piece.nodes] = piece(rise[piece.nodes], ports)
        return moved


@dataclass(frozen=True)
class Shape:
    """All bodies that have a surface."""

    artefact: Artefact
    structure: ElasticStructure
    bodies: tuple[BodyShape, ...]  # as `artefact.fields`

    def __call__(self, states: np.ndarray, positions: np.ndarray) -> tuple[np.ndarray, ...]:
        """Displacements (n, m, 3) [m] per field at n states (n, N) and positions (n, n_axes) [m] of the linear axes."""
        model = self.artefact.model
        if is_known(model, self.artefact.fields):
            each = [
                surface_displacements(model, self.artefact.fields, s, p) for s, p in zip(states, positions, strict=True)
            ]
            return tuple(np.array(field) for field in zip(*each, strict=True))
        x = by_body(model, states)
        heat = np.hstack(
            [x[b] @ inputs(model, b)[: len(body.R)].T for b, body in enumerate(self.structure.bodies)]
        )  # what scales read follows the ports
        ports = np.array([self.structure.port_displacements(p, h) for p, h in zip(positions, heat, strict=True)])
        numbers = [[b.name for b in model.bodies].index(f.body) for f in self.artefact.fields]
        return tuple(
            np.array([shape(field.basis @ s, w) for s, w in zip(x[b], ports, strict=True)])
            for b, field, shape in zip(numbers, self.artefact.fields, self.bodies, strict=True)
        )


def shape_of(artefact: Artefact) -> Shape | None:
    """None of machines without surface or elastic structure."""
    model = artefact.model
    structure = model.structure
    if not artefact.fields or not isinstance(structure, ElasticStructure) or not is_exact(model):
        return None
    return Shape(artefact, structure, tuple(_body(artefact, structure.system, field) for field in artefact.fields))


def _body(artefact: Artefact, system: SpringSystem, field: SurfaceField) -> BodyShape:
    """Screws apart: they are hot, held at their ends alone, and say nothing of the casting that they hang in."""
    model = artefact.model
    b = [body.name for body in model.bodies].index(field.body)
    columns, points, screw = _ports(system, b)
    on_screw = screw >= 0
    uniform = inputs(model, b)[columns[:, None] + np.arange(3)] @ model.bodies[b].one
    alpha = _expansion(points[~on_screw], uniform[~on_screw]) if (~on_screw).sum() > 1 else _expansion(points, uniform)
    part = _parts(field.triangles, len(field.nodes))
    middles = np.array([_middle(field.nodes[part == k]) for k in range(part.max() + 1)])
    piece, port_piece = np.full(len(part), -1), np.full(len(points), -1)
    for k in np.unique(screw[on_screw]):  # the part in the middle of which its segments are
        own = int(np.linalg.norm(middles - _middle(points[screw == k]), axis=1).argmin())
        piece[part == own], port_piece[screw == k] = own, own
    area = _areas(field)
    columns = columns + int(system.offsets[b])
    return BodyShape(tuple(
        _piece(field, np.flatnonzero(piece == k), columns[port_piece == k], points[port_piece == k], alpha, area)
        for k in np.unique(piece)
    ))  # fmt: skip


def _ports(system: SpringSystem, body: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Ports of known place of a body: first column (k,) within it, place (k, 3) m in mesh coordinates, and first column
    of the screw that it is on (k,), else -1. A screw holds along its axis alone."""
    found: dict[int, np.ndarray] = {}
    screws: dict[int, int] = {}
    for guide in system.guides:
        if guide.rail.body == body:
            alone = bool(np.all(np.abs(guide.directions @ guide.along) > AXIAL))
            for i, place in enumerate(guide.rail.centroids):
                found[guide.rail.first + 3 * i] = place
                screws[guide.rail.first + 3 * i] = guide.rail.first if alone else -1
        if guide.pad.body == body:
            found[guide.pad.first] = guide.pad.centroid
    for ground in system.grounds:
        if ground.port.body == body:
            found[ground.port.first] = ground.port.centroid
    for port in (system.tool, system.work):
        if port.body == body:
            found[port.first] = port.centroid
    columns = np.array(sorted(found), dtype=int)
    points = np.array([found[c] for c in columns]).reshape(-1, 3)
    return columns, points, np.array([screws.get(c, -1) for c in columns], dtype=int)


def _parts(triangles: np.ndarray, n: int) -> np.ndarray:
    """Number (n,) of the part of each node: parts share none."""
    links = coo_array(
        (np.ones(2 * len(triangles)), (triangles[:, [0, 1]].ravel(), triangles[:, [1, 2]].ravel())), (n, n)
    )
    found: np.ndarray = connected_components(links, directed=False)[1]
    return found


def _middle(points: np.ndarray) -> np.ndarray:
    """(3,) of the box around points."""
    return np.asarray(0.5 * (points.min(axis=0) + points.max(axis=0)))


def _areas(field: SurfaceField) -> np.ndarray:
    """(m,) m^2 of every node: a third of its triangles'."""
    a, b, c = (field.nodes[field.triangles[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 6.0
    return np.bincount(field.triangles.ravel(), np.repeat(area, 3), minlength=len(field.nodes))


def _expansion(points: np.ndarray, moved: np.ndarray) -> float:
    """alpha [1/K] that explains displacements (k, 3) per kelvin of all of a body best, beside a rigid motion."""
    r = points - points.mean(axis=0)
    columns = np.hstack([r.reshape(-1, 1), _rigid(r).reshape(-1, 6)])
    return float(np.linalg.lstsq(columns, moved.reshape(-1), rcond=1e-9)[0][0])


def _piece(
    field: SurfaceField, rows: np.ndarray, columns: np.ndarray, points: np.ndarray, alpha: float, area: np.ndarray
) -> Piece:
    middle = np.average(field.nodes[rows], axis=0, weights=area[rows])
    nodes, ports, k = field.nodes[rows] - middle, points - middle, len(points)
    size = float(np.ptp(nodes, axis=0).max())
    K = _covariance(ports, ports, REACH * size) + NUGGET * np.eye(k)
    weights = np.linalg.solve(K, _covariance(ports, nodes, REACH * size)).T  # (m, k)
    rigid = _rigid(ports).reshape(-1, 6)
    fit = np.linalg.pinv(rigid, rcond=1e-6) if k else np.zeros((6, 0))  # (6, 3k)
    spread = (_rigid(nodes) @ fit).reshape(len(nodes), 3, k, 3)
    rest = (np.eye(3 * k) - rigid @ fit).reshape(k, 3, k, 3)
    spread = spread + np.tensordot(weights, rest, 1)
    root = np.sqrt(area[rows])[:, None]
    linear = np.linalg.pinv(root * np.column_stack([np.ones(len(nodes)), nodes])) * root.T
    return Piece(rows, columns, alpha * _free(nodes), alpha * _free(ports), spread, linear)


def _free(r: np.ndarray) -> np.ndarray:
    """(m, 3, 4): displacements at r (m, 3) by T0 and g, per unit of alpha."""
    gradient = np.einsum("mi,mj->mij", r, r) - 0.5 * np.einsum("mk,mk->m", r, r)[:, None, None] * np.eye(3)
    return np.concatenate([r[:, :, None], gradient], axis=2)


def _rigid(r: np.ndarray) -> np.ndarray:
    """(m, 3, 6): displacements at r (m, 3) by translations and rotations."""
    found = np.zeros((len(r), 3, 6))
    found[:, :, :3] = np.eye(3)
    x, y, z = r.T
    found[:, 1, 3], found[:, 2, 3] = -z, y
    found[:, 0, 4], found[:, 2, 4] = z, -x
    found[:, 0, 5], found[:, 1, 5] = -y, x
    return found


def _covariance(a: np.ndarray, b: np.ndarray, reach: float) -> np.ndarray:
    """(len(a), len(b)) Matern 5/2: smooth at the ports."""
    d: np.ndarray = np.linalg.norm(a[:, None] - b[None], axis=2) * (np.sqrt(5.0) / reach)
    return np.asarray((1.0 + d + d**2 / 3.0) * np.exp(-d))


def axis_positions(structure: ElasticStructure, axes: Sequence[str], position: np.ndarray) -> np.ndarray:
    """Positions (n, n_linear) of logged axes (n, n_axes), in the order of the structure's; else zero."""
    found = np.zeros((len(position), len(structure.axes)))
    for k, axis in enumerate(structure.axes):
        if axis in axes:
            found[:, k] = position[:, list(axes).index(axis)]
    return found

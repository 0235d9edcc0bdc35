"""The shape of a warm machine for a picture: its surface displaced, by what an artefact knows.

An artefact knows the displacements at the elastic ports of every body exactly (guides, pads, supports, tool, work), not
those of its surface. Between them a body is drawn as it would expand freely in the linear temperature field nearest to
its own, which is without stress:

    u(r) = alpha (T0 r + (g.r) r - g |r|^2 / 2),    T = T0 + g.r

moved rigidly onto the ports; what still differs there is spread to their neighbourhood by a Gaussian process. alpha is
the body's own: what moves its ports when all of it is 1 K warmer. Storing the displacements of the surface in the
artefact was rejected: three times the memory of everything else for a picture.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.rom.artefact import Artefact, SurfaceField
from twin.rom.elastic_structure import ElasticStructure
from twin.rom.springs import SpringSystem
from twin.rom.tcp import by_body, inputs, is_exact

REACH = 0.25  # of a body's size: how far a port's own displacement reaches
NUGGET = 1e-6  # of its variance: ports may nearly coincide


@dataclass(frozen=True)
class BodyShape:
    """How the k ports of one body and its temperatures move the m nodes of its surface."""

    ports: np.ndarray  # (k,) column of each port's displacement along x among the ports of the machine; y, z follow
    free_nodes: np.ndarray  # (m, 3, 4) m/K, m^2/K: free expansion by T0 and g
    free_ports: np.ndarray  # (k, 3, 4)
    spread: np.ndarray  # (m, k, 3, 3) nodes by what ports differ from free expansion: rigid motion and the rest
    linear: np.ndarray  # (4, m) T0 and g by the temperatures of the nodes

    def __call__(self, rise: np.ndarray, ports: np.ndarray) -> np.ndarray:
        """Displacements (m, 3) [m]; rise (m,) K above the reference, ports (P,) of the machine."""
        field = self.linear @ rise
        moved = ports[self.ports[:, None] + np.arange(3)]
        residual = moved - self.free_ports @ field
        return np.asarray(self.free_nodes @ field + np.einsum("mkij,kj->mi", self.spread, residual))


@dataclass(frozen=True)
class Shape:
    """All bodies that have a surface."""

    artefact: Artefact
    structure: ElasticStructure
    bodies: tuple[BodyShape, ...]  # as `artefact.fields`

    def __call__(self, states: np.ndarray, positions: np.ndarray) -> tuple[np.ndarray, ...]:
        """Displacements (n, m, 3) [m] per field at n states (n, N) and positions (n, n_axes) [m] of the linear axes."""
        model = self.artefact.model
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
    shapes = []
    for field in artefact.fields:
        b = [body.name for body in model.bodies].index(field.body)
        columns, points = _ports(structure.system, b)
        offset = int(structure.system.offsets[b])
        uniform = inputs(model, b)[columns[:, None] + np.arange(3)] @ model.bodies[b].one
        shapes.append(_body(field, columns + offset, points, _expansion(points, uniform)))
    return Shape(artefact, structure, tuple(shapes))


def _ports(system: SpringSystem, body: int) -> tuple[np.ndarray, np.ndarray]:
    """First columns (k,) within the body, and places (k, 3) m in mesh coordinates, of its ports of known place."""
    found: dict[int, np.ndarray] = {}
    for guide in system.guides:
        if guide.rail.body == body:
            for i, place in enumerate(guide.rail.centroids):
                found[guide.rail.first + 3 * i] = place
        if guide.pad.body == body:
            found[guide.pad.first] = guide.pad.centroid
    for ground in system.grounds:
        if ground.port.body == body:
            found[ground.port.first] = ground.port.centroid
    for port in (system.tool, system.work):
        if port.body == body:
            found[port.first] = port.centroid
    columns = np.array(sorted(found), dtype=int)
    return columns, np.array([found[c] for c in columns]).reshape(-1, 3)


def _expansion(points: np.ndarray, moved: np.ndarray) -> float:
    """alpha [1/K] that explains displacements (k, 3) per kelvin of all of a body best, beside a rigid motion."""
    r = points - points.mean(axis=0)
    columns = np.hstack([r.reshape(-1, 1), _rigid(r).reshape(-1, 6)])
    return float(np.linalg.lstsq(columns, moved.reshape(-1), rcond=1e-9)[0][0])


def _body(field: SurfaceField, columns: np.ndarray, points: np.ndarray, alpha: float) -> BodyShape:
    middle = field.nodes.mean(axis=0)
    nodes, ports = field.nodes - middle, points - middle
    size = float(np.ptp(field.nodes, axis=0).max())
    K = _covariance(ports, ports, REACH * size) + NUGGET * np.eye(len(ports))
    weights = np.linalg.solve(K, _covariance(ports, nodes, REACH * size)).T  # (m, k)
    rigid, k = _rigid(ports).reshape(-1, 6), len(ports)
    fit = np.linalg.pinv(rigid, rcond=1e-6)  # (6, 3k)
    spread = (_rigid(nodes) @ fit).reshape(len(nodes), 3, k, 3).transpose(0, 2, 1, 3)
    rest = (np.eye(3 * k) - rigid @ fit).reshape(k, 3, k, 3)
    spread = spread + np.einsum("mk,kilj->mlij", weights, rest)
    return BodyShape(
        columns, alpha * _free(nodes), alpha * _free(ports), spread,
        np.linalg.pinv(np.column_stack([np.ones(len(nodes)), nodes])),
    )  # fmt: skip


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

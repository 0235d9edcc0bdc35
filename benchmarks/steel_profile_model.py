"""A parametric steel profile: half the cross-section of a rail, seven films with outer temperatures of their own.

After Benner and Saak, "Linear-quadratic regulator design for optimal cooling of steel profiles" (2005) and the
Oberwolfach/MORwiki benchmark "Steel Profile": heat conduction in two dimensions, symmetric about the left edge, the
rest of the boundary in seven segments; inputs are the outer temperatures of the segments, outputs differences of
temperatures between points. Its matrices are not copied: this is the section of a 60E1 rail (EN 13674-1, its fillets
left out, its outline approximate) on a mesh of as many nodes: 109, refined to 371, 1,357 and 5,177.
"""

from __future__ import annotations

import numpy as np
import skfem
from scipy.spatial import Delaunay, cKDTree
from skfem.helpers import dot, grad

from twin.rom.load_model import EnvironmentWiring, Film, LawUse, LoadModel, Signal
from twin.rom.model import AffineBody, MachineModel

# Corners [m] of the right half, counter-clockwise from the middle of the foot, and where each segment ends.
CORNERS = 1e-3 * np.array(
    [(0, 0), (75, 0), (75, 11.5), (26, 21), (8.25, 50), (8.25, 110), (12, 126), (35, 136), (36, 160), (26, 170),
     (0, 172)]
)  # fmt: skip
SEGMENTS = (("foot", 1), ("edge", 2), ("flange", 4), ("web", 5), ("chin", 7), ("side", 8), ("crown", 10))
BOUNDARY, INNER = 62, 47  # nodes of the coarsest mesh, as in the benchmark
DENSITY, HEAT, CONDUCTIVITY = 7850.0, 480.0, 26.4  # kg/m3, J/(kg K), W/(m K)
FILMS = (2.0, 40.0)  # W/(m2 K): still to moving air, as of the machine parts of docs/decisions/0002


def _boundary() -> tuple[np.ndarray, np.ndarray]:
    """BOUNDARY nodes (m, 2) about equally far apart, corners among them, and the edge of the polygon before each."""
    ends = np.roll(CORNERS, -1, axis=0)
    length = np.linalg.norm(ends - CORNERS, axis=1)
    count = np.maximum(np.round(BOUNDARY * length / length.sum()).astype(int), 1)
    while count.sum() != BOUNDARY:  # where a node more or less changes the spacing least
        step = int(np.sign(BOUNDARY - count.sum()))
        gain = np.where(
            count + step >= 1, np.abs(length / np.maximum(count + step, 1) - length.sum() / BOUNDARY), np.inf
        )
        count[gain.argmin()] += step
    points = [a + (b - a) * t for a, b, c in zip(CORNERS, ends, count, strict=True) for t in np.arange(c)[:, None] / c]
    return np.array(points), np.repeat(np.arange(len(CORNERS)), count)


def _inside(points: np.ndarray) -> np.ndarray:
    x, y = points.T
    within = np.zeros(len(points), dtype=bool)
    for (x0, y0), (x1, y1) in zip(CORNERS, np.roll(CORNERS, -1, axis=0), strict=True):
        crosses = (y0 > y) != (y1 > y)
        if y0 != y1:
            within ^= crosses & (x < x0 + (y - y0) * (x1 - x0) / (y1 - y0))
    return within


def _triangles(points: np.ndarray) -> np.ndarray:
    t = Delaunay(points).simplices
    return t[_inside(points[t].mean(axis=1))]


def _areas(points: np.ndarray, t: np.ndarray) -> np.ndarray:
    (x0, y0), (x1, y1), (x2, y2) = points[t].transpose(1, 2, 0)
    return np.abs((x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)) / 2


def coarsest_mesh() -> skfem.MeshTri:
    """109 nodes, 154 triangles: inner nodes farthest from all others, then at the centroids of what surrounds them."""
    edge = _boundary()[0]
    candidates = np.random.default_rng(0).uniform(0.0, CORNERS.max(axis=0), (20_000, 2))
    candidates = candidates[_inside(candidates)]
    points, near = edge, cKDTree(edge).query(candidates)[0]
    for _ in range(INNER):
        points = np.vstack([points, candidates[near.argmax()]])
        near = np.minimum(near, np.linalg.norm(candidates - points[-1], axis=1))
    for _ in range(200):
        t = _triangles(points)
        area = _areas(points, t)
        share = np.bincount(t.ravel(), np.repeat(area, 3), len(points))
        centre = np.repeat(area[:, None] * points[t].mean(axis=1), 3, axis=0)
        mean = np.stack([np.bincount(t.ravel(), c, len(points)) for c in centre.T], axis=1) / share[:, None]
        points = np.vstack([edge, mean[BOUNDARY:]])
    return skfem.MeshTri(points.T, _triangles(points).T)


# Outputs: weights of temperatures at points [mm]; the weights of each add up to zero.
OUTPUTS = (
    ((3, 0, 150), (-2, 0, 172), (-1, 36, 160)),
    ((2, 0, 10), (-1, 0, 0), (-1, 75, 0)),
    ((1, 0, 80), (-1, 8.25, 80)),
    ((1, 40, 10), (-1, 50, 16)),
    ((2, 20, 150), (-1, 35, 136), (-1, 12, 126)),
    ((3, 0, 30), (-1, 8.25, 50), (-1, 26, 21), (-1, 40, 0)),
)


def profile(refinements: int, films: tuple[float, float] = FILMS) -> MachineModel:
    """The profile as a machine of one body; 2 refinements make 1,357 nodes, 3 make 5,177."""
    coarse = coarsest_mesh()
    mesh = coarse.refined(refinements)
    basis = skfem.Basis(mesh, skfem.ElementTriP1())
    E = skfem.BilinearForm(lambda u, v, w: DENSITY * HEAT * u * v).assemble(basis)
    A0 = skfem.BilinearForm(lambda u, v, w: CONDUCTIVITY * dot(grad(u), grad(v))).assemble(basis)
    facets = mesh.boundary_facets()
    middle = mesh.p[:, mesh.facets[:, facets]].mean(axis=1).T
    ends = np.roll(CORNERS, -1, axis=0)
    along = ends - CORNERS
    place = np.clip(np.einsum("fck,ck->fc", middle[:, None] - CORNERS, along) / (along**2).sum(axis=1), 0, 1)
    distance = np.linalg.norm(middle[:, None] - CORNERS - place[..., None] * along, axis=2)
    side = distance.argmin(axis=1)
    A, first = [], 0
    for _, last in SEGMENTS:
        own = facets[(side >= first) & (side < last)]
        on = skfem.FacetBasis(mesh, skfem.ElementTriP1(), facets=own)
        A.append(skfem.BilinearForm(lambda u, v, w: u * v).assemble(on).tocsr())
        first = last
    C = np.zeros((len(OUTPUTS), mesh.p.shape[1]))
    for row, terms in zip(C, OUTPUTS, strict=True):
        for weight, x, y in terms:  # nodes of the coarsest mesh are the first ones of every finer
            row[np.linalg.norm(coarse.p.T - (1e-3 * x, 1e-3 * y), axis=1).argmin()] += weight
    one = np.ones(mesh.p.shape[1])
    names = [name for name, _ in SEGMENTS]
    body = AffineBody(
        name="profile", E=E.tocsr(), A0=A0.tocsr(), A=tuple(A), theta=tuple(range(len(A))),
        M=np.column_stack([a @ one for a in A]), B=np.zeros((len(one), 0)), sources=(),
        P=np.zeros((len(one), 0)), ports=(), C=C, sensors=tuple(range(len(C))), G=np.zeros((1, 3, len(one))),
        one=one, energy=E @ one,
    )  # fmt: skip
    load = LoadModel(
        signals=tuple(Signal(f"{n}_temperature", f"{n}_temperature", "degC", "value", 10.0, 40.0) for n in names),
        axes=(), environments=tuple(EnvironmentWiring(n, f"{n}_temperature", 20.0) for n in names), sources=(),
        films=tuple(
            Film(n, LawUse("constant_film", {"natural": films[0]}, {}), i, *films) for i, n in enumerate(names)
        ),
        joints=(), ports=(), rails=(), pairs=(),
    )  # fmt: skip
    sensors = tuple(f"difference_{i}" for i in range(len(C)))
    return MachineModel("steel profile", (body,), load, 20.0, sensors, (), (), (), np.zeros((1, 0)))

"""A part on a finer mesh: every tetrahedron into eight, named surfaces inherited, curved faces as curved as before.

Four of the eight are at the corners, four share a diagonal of the octahedron that is left between them; the shortest of
the three diagonals keeps them well shaped (Bey, Computing 55, 1995; Zhang, Houston J. Math. 21, 1995). New points lie
where the quadratic map of the old tetrahedron puts them, so that the solid is the same one, neither its volume nor a
surface changes, and no mesher is needed. How well a mesh follows the drawing is therefore not among what it shows.
"""

from __future__ import annotations

import numpy as np
from skfem import MeshTet2

from twin.build.mesh import PartMesh, match_surfaces, part_mesh, skfem_mesh
from twin.build.mesh_file import TetraFile
from twin.build.surface import facet_nodes

# Local nodes in VTK order: corners 0 1 2 3, then the middles of 01 12 02 03 13 23.
_CORNERS = np.array([(0, 4, 6, 7), (4, 1, 5, 8), (6, 5, 2, 9), (7, 8, 9, 3)])
# Diagonals of the octahedron, and per diagonal the ring of the other four nodes about it.
_DIAGONALS = np.array([(4, 9), (5, 7), (6, 8)])
_RINGS = np.array([(5, 6, 7, 8), (4, 6, 9, 8), (4, 5, 9, 7)])
_EDGES = np.array([(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)])
_TRIANGLES = np.array([(0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)])  # of a facet's six nodes: 0 1 2, 01 12 20
_BARYCENTRIC = np.vstack([np.eye(4), (np.eye(4)[_EDGES[:, 0]] + np.eye(4)[_EDGES[:, 1]]) / 2])  # of the ten nodes


def refined(part: PartMesh) -> PartMesh:
    """The part with every tetrahedron divided into eight; its nodes are the first vertices of the finer mesh."""
    children = _children(part)
    tetra = part.elements[np.arange(len(children))[:, None, None], children].reshape(-1, 4)
    points = part.nodes
    if isinstance(part.mesh, MeshTet2):
        middles, numbers = _middles(part, children, tetra)
        points, tetra = np.vstack([points, middles]), np.hstack([tetra, len(points) + numbers])
    surfaces = {name: facet_nodes(part, facets)[:, _TRIANGLES].reshape(-1, 3) for name, facets in part.surfaces.items()}
    file = TetraFile(points, tetra, surfaces)
    mesh = skfem_mesh(file)
    return part_mesh(part.name, mesh, match_surfaces(mesh, file, part.name))


def refined_size(part: PartMesh) -> int:
    """Nodes of the refined part, without making it: one per old node and per new edge."""
    mesh = part.mesh
    return int(part.n + 2 * mesh.nedges + 3 * mesh.nfacets + mesh.nelements)


def _children(part: PartMesh) -> np.ndarray:
    """Local nodes of the eight tetrahedra of every element (m, 8, 4)."""
    at = part.nodes[part.elements]  # (m, 10, 3)
    lengths = np.linalg.norm(at[:, _DIAGONALS[:, 0]] - at[:, _DIAGONALS[:, 1]], axis=2)
    # rounding must not decide between diagonals of equal length
    shortest = (lengths <= lengths.min(axis=1, keepdims=True) * (1.0 + 1e-9)).argmax(axis=1)
    beside = np.stack([_RINGS, np.roll(_RINGS, -1, axis=1)], axis=2)  # (3, 4, 2): neighbours in the ring
    inner = np.concatenate([np.broadcast_to(_DIAGONALS[:, None], (3, 4, 2)), beside], axis=2)
    return np.concatenate([np.broadcast_to(_CORNERS, (len(at), 4, 4)), inner[shortest]], axis=1)


def _middles(part: PartMesh, children: np.ndarray, tetra: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Middles of the finer mesh's edges (k, 3) [m] by the quadratic map, and their numbers per tetrahedron (8m, 6).

    tetra (8m, 4): its corners, by their numbers in the part.
    """
    ends = np.sort(tetra[:, _EDGES], axis=2).reshape(-1, 2)
    _, first, numbers = np.unique(ends, axis=0, return_index=True, return_inverse=True)
    corner = _BARYCENTRIC[children]  # (m, 8, 4 corners, 4)
    barycentric = (corner[:, :, _EDGES[:, 0]] + corner[:, :, _EDGES[:, 1]]) / 2  # (m, 8, 6, 4)
    at = barycentric.reshape(-1, 4)[first]
    element = first // (8 * 6)
    shape = np.hstack([at * (2 * at - 1), 4 * at[:, _EDGES[:, 0]] * at[:, _EDGES[:, 1]]])
    middles = np.einsum("ki,kix->kx", shape, part.nodes[part.elements[element]])
    return middles, numbers.reshape(-1, 6)

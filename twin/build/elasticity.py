"""Thermo-elastic matrices of solids and bodies: K_u u = K_uT (T - T_ref).

Isotropic linear elasticity with eigenstrain alpha (T - T_ref) on quadratic tetrahedra (Hughes, The Finite Element
Method, 2000, section 2.7; Boley and Weiner, Theory of Thermal Stresses, 1960, section 1.12):

    sigma = lambda tr(eps) 1 + 2 mu eps - beta (T - T_ref) 1,    beta = (3 lambda + 2 mu) alpha

Unknowns: dof 3 * node + component, nodes being the scalar quadratic unknowns (scikit-fem numbers a vector element just
so). For rigid motions R: K_u R = 0 and R^T K_uT = 0, so heat alone never pushes a body.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.sparse import block_diag, coo_array, csr_array, eye_array, kron
from skfem import Basis, ElementTetP2, Mesh
from skfem.assembly.dofs import Dofs

from twin.build.interface import interface
from twin.build.mesh import BodyMesh
from twin.build.surface import patch
from twin.errors import DescriptionError
from twin.machine.bodies import split_surface
from twin.machine.description import Machine, Material

CHUNK = 8192  # elements assembled at once: about 250 MB of triplets, however large the mesh
GLUE = 100.0  # stiffness of a fixed joint per area, in units of E/h: it yields like 1 % of an element
MAX_GAP = 1e-3  # of a fixed joint, in facet sizes: glue across a gap resists rotation of the whole body


@dataclass(frozen=True)
class Elasticity:
    """An unsupported solid or body with n nodes."""

    K: csr_array  # (3n, 3n) N/m, symmetric positive semidefinite; its null space is rigid motion
    KT: csr_array  # (3n, n) N/K


def lame(material: Material) -> tuple[float, float, float]:
    """lambda [Pa], mu [Pa] and beta = (3 lambda + 2 mu) alpha [Pa/K]."""
    E, nu = material.youngs_modulus, material.poisson_ratio
    lam = E * nu / ((1 + nu) * (1 - 2 * nu))
    mu = E / (2 * (1 + nu))
    return lam, mu, (3 * lam + 2 * mu) * material.expansion


def solid_elasticity(mesh: Mesh, material: Material) -> Elasticity:
    """The matrices of one solid: a MeshTet1 (straight-sided) or MeshTet2 (curved) with quadratic shape functions.

    Chunks of elements bound the memory beside the result (one whole-mesh assembly takes several times as much).
    """
    lam, mu, beta = lame(material)
    n = mesh.nvertices + mesh.nedges
    K, KT = csr_array((3 * n, 3 * n)), csr_array((3 * n, n))
    for nodes, dx, N, dN in _chunks(mesh):
        dofs = (3 * nodes[:, :, None] + np.arange(3)).reshape(len(nodes), -1)  # (e, 30)
        K = K + _scatter(_stiffness(dx, dN, lam, mu), dofs, dofs, (3 * n, 3 * n))
        KT = KT + _scatter(beta * (_weighted(dx, dN) @ N.T), dofs, nodes, (3 * n, n))
    return Elasticity(K, KT)


def body_elasticity(machine: Machine, body: BodyMesh) -> Elasticity:
    """The matrices of a body: its solids, glued at their fixed joints by penalty (meshes need not match).

    Gaps pass no force: `twin.machine.references` sees that other joints hold the body together.
    Raises DescriptionError where two joined surfaces do not touch or lie apart.
    """
    solids = [solid_elasticity(p.mesh, machine.materials[machine.parts[p.name].material]) for p in body.parts]
    K = csr_array(block_diag([s.K for s in solids], format="csr"))
    KT = csr_array(block_diag([s.KT for s in solids], format="csr"))
    names = {p.name for p in body.parts}
    for name, contact in machine.contacts.items():
        if contact.glues and contact.surfaces is not None and split_surface(contact.surfaces[0])[0] in names:
            K = K + _glue(machine, body, contact.surfaces, f"contacts.{name}")
    return Elasticity(K, KT)


def _glue(machine: Machine, body: BodyMesh, surfaces: tuple[str, str], where: str) -> csr_array:
    """(3n, 3n) N/m: penalty on the jump of the displacement across a joint."""
    joint = interface(body, *surfaces, where)
    sizes, moduli = [], []
    for surface in surfaces:
        part, _ = body.part(split_surface(surface)[0])
        facets = part.facets(split_surface(surface)[1])
        sizes.append(np.sqrt(patch(part, facets).area / len(facets)))
        moduli.append(machine.materials[machine.parts[part.name].material].youngs_modulus)
    # the jump of the coordinates themselves is the gap
    x = body.nodes - body.nodes.mean(axis=0)
    gap = float(np.sqrt(max(np.einsum("na,na->", x, joint.matrix @ x), 0.0) / joint.area))
    if gap > MAX_GAP * min(sizes):
        raise DescriptionError(
            f"'{surfaces[0]}' and '{surfaces[1]}' lie {gap:.3g} m apart",
            where,
            "faces of a fixed contact must coincide; correct the positions, or mesh curved faces alike on both sides",
        )
    return csr_array(kron(joint.matrix * (GLUE * max(moduli) / min(sizes)), eye_array(3), format="csr"))


def stress(mesh: Mesh, material: Material, u: np.ndarray, T: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Stress at the four corners of every element, to be averaged or compared by the caller.

    u: (3n,) m; T: (n,) K above T_ref. Returns sigma (n_elements, 4, 3, 3) Pa and the vertices (n_elements, 4).
    """
    lam, mu, beta = lame(material)
    corners = np.array([[0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], dtype=float)
    basis = Basis(mesh, ElementTetP2(), quadrature=(corners, np.full(4, 1 / 24)), disable_doflocs=True)
    nodes = basis.element_dofs.T
    N = np.array([np.broadcast_to(np.asarray(f[0]), basis.dx.shape)[0] for f in basis.basis])  # (10, 4)
    dN = np.array([f[0].grad for f in basis.basis])  # (10, 3, e, 4)
    gradient = np.einsum("eia,ipec->ecap", u.reshape(-1, 3)[nodes], dN)
    strain = (gradient + gradient.swapaxes(-1, -2)) / 2
    spherical = lam * np.trace(strain, axis1=-2, axis2=-1) - beta * (T[nodes] @ N)
    return 2 * mu * strain + spherical[..., None, None] * np.eye(3), mesh.t[:4].T


def _chunks(mesh: Mesh) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]]:
    """Per chunk: nodes (e, 10), volumes dx (e, q), shapes N (10, q), gradients dN (10, 3, e, q)."""
    element = ElementTetP2()
    numbering = Dofs(mesh, element)
    for first in range(0, mesh.nelements, CHUNK):
        chunk = np.arange(first, min(first + CHUNK, mesh.nelements))
        # degree 4: exact on straight-sided elements, whose products have degree 2 (K) and 2 (KT)
        basis = Basis(mesh, element, intorder=4, elements=chunk, dofs=numbering, disable_doflocs=True)
        N = np.array([np.broadcast_to(np.asarray(f[0]), basis.dx.shape)[0] for f in basis.basis])
        dN = np.array([f[0].grad for f in basis.basis])
        yield basis.element_dofs.T, basis.dx, N, dN


def _weighted(dx: np.ndarray, dN: np.ndarray) -> np.ndarray:
    """dN dx as one row per (shape, direction) of each element: (e, 30, q)."""
    return (dN * dx).transpose(2, 0, 1, 3).reshape(len(dx), -1, dx.shape[1])


def _stiffness(dx: np.ndarray, dN: np.ndarray, lam: float, mu: float) -> np.ndarray:
    """int (lam dN_i/dx_a dN_j/dx_b + mu dN_i/dx_b dN_j/dx_a + mu delta_ab dN_i . dN_j), (e, 30, 30)."""
    e, q = dx.shape
    plain = dN.transpose(2, 0, 1, 3).reshape(e, -1, q)
    G = (_weighted(dx, dN) @ plain.swapaxes(1, 2)).reshape(e, 10, 3, 10, 3)
    k = lam * G + mu * G.swapaxes(2, 4)
    laplace = mu * np.einsum("eipjp->eij", G)
    for a in range(3):
        k[:, :, a, :, a] += laplace
    return k.reshape(e, 30, 30)


def _scatter(values: np.ndarray, rows: np.ndarray, columns: np.ndarray, shape: tuple[int, int]) -> csr_array:
    """Element matrices (e, r, c) at rows (e, r) and columns (e, c), summed."""
    i = np.broadcast_to(rows[:, :, None], values.shape).ravel().astype(np.int32)
    j = np.broadcast_to(columns[:, None, :], values.shape).ravel().astype(np.int32)
    return coo_array((values.ravel(), (i, j)), shape=shape).tocsr()

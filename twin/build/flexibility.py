"""One body seen from its elastic ports: factored once, then a few dense numbers per port.

A body floats: its stiffness is singular. Six statically determinate node supports (3-2-1) make it regular. All loads of
a body together are in equilibrium (heat pushes nothing, springs balance), so these supports carry no force, and the
displacement is the supported one plus a rigid motion,

    u = K_s^-1 (K_uT T + U p) + modes a,      w = U^T u = H T + F p + R a

(static condensation; e.g. Felippa, Park, "The construction of free-free flexibility matrices", 2002, section 3).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.sparse import csr_array

from twin.build.elastic_ports import rigid_modes
from twin.build.elasticity import Elasticity
from twin.build.factorize import factorize
from twin.rom.elastic_structure import PortFlexibility

BLOCK = 48  # ports solved at once: bounds the dense right-hand sides to 48 * 3n numbers


@dataclass(frozen=True)
class BodyFlexibility(PortFlexibility):
    """p ports, n nodes."""

    ports: tuple[str, ...]
    H: np.ndarray  # (p, n) m/K: port displacement of the supported body per nodal temperature


class SupportedBody:
    """A factored body on six node supports."""

    def __init__(self, elasticity: Elasticity, points: np.ndarray, refine: int = 1):
        """points (n, 3) [m]; refine: as `factorize` has it. Raises ModelError (from there) where the body is not
        connected.
        """
        self.fixed = isostatic_supports(points)
        self.free = np.setdiff1d(np.arange(3 * len(points)), self.fixed)
        modes = rigid_modes(points - points.mean(axis=0))[self.free]  # for the iterative solver only
        self._factor = factorize(elasticity.K[self.free][:, self.free], null_space=modes, refine=refine)

    def solve(self, loads: np.ndarray) -> np.ndarray:
        """Displacements (3n, m) [m] of loads (3n, m) [N], zero at the supports."""
        u = np.zeros_like(loads)
        u[self.free] = self._factor.solve(loads[self.free])
        return u


def isostatic_supports(points: np.ndarray) -> np.ndarray:
    """Six dofs at three well separated nodes that stop rigid motion and nothing else.

    points (n, 3). Nodes: the farthest from the middle, the farthest from that, the farthest from their line. Which
    components: 3 at the first, 2 at the second, 1 at the third, chosen for the best conditioned rigid-body matrix.
    """
    first = int(np.argmax(np.linalg.norm(points - points.mean(axis=0), axis=1)))
    second = int(np.argmax(np.linalg.norm(points - points[first], axis=1)))
    line = points[second] - points[first]
    third = int(np.argmax(np.linalg.norm(np.cross(points - points[first], line), axis=1)))
    size = np.linalg.norm(line)
    modes = rigid_modes((points[[first, second, third]] - points[first]) / size)

    def conditioning(choice: tuple[int, int]) -> float:
        free, held = choice
        rows = [0, 1, 2, *(3 + a for a in range(3) if a != free), 6 + held]
        return float(np.linalg.svd(modes[rows], compute_uv=False)[-1])

    free, held = max(product(range(3), range(3)), key=conditioning)
    return np.array(
        [*(3 * first + a for a in range(3)), *(3 * second + a for a in range(3) if a != free), 3 * third + held]
    )


def condense(
    name: str,
    ports: tuple[str, ...],
    U: csr_array,
    elasticity: Elasticity,
    points: np.ndarray,
    advance: Callable[[str], None] = lambda _: None,
) -> BodyFlexibility:
    """Flexibility of a body at its ports, by one factorisation and one adjoint solve per port.

    U (3n, p): port functionals; points (n, 3) [m]. `advance` is called once per block of ports.
    """
    body = SupportedBody(elasticity, points)
    p = U.shape[1]
    F, H = np.zeros((p, p)), np.zeros((p, elasticity.KT.shape[1]))
    gather, heat = U.T.tocsr(), elasticity.KT.T.tocsr()
    columns = U.tocsc()
    for start in range(0, p, BLOCK):
        block = slice(start, min(start + BLOCK, p))
        X = body.solve(columns[:, block].toarray())
        F[:, block] = gather @ X
        H[block] = (heat @ X).T
        advance(f"{name}, {block.stop} of {p} ports")
    return BodyFlexibility(name, (F + F.T) / 2, gather @ rigid_modes(points), ports, H)


def block_count(n_ports: int) -> int:
    """How often `condense` calls `advance`."""
    return -(-n_ports // BLOCK)

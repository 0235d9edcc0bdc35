"""What a film acts on: whole surfaces, and of those with fixed contacts what these leave free.

A surface that is larger than what is mounted on it is named by a film as well as by its contacts. What faces the other
side is left out facet by facet, exactly (`interface.common_pieces`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp

from twin.build.interface import common_pieces
from twin.build.mesh import BodyMesh, PartMesh
from twin.build.surface import mass
from twin.errors import DescriptionError
from twin.machine.description import Machine

# Share of a surface below which what contacts leave free is rounding, or the chords of facetted cylinders.
ROUNDED = 0.01


def film_matrix(
    machine: Machine, body: BodyMesh, surfaces: Sequence[tuple[str, str]], where: str, additional: bool
) -> sp.csr_array:
    """int N N^T dA [m^2] (n, n) over the (part, surface) of a film that are on the body.

    additional: it acts on whole surfaces, whatever they are used for. Raises DescriptionError for a surface of which
    fixed contacts leave nothing free.
    """
    blocks = []
    for part in body.parts:
        block = sp.csr_array((part.n, part.n))
        whole = [s for p, s in surfaces if p == part.name]
        if whole:
            block = mass(part, np.concatenate([part.facets(s) for s in whole]))
        for name in () if additional else whole:
            block = block - _taken(machine, body, part, name, where)
        blocks.append(block)
    return sp.csr_array(sp.block_diag(blocks, format="csr"))


def _taken(machine: Machine, body: BodyMesh, part: PartMesh, name: str, where: str) -> sp.csr_array:
    """Of one surface, over what fixed contacts join to another."""
    path, taken, one = f"{part.name}.{name}", sp.csr_array((part.n, part.n)), np.ones(part.n)
    for contact in machine.contacts.values():
        if contact.surfaces is None or path not in contact.surfaces:
            continue
        first = contact.surfaces[0] == path
        of_a, of_b, pieces = common_pieces(body, *contact.surfaces, gap=contact.gap)
        own, corners = (of_a, pieces[:, :, :3]) if first else (of_b, pieces[:, :, 3:])
        if len(own):
            taken = taken + mass(part, part.facets(name)[own], corners)
    area = float(one @ mass(part, part.facets(name)) @ one)
    if not area - float(one @ taken @ one) > ROUNDED * area:
        what = f"its fixed contacts leave nothing of '{path}' free"
        raise DescriptionError(what, f"films.{where}.surfaces", f"take '{path}' out")
    return taken

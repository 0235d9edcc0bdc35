"""How the surface of a machine moves at a state and a position, where its artefact holds what that takes.

    u = D x + F_s p + rigid motion a + shift of linear scales

D x is the displacement by heat of the body on isostatic supports, F_s p that by the forces p on its elastic ports.
These and the rigid motion follow from the elastic structure (`twin.rom.elastic_structure`): the full model's
displacements of the temperatures that the reduced model has.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from twin.rom.elastic_structure import ElasticStructure
from twin.rom.field_file import SurfaceField
from twin.rom.model import MachineModel
from twin.rom.springs import Positions
from twin.rom.tcp import by_body, inputs, is_exact


def is_known(model: MachineModel, fields: Sequence[SurfaceField]) -> bool:
    """Whether displacements of the surface follow from the artefact: no lumped machines, no older artefacts."""
    if not is_exact(model) or not isinstance(model.structure, ElasticStructure) or not fields:
        return False
    ports = {body.name: len(body.R) for body in model.structure.bodies}
    return all(f.flexibility is not None and f.flexibility.shape[2] == ports[f.body] for f in fields)


def surface_displacements(
    model: MachineModel, fields: Sequence[SurfaceField], state: np.ndarray, positions: Positions
) -> tuple[np.ndarray, ...]:
    """Displacements (m, 3) [m] per field at a state (N,) of the machine and positions of its linear axes [m].

    Raises ValueError where they are not known (`is_known`), ModelError where a body moves freely.
    """
    structure = model.structure
    if not is_known(model, fields) or not isinstance(structure, ElasticStructure):
        raise ValueError("the artefact holds no displacements of its surface")
    x = by_body(model, state)
    read = [inputs(model, b) @ own for b, own in enumerate(x)]
    heat = np.concatenate([r[: len(body.R)] for r, body in zip(read, structure.bodies, strict=True)])
    p, a, w = structure.motion(positions, heat)
    shifts = structure.scale_shifts(positions, w, read)
    forces = np.split(p, structure.system.offsets[1:-1])
    names = [body.name for body in model.bodies]
    found = []
    for field in fields:
        b = names.index(field.body)
        assert field.displacement is not None
        assert field.flexibility is not None
        rigid = a[b, :3] + np.cross(a[b, 3:], field.nodes) + shifts[b]
        found.append(field.displacement @ x[b] + field.flexibility @ forces[b] + rigid)
    return tuple(found)

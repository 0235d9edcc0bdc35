"""How long the segments of rails and screws are, from their own meshes alone."""

from __future__ import annotations

import numpy as np

from twin.build.mesh import load_part_mesh
from twin.build.surface import facet_nodes
from twin.machine.bodies import split_surface
from twin.machine.description import Machine
from twin.machine.kinematics import direction


def shortest_segment(machine: Machine, axis: str) -> float | None:
    """The shortest segment [m] of the rails and screws of an axis, None where it has no moving contacts.

    Reads the meshes of these parts only. Raises DescriptionError for meshes or surfaces that cannot be read.
    """
    along, lengths = direction(machine, axis), []
    rails = {(rail, c.segments) for c in machine.contacts.values() if c.axis == axis for rail, _ in c.pairs}
    for rail, segments in rails:
        part_name, surface = split_surface(rail)
        part = load_part_mesh(part_name, machine.parts[part_name], machine.folder)
        s = part.nodes[facet_nodes(part, part.facets(surface))[:, :3]] @ along
        lengths.append(float(np.ptp(s)) / segments)
    return min(lengths, default=None)

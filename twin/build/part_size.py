"""Is a part as large as a part of a machine can be? Meshes in millimetres or inches that were read as metres."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from twin.build.mesh import PartMesh
from twin.errors import Problem
from twin.machine.bodies import split_surface
from twin.machine.description import Machine
from twin.units import to_si

LARGEST = 50.0  # m; nothing on a machine tool is longer
SMALLEST = 1e-3  # m
HEAVIEST = 5e5  # kg of one part
NEAR = 5e-3  # m that a sensor may lie outside its part
UNITS = ("m", "mm", "inch", "cm")  # that meshes come in, the most frequent first


def volume(part: PartMesh) -> float:
    """m^3; edges taken as straight."""
    corner = part.mesh.p[:, part.mesh.t[:4]]
    edges = corner[:, 1:] - corner[:, :1]
    return float(np.abs(np.einsum("in,in->n", edges[:, 0], np.cross(edges[:, 1], edges[:, 2], axis=0))).sum() / 6.0)


def size_problems(machine: Machine, part: PartMesh) -> Iterator[Problem]:
    """A part that no machine has, with the units in which it would be one, or whose sensors fit another unit only."""
    entry = machine.parts[part.name]
    extent = np.ptp(part.nodes, axis=0)
    mass = volume(part) * machine.materials[entry.material].density
    where = f"parts.{part.name}"
    if not _possible(extent, mass):
        remedy = _remedy(machine, part, extent, mass)
        yield Problem(f"part '{part.name}' measures {_shown(extent, mass)}", where, remedy)
    elif entry.mesh and not _holds(machine, part, 1.0):
        fitting = [u for u in UNITS if _possible(*_scaled(extent, mass, f := _factor(u, entry.mesh_unit)))
                   and _holds(machine, part, f)]  # fmt: skip
        if len(fitting) == 1:
            yield Problem(
                f"part '{part.name}' measures {_shown(extent, mass)}, and its sensors lie outside",
                where,
                f'they lie within it if the mesh is in {fitting[0]}: write mesh_unit = "{fitting[0]}"',
            )


def _remedy(machine: Machine, part: PartMesh, extent: np.ndarray, mass: float) -> str:
    entry = machine.parts[part.name]
    if entry.box:
        return 'box sizes are in m: write "800 mm"' if extent.max() > LARGEST else "box sizes are in m"
    factors = {u: _factor(u, entry.mesh_unit) for u in UNITS if u != entry.mesh_unit}
    fits = {u: f for u, f in factors.items() if _possible(*_scaled(extent, mass, f))}
    held = {u: f for u, f in fits.items() if _holds(machine, part, f)}
    ways = [f'mesh_unit = "{u}" makes it {_shown(*_scaled(extent, mass, f))}' for u, f in (held or fits).items()]
    if not ways:
        return f'its mesh_unit is "{entry.mesh_unit}", and no usual unit makes it a part: look at the file'
    return f"in which unit is the mesh? {', or '.join(ways)}"


def _factor(unit: str, declared: str) -> float:
    """By which the part grows if its mesh is in `unit` and not in the declared one."""
    return float(to_si(f"1 {unit}", "m") / to_si(f"1 {declared}", "m"))


def _scaled(extent: np.ndarray, mass: float, factor: float) -> tuple[np.ndarray, float]:
    return extent * factor, mass * factor**3


def _possible(extent: np.ndarray, mass: float) -> bool:
    return bool(SMALLEST <= extent.max() <= LARGEST and mass <= HEAVIEST)


def _holds(machine: Machine, part: PartMesh, factor: float) -> bool:
    """Whether the part's box, its mesh scaled by `factor`, contains its sensors and is near its tool point."""
    low, high = part.nodes.min(axis=0) * factor, part.nodes.max(axis=0) * factor
    points = [s.position for s in machine.sensors.values() if s.part == part.name and s.position is not None]
    inside = all(bool((low - NEAR <= p).all() and (p <= high + NEAR).all()) for p in map(np.asarray, points))
    tool = machine.tcp.tool if machine.has_tcp else None
    if tool is None or tool.point is None or split_surface(tool.surface)[0] != part.name:
        return inside
    off = np.maximum(np.maximum(low - np.asarray(tool.point), np.asarray(tool.point) - high), 0.0)
    return inside and bool(np.linalg.norm(off) <= 1.0)  # m; check_meshes warns of longer tools


def _shown(extent: np.ndarray, mass: float) -> str:
    return f"{' x '.join(f'{e:.4g}' for e in extent)} m and {mass:.3g} kg"

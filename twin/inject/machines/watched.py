"""Where drawn machines of boxes are measured: sensors in faces and bores, near heat and far from it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from twin.inject.machines.boxes import LETTERS, Solid
from twin.inject.machines.draws import one_of
from twin.inject.machines.structure import Structure
from twin.machine.toml_text import Table

SENSORS = (4, 32)  # of a machine: from a handful for a correction to a measuring campaign
RIM = 8  # mm, of sensors from edges


def sensor_count(rng: np.random.Generator) -> int:
    """Uniform in the logarithm over SENSORS."""
    low, high = SENSORS
    return min(high, int(low * ((high + 1) / low) ** rng.random()))


def sensor_tables(
    rng: np.random.Generator, built: Structure, heated: Sequence[str], environments: Sequence[str]
) -> tuple[Table, ...]:
    """Sensors: at heated surfaces, in the air, then at drawn places of parts that are large enough; SENSORS in all.

    heated: surfaces with a source; environments: those that are measured.
    """
    count = sensor_count(rng)
    places = [(built.solid(part), face) for part, face in (s.split(".") for s in heated)]
    kinds = [s for s in built.solids if s.role in ("main", "block", "motor", "rail", "nut")]
    weights = np.array([3.0 if s.role == "main" else 1.0 for s in kinds])
    while len(places) + len(environments) < count:
        solid = kinds[int(rng.choice(len(kinds), p=weights / weights.sum()))]
        places.append((solid, "inside" if rng.random() < 0.2 else f"{one_of(rng, LETTERS)}_{one_of(rng, _ENDS)}"))
    named: dict[str, int] = {}
    tables = []
    for solid, face in places[: count - len(environments)]:
        named[solid.name] = named.get(solid.name, 0) + 1
        at = [f"{v} mm" for v in _place(rng, solid, face)]
        remark = "in a bore" if face == "inside" else ""
        name = f"sensors.{solid.name}_t{named[solid.name]}"
        tables.append(Table(name, {"part": solid.name, "position": at}, remark))
    return (*tables, *(Table(f"sensors.{e}", {"environment": e}) for e in environments))


_ENDS = ("min", "max")


def _place(rng: np.random.Generator, solid: Solid, face: str) -> list[int]:
    """A point [mm] on a face of a box, or inside."""
    at = [
        int(rng.integers(low + min(RIM, size // 3), low + size - min(RIM, size // 3) + 1))
        for low, size in zip(solid.origin, solid.size, strict=True)
    ]
    if face != "inside":
        axis = LETTERS.index(face[0])
        at[axis] = (solid.origin if face.endswith("min") else solid.end)[axis]
    return at

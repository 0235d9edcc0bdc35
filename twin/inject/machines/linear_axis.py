"""A linear axis on the face of a part: two rails, carriages, the part that they carry, and often a ball screw."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from twin.inject.machines.boxes import LETTERS, Frame, Solid
from twin.inject.machines.draws import even, one_of, rounded

END = 6  # mm, of a carried part beyond its carriages
SHORTEST = 40  # mm, of half a stroke


@dataclass(frozen=True)
class FixedContact:
    """A fixed contact: two surfaces and a conductance [W/(m^2 K)]."""

    name: str
    surfaces: tuple[str, str]
    conductance: float


@dataclass(frozen=True)
class Moving:
    """A moving contact: pairs of rail and pad; stiffness [N/um] by direction."""

    name: str
    axis: str
    pairs: tuple[tuple[str, str], ...]
    segments: int
    conductance: float
    stiffness: tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class LinearAxis:
    """What an axis consists of; the carried part is the last of `solids`."""

    name: str
    direction: int
    reach: int  # mm, half the stroke
    carried: str
    solids: tuple[Solid, ...]
    glued: tuple[FixedContact, ...]
    moving: tuple[Moving, ...]
    motor: str  # surface that its motor heats, "" without a screw
    bearing: str  # surface at the screw's bearing

    @property
    def guide(self) -> str:
        return f"{self.name}_guide"

    @property
    def screw(self) -> str:
        """The name of the ball screw's contact, "" where a linear motor drives the axis."""
        return next((m.name for m in self.moving if m.name.endswith("_screw")), "")


@dataclass(frozen=True)
class Base:
    """The face that an axis lies on: part, length along the axis and width across [mm]."""

    part: str
    length: int
    width: int


def linear_axis(
    rng: np.random.Generator, name: str, frame: Frame, base: Base, carried: Solid, screw: bool
) -> LinearAxis:
    """An axis on a face; carried: its size is given as (along, across, normal) [mm], its origin is found here.

    The base must be longer than what it carries by 200 mm, or the stroke has no room.
    """
    rail, carriage = (even(rng, 24, 34), even(rng, 24, 34)), even(rng, 20, 28)  # width and height; height
    length, width, thick = carried.size
    top = rail[1] + carriage
    side = (min(base.width, width) - rail[0]) // 2 - END  # of the rails' middles from the middle
    pad = max(36, 2 * round(0.11 * length))
    off = (length - pad) // 2 - END
    mid = base.length // 2
    segments = int(rng.integers(8, 13))
    reach = base.length / 2 - base.length / (2 * segments) - off

    rails = [f"{name}_rail_{i + 1}" for i in range(2)]
    solids = [
        frame.solid(r, "rail", "steel", (0, s * side - rail[0] // 2, 0), (base.length, rail[0], rail[1]))
        for r, s in zip(rails, (-1, 1), strict=True)
    ]
    glued = [_on(base.part, frame, r, float(one_of(rng, (3000, 4000, 5000, 6000)))) for r in rails]
    places = [(0, -off), (0, off), *one_of(rng, ([(1, -off), (1, off)], [(1, 0)]))]
    pairs, joint = [], float(one_of(rng, (3000, 5000, 8000)))
    for i, (on, at) in enumerate(places):
        block = f"{name}_carriage_{i + 1}"
        across = (-1, 1)[on] * side - rail[0] // 2
        made = frame.solid(block, "carriage", "steel", (mid + at - pad // 2, across, rail[1]), (pad, rail[0], carriage))
        solids.append(replace(made, adiabatic=(frame.face(False),)))
        glued.append(_under(carried.name, frame, block, joint))
        pairs.append((f"{rails[on]}.{frame.face(True)}", f"{block}.{frame.face(False)}"))
    held = {"normal": rounded(rng.uniform(150, 500), 2), "lateral": rounded(rng.uniform(120, 350), 2)}
    if not screw:
        held = {"axial": rounded(rng.uniform(60, 150), 2), **held}  # of a linear motor's control
    guide = float(one_of(rng, (1000, 1500, 2000, 2500)))
    moving = [Moving(f"{name}_guide", name, tuple(pairs), segments, guide, tuple(held.items()))]
    motor = bearing = ""
    if screw:
        driven = _ball_screw(rng, name, frame, base, carried.name, top)
        solids += driven.solids
        glued += driven.glued
        moving += driven.moving
        motor, bearing, reach = driven.motor, driven.bearing, min(reach, driven.reach)
    start = (mid - length // 2, -(width // 2), top)
    solids.append(replace(frame.solid(carried.name, carried.role, carried.material, start, (length, width, thick))))
    half = 10 * int(max(reach - 2.0, SHORTEST) // 10)
    return LinearAxis(name, frame.along, half, carried.name, tuple(solids), tuple(glued), tuple(moving), motor, bearing)


def _ball_screw(rng: np.random.Generator, name: str, frame: Frame, base: Base, carried: str, top: int) -> LinearAxis:
    """Bearing block at the near end, screw as a square bar, half a nut on it, and sometimes a motor of its own."""
    block, thick, nut = even(rng, 44, 60), even(rng, 16, 22), 14
    low = top - nut - thick
    screw, pad, wide = f"{name}_screw", f"{name}_nut", thick + 10
    bearing, mid = f"{name}_block", base.length // 2
    length = base.length - 20 - block
    solids = [
        frame.solid(bearing, "block", "cast_iron", (0, -36, 0), (block, 72, top - 4)),
        frame.solid(screw, "screw", "steel", (block, -(thick // 2), low), (length, thick, thick)),
        replace(
            frame.solid(pad, "nut", "steel", (mid - 34, -(wide // 2), low + thick), (68, wide, nut)),
            adiabatic=(frame.face(False),),
        ),
    ]
    glued = [
        _on(base.part, frame, bearing, float(one_of(rng, (3000, 5000)))),
        FixedContact(f"{screw}_seat", (f"{bearing}.{frame.end(True)}", f"{screw}.{frame.end(False)}"), 3000.0),
        _under(carried, frame, pad, 5000.0),
    ]
    motor = f"{bearing}.{frame.end(False)}"
    if rng.random() < 0.5:
        own = f"{name}_motor"
        long = even(rng, 100, 150)
        solids.append(frame.solid(own, "motor", "motor", (-long, -36, 2), (long, 72, top - 6)))
        joint = float(one_of(rng, (500, 800, 1200)))
        glued.append(FixedContact(own, (f"{bearing}.{frame.end(False)}", f"{own}.{frame.end(True)}"), joint))
        motor = f"{own}.{frame.face(True)}"
    segments = int(rng.integers(8, 13))
    axial = rounded(rng.uniform(80, 180), 2)
    pairs = ((f"{screw}.{frame.face(True)}", f"{pad}.{frame.face(False)}"),)
    moving = Moving(screw, name, pairs, segments, float(one_of(rng, (2000, 3000))), (("axial", axial),))
    reach = length / 2 - length / (2 * segments) - abs(mid - block - length / 2)
    away = f"{bearing}.{LETTERS[frame.across]}_max"
    return LinearAxis(name, frame.along, int(reach), carried, tuple(solids), tuple(glued), (moving,), motor, away)


def _on(base: str, frame: Frame, part: str, conductance: float) -> FixedContact:
    """A part that stands on the face."""
    return FixedContact(part, (f"{base}.{frame.face(True)}", f"{part}.{frame.face(False)}"), conductance)


def _under(carried: str, frame: Frame, part: str, conductance: float) -> FixedContact:
    """A part that is screwed to the side of the carried one that looks at the face."""
    return FixedContact(part, (f"{carried}.{frame.face(False)}", f"{part}.{frame.face(True)}"), conductance)

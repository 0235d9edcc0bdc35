"""The structure of a drawn machine of boxes: a bed, what moves on it, and what holds the tool over the work."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from twin.inject.machines.boxes import Frame, Solid, Triple, with_divisions
from twin.inject.machines.draws import even, one_of
from twin.inject.machines.linear_axis import Base, FixedContact, LinearAxis, linear_axis

NODES = (700, 2300)  # of the mesh, quadratic elements: a full model is stepped through hours in seconds
MAIN = 6  # parts besides feet, rails, carriages, screws, blocks and motors


@dataclass(frozen=True)
class Layout:
    """Which axes lie on each other on the bed, and what holds the tool."""

    what: str
    on_bed: tuple[str, ...]
    column: str = ""  # "fixed" head, or "moving" along z; "": a headstock instead of a column


LAYOUTS = {
    "slide": Layout("slide with tool on a bed with headstock", ("x",)),
    "turning": Layout("cross slide with tool on a bed with headstock", ("x", "y")),
    "table": Layout("table under the fixed head of a column", ("x",), "fixed"),
    "cross": Layout("cross table under the fixed head of a column", ("y", "x"), "fixed"),
    "column": Layout("head that moves on a column", (), "moving"),
    "milling": Layout("table under a head that moves on a column", ("x",), "moving"),
}


@dataclass(frozen=True)
class Structure:
    """Parts, how they are joined, axes, and the two sides of the TCP."""

    layout: str
    solids: tuple[Solid, ...]
    glued: tuple[FixedContact, ...]
    axes: tuple[LinearAxis, ...]
    tool: str  # surface
    point: Triple  # mm
    work: str  # surface
    spindle: str  # surface that a spindle heats

    @property
    def main(self) -> tuple[Solid, ...]:
        return tuple(s for s in self.solids if s.role == "main")

    def solid(self, name: str) -> Solid:
        return next(s for s in self.solids if s.name == name)


@dataclass(frozen=True)
class _Grown:
    """What stands so far, and where the next thing goes."""

    solids: tuple[Solid, ...]
    glued: tuple[FixedContact, ...] = ()
    axes: tuple[LinearAxis, ...] = ()

    def plus(self, solids: Sequence[Solid], glued: Sequence[FixedContact]) -> _Grown:
        return replace(self, solids=(*self.solids, *solids), glued=(*self.glued, *glued))

    def moved_by(self, axis: LinearAxis) -> _Grown:
        return replace(self.plus(axis.solids, axis.glued), axes=(*self.axes, axis))

    def main(self) -> int:
        return sum(s.role == "main" for s in self.solids)


def structure(rng: np.random.Generator) -> Structure:
    """A structure of 3 to 6 main parts and one or two linear axes, divided into elements."""
    layout = one_of(rng, sorted(LAYOUTS))
    wanted = LAYOUTS[layout]
    grown, depth = _bed(rng, wanted)
    grown = _stacked(rng, grown, wanted, depth)
    grown, tool, point, spindle = _tool_side(rng, grown, wanted, depth)
    grown, work = _work_side(rng, grown, wanted)
    solids = with_divisions(grown.solids, int(rng.integers(*NODES)))
    return Structure(layout, solids, grown.glued, grown.axes, tool, point, work, spindle)


def _bed(rng: np.random.Generator, layout: Layout) -> tuple[_Grown, int]:
    """The bed on its feet, its top at z = 0, and how much of it from the front is free for axes [mm]."""
    crossed = len(layout.on_bed) == 2
    free = even(rng, 480, 560) if layout.on_bed[:1] == ("y",) else even(rng, 260, 340)
    depth = free + (even(rng, 120, 180) if layout.column else 0)
    length, height = even(rng, 700, 1000) if crossed or not layout.column else even(rng, 560, 900), even(rng, 90, 160)
    material = one_of(rng, ("cast_iron", "cast_iron", "steel", "mineral_casting"))
    bed = Solid("bed", "main", material, (0, 0, -height), (length, depth, height))
    foot, tall = even(rng, 60, 80), even(rng, 24, 40)
    corners = [(20, 20), (20, depth - foot - 20), (length - foot - 20, 20), (length - foot - 20, depth - foot - 20)]
    if rng.random() < 0.5:
        corners = [*corners[:2], (length - foot - 20, (depth - foot) // 2)]
    feet = [
        Solid(f"foot_{i + 1}", "foot", "steel", (x, y, -height - tall), (foot, foot, tall), ("z_min",))
        for i, (x, y) in enumerate(corners)
    ]
    joint = float(one_of(rng, (1000, 2000, 3000)))
    glued = [FixedContact(f.name, ("bed.z_min", f"{f.name}.z_max"), joint) for f in feet]
    return _Grown((bed, *feet), tuple(glued)), free


def _stacked(rng: np.random.Generator, grown: _Grown, layout: Layout, free: int) -> _Grown:
    """The axes that lie on the bed, the second one on what the first one carries."""
    bed = grown.solids[0]
    names = {("x",): ("table",) if layout.column else ("slide",), ("y", "x"): ("saddle", "table")}
    carried = names.get(layout.on_bed, ("slide", "cross_slide")[: len(layout.on_bed)])
    under, start, size = "bed", (0, 0, 0), (bed.size[0], free)
    if not layout.column:  # the headstock stands at the far end
        size = (bed.size[0] - 180, free)
    for depth, (axis, name) in enumerate(zip(layout.on_bed, carried, strict=True)):
        along = "xy".index(axis)
        length, width = size[along], size[1 - along]
        last = depth == len(layout.on_bed) - 1
        own = min(length - 220, even(rng, 200, 300)) if length > 420 else length - 200
        across = min(width - 20, even(rng, 220, 300)) if last else width - 20
        if not last and axis == "x":  # room for the stroke of the second axis across
            across, own = width, max(own, 240)
        material = one_of(rng, ("cast_iron", "steel", "aluminium") if last else ("cast_iron", "steel"))
        part = Solid(name, "main", material, (0, 0, 0), (own, 2 * (across // 2), even(rng, 36, 60)))
        middle = start[1 - along] + width // 2
        origin = (start[0], middle, start[2]) if along == 0 else (middle, start[1], start[2])
        frame = Frame(origin, along, 1 - along, 2)
        screw = bool(rng.random() < 0.75)
        made = linear_axis(rng, axis, frame, Base(under, length, width), part, screw)
        grown = grown.moved_by(made)
        top = made.solids[-1]
        under, start, size = name, (top.origin[0], top.origin[1], top.end[2]), top.size[:2]
    return grown


def _tool_side(rng: np.random.Generator, grown: _Grown, layout: Layout, free: int) -> tuple[_Grown, str, Triple, str]:
    """What holds the tool; returns it with the tool's surface and point, and the surface that a spindle heats."""
    bed, top = grown.solids[0], grown.solids[-1]
    if not layout.column:
        return _turning(rng, grown)
    high = top.end[2] if layout.on_bed else 0
    over = top.middle if layout.on_bed else (bed.size[0] // 2, free // 2, 0)
    wide = even(rng, 220, 300)
    x = min(max(over[0] - wide // 2, 0), bed.size[0] - wide)
    material = one_of(rng, ("cast_iron", "steel", "mineral_casting"))
    head, drop = one_of(rng, ("cast_iron", "steel", "aluminium")), even(rng, 100, 180)
    if layout.column == "moving":
        long = even(rng, 170, 240)
        rails = long + even(rng, 200, 280)
        column = Solid("column", "main", material, (x, free, 0), (wide, bed.size[1] - free, high + 20 + rails))
        frame = Frame((x + wide // 2, free, high + 20), 2, 0, 1, upward=False)
        part = Solid("head", "main", head, (0, 0, 0), (long, 2 * (wide // 2 - 10), even(rng, 120, 180)))
        axis = linear_axis(rng, "z", frame, Base("column", rails, wide), part, bool(rng.random() < 0.75))
        grown = grown.plus([column], [_standing(rng, "column")]).moved_by(axis)
        made = axis.solids[-1]
    else:
        low = high + even(rng, 80, 160)
        tall = even(rng, 140, 220)
        height = low + tall + even(rng, 0, 60)
        column = Solid("column", "main", material, (x, free, 0), (wide, bed.size[1] - free, height))
        reach = free - over[1] + even(rng, 20, 60)
        made = Solid("head", "main", head, (x + 20, free - reach, low), (wide - 40, reach, tall))
        joint = float(one_of(rng, (2000, 4000)))
        glued = [_standing(rng, "column"), FixedContact("head", ("column.y_min", "head.y_max"), joint)]
        grown = grown.plus([column, made], glued)
    middle = made.middle
    if grown.main() < MAIN and rng.random() < 0.5:
        size = (2 * (made.size[0] // 4), 2 * (min(made.size[1], 140) // 4) + 20, min(drop, 60))
        at = (middle[0] - size[0] // 2, middle[1] - size[1] // 2, made.origin[2] - size[2])
        spindle = Solid("spindle", "main", "steel", at, size)
        grown = grown.plus([spindle], [FixedContact("spindle", ("head.z_min", "spindle.z_max"), 3000.0)])
        return grown, "spindle.z_min", (middle[0], middle[1], at[2] - 20), "spindle.y_min"
    return grown, "head.z_min", (middle[0], middle[1], made.origin[2] - 20), "head.y_min"


def _turning(rng: np.random.Generator, grown: _Grown) -> tuple[_Grown, str, Triple, str]:
    """A headstock at the far end of the bed, and often a turret on the slide."""
    bed, slide = grown.solids[0], grown.solids[-1]
    height, tall = slide.end[2] + even(rng, 80, 140), even(rng, 60, 110)
    size = (150, 2 * (bed.size[1] // 3), height)
    at = (bed.size[0] - 160, (bed.size[1] - size[1]) // 2, 0)
    headstock = Solid("headstock", "main", one_of(rng, ("cast_iron", "steel")), at, size)
    grown = grown.plus([headstock], [_standing(rng, "headstock")])
    tool, middle, z = f"{slide.name}.z_max", slide.middle, slide.end[2]
    if rng.random() < 0.6:
        wide = min(slide.size[0], slide.size[1], 140)
        start = (middle[0] - wide // 2, middle[1] - wide // 2, z)
        turret = Solid("turret", "main", one_of(rng, ("steel", "cast_iron")), start, (wide, wide, tall))
        grown = grown.plus([turret], [FixedContact("turret", (tool, "turret.z_min"), 3000.0)])
        tool, z = "turret.x_max", z + tall // 2
    return grown, tool, (at[0] - 40, middle[1], z), "headstock.x_min"


def _work_side(rng: np.random.Generator, grown: _Grown, layout: Layout) -> tuple[_Grown, str]:
    """What holds the work, with a fixture on it where parts are left; its surface of the TCP."""
    if not layout.column:
        return grown, "headstock.y_min"
    table = next((s for s in grown.solids if s.name == "table"), None)
    base = table or grown.solids[0]
    surface = f"{base.name}.z_max"
    if grown.main() < MAIN and (table is None or rng.random() < 0.5):
        size = (even(rng, 100, 140), even(rng, 100, 140), even(rng, 40, 70))
        middle = base.middle if table else (base.middle[0], 110, 0)
        at = (middle[0] - size[0] // 2, middle[1] - size[1] // 2, base.end[2])
        fixture = Solid("fixture", "main", one_of(rng, ("steel", "aluminium")), at, size)
        return grown.plus([fixture], [FixedContact("fixture", (surface, "fixture.z_min"), 3000.0)]), "fixture.z_max"
    return grown, surface


def _standing(rng: np.random.Generator, part: str) -> FixedContact:
    """A part that is bolted to the bed's top."""
    return FixedContact(part, ("bed.z_max", f"{part}.z_min"), float(one_of(rng, (1500, 3000, 5000))))

"""The description of a drawn machine of boxes: structure, what heats and cools it, what is measured."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from twin.inject.machines.boxes import Solid
from twin.inject.machines.draws import one_of, rounded
from twin.inject.machines.films import constant_film, moved_film, still_film
from twin.inject.machines.heat import INTO_LARGE, INTO_SMALL, Heat, drive_law, heat, signal_table
from twin.inject.machines.linear_axis import LinearAxis
from twin.inject.machines.materials import material_tables
from twin.inject.machines.structure import LAYOUTS, Structure, structure
from twin.inject.machines.watched import sensor_tables
from twin.machine.toml_text import Section, Table, toml_text

MOST_SOURCES = 4
AIR = {"unit": "degC", "range": [10.0, 35.0]}


def machine_of_boxes(rng: np.random.Generator, name: str) -> tuple[Callable[[float], str], int]:
    """The text of a machine.toml as a function of a factor of all powers, and the number of main parts."""
    built = structure(rng)
    sources = _sources(rng, built)
    floor = f"{one_of(rng, (18, 19, 20, 21))} degC" if rng.random() < 0.5 else ""
    heated = [str(s.place["surface"]) for s in sources if "surface" in s.place]
    materials = material_tables(rng, [s.material for s in built.solids])
    films = _films(rng, built, bool(floor))
    signals = _signals(built, sources, films)
    sensors = sensor_tables(rng, built, heated, ["shop"])
    feet = [s.name for s in built.solids if s.role == "foot"]
    across, up = (f"{rounded(rng.uniform(*r), 2):g} N/um" for r in ((40, 120), (150, 400)))
    environments = [Table("environment.shop", {"signal": "shop_air"})]
    if floor:
        environments.append(Table("environment.floor", {"temperature": floor}))
    rest = (
        Section("signals, environments, films", (*signals, *environments, *films)),
        Section("sensors, TCP, supports", (*sensors, *_held(built, feet, across, up))),
    )
    first = (
        Section("", (Table("machine", _entries(name, built)),)),
        Section("materials", materials),
        Section("parts: boxes, surfaces x_min .. z_max", tuple(_part(s) for s in built.solids)),
        Section("axes and contacts", _joined(built)),
    )

    def text(factor: float) -> str:
        hot = Section("heat", tuple(Table(f"sources.{s.name}", s.table(factor)) for s in sources))
        return toml_text("Drawn from a seed. x along the bed, z up; places hold with all axes at zero.",
                         (*first, hot, *rest))  # fmt: skip

    return text, len(built.main)


def _entries(name: str, built: Structure) -> dict[str, Any]:
    return {"name": name, "description": LAYOUTS[built.layout].what, "reference_temperature": "20 degC"}


def _sources(rng: np.random.Generator, built: Structure) -> list[Heat]:
    """Two to four: a drive or a spindle at least, then others as they are drawn."""
    found = [s for axis in built.axes for s in _drive(rng, axis)]
    found.append(_spindle(rng, built))
    place = one_of(rng, ("bed.x_max", "bed.y_min", "bed.x_min"))
    law = one_of(rng, ("constant_heat", "switched_heat"))
    found.append(
        heat(rng, one_of(rng, ("hydraulics", "electronics", "pump_unit")), law, {"surface": place}, "", INTO_LARGE)
    )
    count = int(rng.integers(2, MOST_SOURCES + 1))
    kept = sorted(rng.choice(len(found), size=min(count, len(found)), replace=False))
    return [found[k] for k in kept]


def _drive(rng: np.random.Generator, axis: LinearAxis) -> list[Heat]:
    """Motor, nut and bearing of a ball screw; without one, the heat of the linear motor in the carried part."""
    share = rounded(rng.uniform(0.3, 0.7), 2)
    law = one_of(rng, ("guide_friction", "guide_preload"))
    guide = heat(rng, axis.guide, law, {"contact": axis.guide, "rail_share": share}, axis.name)
    if not axis.screw:
        place = {"surface": f"{axis.carried}.{'y' if axis.direction != 1 else 'x'}_max"}
        return [heat(rng, f"{axis.name}_motor", "motor_copper", place, axis.name), guide]
    turned = one_of(rng, ("bearing_friction", "bearing_friction_warm"))
    return [
        heat(rng, f"{axis.name}_motor", drive_law(rng), {"surface": axis.motor}, axis.name, INTO_SMALL),
        heat(rng, axis.screw, "screw_friction", {"contact": axis.screw, "rail_share": share}, axis.name, INTO_SMALL),
        heat(rng, f"{axis.name}_bearing", turned, {"surface": axis.bearing}, axis.name, INTO_SMALL),
        guide,
    ]


def _spindle(rng: np.random.Generator, built: Structure) -> Heat:
    law = one_of(rng, ("bearing_friction", "bearing_friction_warm", "turning_heat"))
    return heat(rng, "spindle", law, {"surface": built.spindle}, "", INTO_LARGE)


def _signals(built: Structure, sources: Sequence[Heat], films: Sequence[Table]) -> list[Table]:
    """Positions of all axes, what sources and films read, and the air."""
    tables = []
    for axis in built.axes:
        reach = float(axis.reach)
        tables.append(Table(f"signals.{axis.name}_position", {"unit": "mm", "range": [-reach, reach]}))
    names = {n for s in sources for n in s.signals.values()}
    names |= {n for f in films for n in f.entries.get("signals", {}).values()}
    tables += [Table(f"signals.{n}", signal_table(n)) for n in sorted(names)]
    return [*tables, Table("signals.shop_air", AIR)]


def _films(rng: np.random.Generator, built: Structure, floor: bool) -> list[Table]:
    """Two or three: what rests, what moves, and where there are some the feet on the floor or the drives."""
    bodies = {s.name for a in built.axes for s in a.solids if s.role in ("carriage", "nut", "screw")}
    moved = bodies | {a.carried for a in built.axes}
    moved |= {s.name for s in built.main if s.name in ("turret", "spindle") and _carried(built, s.name)}
    drives = [s.name for s in built.solids if s.role in ("motor", "block")]
    feet = [s.name for s in built.solids if s.role == "foot"]
    third = feet if floor else drives
    still = [s.name for s in built.solids if s.name not in moved and s.name not in third]
    going = [s.name for s in built.solids if s.name in moved]
    speed, bed = f"{built.axes[-1].name}_speed", built.solid("bed")
    tables = [
        Table("films.structure", still_film(rng, _all(still), "shop", bed.size[2])),
        Table("films.moving", moved_film(rng, _all(going), "shop", built.solid(built.axes[-1].carried).size[0], speed)),
    ]
    if floor:
        tables.append(Table("films.floor", constant_film(rng, _all(feet), "floor"), "feet in the air of the floor"))
    elif drives:
        tables.append(Table("films.drives", still_film(rng, _all(drives), "shop", 60)))
    return tables


def _carried(built: Structure, part: str) -> bool:
    """Whether a part is bolted to one that an axis carries."""
    surfaces = next(g.surfaces for g in built.glued if g.name == part)
    return surfaces[0].split(".")[0] in {a.carried for a in built.axes}


def _all(parts: Sequence[str]) -> list[str]:
    return [f"{p}.*" for p in parts]


def _part(s: Solid) -> Table:
    box = {"origin": _mm(s.origin), "size": _mm(s.size), "divisions": list(s.divisions)}
    held = {"adiabatic": list(s.adiabatic)} if s.adiabatic else {}
    return Table(f"parts.{s.name}", {"material": s.material, **held, "box": box})


def _mm(values: Sequence[int]) -> list[str]:
    return [f"{v} mm" for v in values]


def _joined(built: Structure) -> tuple[Table, ...]:
    axes = [
        Table(
            f"axes.{a.name}",
            {
                "direction": [1.0 if i == a.direction else 0.0 for i in range(3)],
                "stroke": _mm((-a.reach, a.reach)),
                "carries": [a.carried],
                "position": f"{a.name}_position",
            },
        )
        for a in built.axes
    ]
    glued = [
        Table(
            f"contacts.{g.name}",
            {"kind": "fixed", "surfaces": list(g.surfaces), "conductance": f"{g.conductance:g} W/(m^2*K)"},
        )
        for g in built.glued
    ]
    moving = [
        Table(
            f"contacts.{m.name}",
            {
                "kind": "moving",
                "axis": m.axis,
                "pairs": [list(p) for p in m.pairs],
                "segments": m.segments,
                "conductance": f"{m.conductance:g} W/(m^2*K)",
                "stiffness": {k: f"{v:g} N/um" for k, v in m.stiffness},
            },
        )
        for a in built.axes
        for m in a.moving
    ]
    return (*axes, *glued, *moving)


def _held(built: Structure, feet: Sequence[str], across: str, up: str) -> tuple[Table, ...]:
    springs = [Table(f"supports.{f}", {"surface": f"{f}.z_min", "stiffness": [across, across, up]}) for f in feet]
    return (
        Table("tcp.tool", {"surface": built.tool, "point": _mm(built.point)}),
        Table("tcp.work", {"surface": built.work}),
        *springs,
        Table("poses", {a.name: 3 for a in built.axes}),
    )

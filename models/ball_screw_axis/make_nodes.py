"""Write nodes.toml, the node model of this drive, from the dimensions in machine.toml: `python make_nodes.py`.

Needs this package only. Capacities and areas are those of the boxes, conductances are one-dimensional resistances:

- a part that heat flows through: from its middle to the joint, d / (2 k A);
- a part that ends there, or that heat arises in: the flow through its sections grows towards the joint, d / (3 k A);
- the joint: 1 / (h A) with the conductance of machine.toml;
- the narrowing of the flow below a small joint on a large face: 0.475 / (k sqrt(A)) (1 - 1.41 e + 0.41 e^3),
  e = sqrt(A / A_face), the mean rise of a square of uniform flux (after Negus and Yovanovich);
- from the middle to the rim of the table: the radial flow in a disc of its thickness and areas;
- below a carriage: the rail as a fin on its joint with the bed.

Signals, environment, axes, sources and films are those of machine.toml, with nodes and bars in the place of surfaces.
"""

from __future__ import annotations

from math import log, pi, sqrt
from pathlib import Path

from twin.machine.description import Contact, Machine
from twin.machine.load import load_machine

FOLDER = Path(__file__).parent
SIDES = ("x_min", "x_max", "y_min", "y_max", "z_min", "z_max")


class Boxes:
    """The boxes of machine.toml and the resistances [K/W] between them."""

    def __init__(self, machine: Machine) -> None:
        self.machine = machine

    def size(self, part: str) -> tuple[float, float, float]:
        box = self.machine.parts[part].box
        assert box is not None
        return box.size

    def origin(self, part: str) -> tuple[float, float, float]:
        box = self.machine.parts[part].box
        assert box is not None
        return box.origin

    def centre(self, part: str) -> tuple[float, ...]:
        return tuple(o + s / 2 for o, s in zip(self.origin(part), self.size(part), strict=True))

    def volume(self, part: str) -> float:
        a, b, c = self.size(part)
        return a * b * c

    def face(self, part: str, side: str) -> float:
        """m^2."""
        return self.volume(part) / self.size(part)["xyz".index(side[0])]

    def k(self, part: str) -> float:
        return self.machine.materials[self.machine.parts[part].material].conductivity

    def capacity(self, part: str) -> float:
        """J/K."""
        m = self.machine.materials[self.machine.parts[part].material]
        return m.density * m.heat_capacity * self.volume(part)

    def film_area(self, part: str) -> float:
        """m^2: faces that are neither adiabatic nor in a fixed contact."""
        taken = set(self.machine.parts[part].adiabatic)
        for contact in self.machine.contacts.values():
            taken |= {s.split(".")[1] for s in contact.surfaces or () if s.split(".")[0] == part}
        return sum(self.face(part, side) for side in SIDES if side not in taken)

    def half(self, part: str, axis: str, area: float | None = None) -> float:
        """From the middle of a part to a face across `axis`, through the whole section or an `area` of it."""
        along = self.size(part)["xyz".index(axis)]
        return along / 2 / (self.k(part) * (area or self.volume(part) / along))

    def end(self, part: str, axis: str, area: float | None = None) -> float:
        """From the mean of a part that ends there: the flow through its sections grows evenly towards the joint."""
        return self.half(part, axis, area) * 2 / 3

    def joint(self, contact: str, area: float) -> float:
        return 1.0 / (self.conductance(contact) * area)

    def conductance(self, contact: str) -> float:
        entry: Contact = self.machine.contacts[contact]
        assert entry.conductance is not None
        return entry.conductance

    def narrowing(self, part: str, area: float, face: float) -> float:
        """Below a joint of `area` on a face [m^2]."""
        e = sqrt(min(area / face, 1.0))
        return 0.475 / (self.k(part) * sqrt(area)) * max(1.0 - 1.41 * e + 0.41 * e**3, 0.0)


def annulus(k: float, thickness: float, inner: float, outer: float) -> float:
    """K/W from the rim of the inner area to the mean of the rest, which takes up the heat evenly.

    inner, outer [m^2]: areas, here as those of circles. Steady radial flow with a uniform sink.
    """
    a, b = inner / pi, outer / pi  # radii squared
    return (b**2 * log(b / a) / 2 / (b - a) ** 2 - (3 * b - a) / (4 * (b - a))) / (2 * pi * k * thickness)


def network(machine: Machine) -> dict[str, float]:
    """Every number of the node model that follows from the dimensions, SI."""
    m = Boxes(machine)
    n: dict[str, float] = {}

    # The end plate in two nodes: its upper part, with motor and bearing, and its foot, in front of the bed.
    height = m.size("block")[2]
    foot = -m.origin("block")[2] / height  # share of the height below the bed's top
    for name, share in (("block", 1.0 - foot), ("block_foot", foot)):
        n[f"{name}.capacity"] = share * m.capacity("block")
        sides = 2 * m.face("block", "y_min") * share + m.face("block", "z_min")
        n[f"{name}.area"] = sides
    n["block_middle"] = 1.0 / (height / 3 / (m.k("block") * m.face("block", "z_min")))

    for part in ("motor", "bearing", "far_block"):
        n[f"{part}.capacity"], n[f"{part}.area"] = m.capacity(part), m.film_area(part)
    carriages = [f"carriage_{i}" for i in (1, 2, 3, 4)]
    n["carriages.capacity"] = 2 * m.capacity(carriages[0])  # one pair
    n["carriages.area"] = 2 * m.film_area(carriages[0])
    n["carriages.rear"], n["carriages.front"] = m.centre(carriages[0])[0], m.centre(carriages[1])[0]
    n["nut.capacity"] = m.capacity("nut_1") + m.capacity("nut_2")
    n["nut.area"] = m.film_area("nut_1") + m.film_area("nut_2")

    # The table: its middle, above the nut, and the rest.
    table = m.face("table", "z_max")
    length, width = m.size("nut_1")[0], m.size("screw")[1] + 2 * m.size("nut_1")[1]
    middle = length * width
    n["table.capacity"], n["table_rim.capacity"] = (
        share * m.capacity("table") for share in (middle / table, 1.0 - middle / table)
    )
    n["table.area"], n["table_rim.area"] = middle, m.film_area("table") - middle
    n["table_rim"] = 1.0 / annulus(m.k("table"), m.size("table")[2], middle, table)

    # Bars. The rails are part of the bed: its sections and surfaces and theirs together, its own end face as well.
    rails = ("rail_1", "rail_2")
    n["bed.start"], n["bed.length"] = m.origin("bed")[0], m.size("bed")[0]
    capacity = m.capacity("bed") + sum(m.capacity(r) for r in rails)
    cast = machine.materials[machine.parts["bed"].material]
    n["bed.section"] = capacity / (cast.density * cast.heat_capacity * n["bed.length"])
    n["bed.area"] = sum(m.film_area(p) for p in ("bed", *rails))
    n["screw.start"], n["screw.length"] = m.origin("screw")[0], m.size("screw")[0]
    n["screw.height"] = m.centre("screw")[2]
    n["screw.section"] = m.face("screw", "x_min")
    n["screw.perimeter"] = m.film_area("screw") / n["screw.length"]

    # Fixed joints.
    face = m.face("motor", "x_max")
    n["motor"] = 1.0 / (
        m.end("motor", "x")
        + m.joint("motor", face)
        + m.narrowing("block", face, m.face("block", "x_min"))
        + m.half("block", "x")
    )
    # the lower part of the motor's flange is on the foot of the end plate
    below = (m.origin("bed")[2] + m.size("bed")[2] - m.origin("motor")[2]) / m.size("motor")[2]
    n["motor_foot"], n["motor"] = below * n["motor"], (1.0 - below) * n["motor"]
    seat = m.face("bearing", "x_min")
    n["bearing"] = 1.0 / (
        m.end("bearing", "x")
        + m.joint("bearing", seat)
        + m.narrowing("block", seat, m.face("block", "x_max"))
        + m.half("block", "x")
    )
    n["screw"] = 1.0 / (
        m.end("bearing", "x") + m.narrowing("bearing", n["screw.section"], seat) + m.joint("screw", n["screw.section"])
    )
    end = m.face("bed", "x_min")
    n["block"] = 1.0 / (m.half("block", "x", end) + m.joint("block", end))
    base = m.face("far_block", "z_min")
    n["far_block"] = 1.0 / (
        m.end("far_block", "z") + m.joint("far_block", base) + m.narrowing("bed", base, m.face("bed", "x_max"))
    )
    top = m.face("nut_1", "z_max")
    n["nut_table"] = 1.0 / ((m.end("nut_1", "z") + m.joint("nut_1", top)) / 2 + m.end("table", "z", middle))
    pad = m.face("carriage_1", "z_min")
    n["carriages"] = 2.0 / (
        m.half("carriage_1", "z") + m.joint("carriage_1", pad) + m.narrowing("table", pad, table / 4)
    )

    # Moving contacts lie between two limits. What a pad at rest gives off must leave its place; what a fast one gives
    # off spreads over its stroke, and the resistance of a place vanishes. The mean of both is taken.
    sweeping = m.half("nut_1", "y") + m.joint("nut", m.face("nut_1", "y_min"))
    side = m.size("nut_1")[0] * m.size("screw")[2]
    resting = sweeping + m.size("screw")[1] / 2 / (3 * m.k("screw") * side)  # from the flank to the section's mean
    n["nut"] = 2.0 * (1.0 / sweeping + 1.0 / resting) / 2
    sweeping = m.half("carriage_1", "z") + m.joint("guide", pad)
    width, height = m.size("rail_1")[1], m.size("rail_1")[2]
    leak = 1.0 / (m.joint("rail_1", width) + height / 2 / (m.k("rail_1") * width))  # W/(m K), of the rail to the bed
    reach = sqrt(m.k("rail_1") * m.face("rail_1", "x_min") / leak)  # m, of the rail as a fin on its joint
    warm = m.size("carriage_1")[0] + 2 * reach
    resting = (
        sweeping
        + m.half("rail_1", "z", width * m.size("carriage_1")[0])
        + 1.0 / (leak * warm)
        + m.narrowing("bed", warm * width, m.face("bed", "z_max") / 8)
    )
    n["guide"] = 2.0 * (1.0 / sweeping + 1.0 / resting) / 2

    # The screw begins behind the bearing, whose seat is where the displacement is seen from.
    n["expansion.bearing"] = machine.materials[machine.parts["bearing"].material].expansion * m.size("bearing")[0]
    return n


# What stands for what: surfaces of machine.toml -> nodes and bars.
SOURCES = {
    "motor.z_max": "motor",
    "bearing.z_max": "bearing",
    "screw.x_max": "screw.end",
    "far_block.x_min": "far_block",
}
FILMS = {
    "bed": ("bed",),
    "blocks": ("block", "block_foot", "bearing", "far_block"),
    "motor": ("motor",),
    "screw": ("screw",),
    "table": ("table", "table_rim", "carriages_rear", "carriages_front", "nut"),
}
TOLD = {
    "motor": "",
    "block": " # end plate beside the bearing and the motor",
    "block_foot": " # end plate in front of the bed",
    "bearing": "",
    "far_block": "",
    "table": " # its middle, above the nut",
    "table_rim": " # the rest of it",
    "carriages_rear": " # two of them",
    "carriages_front": "",
    "nut": " # both halves",
}


def section(text: str, begin: str, end: str) -> str:
    """The part of machine.toml between two headings, the first one included."""
    start = text.index(f"# --- {begin}")
    return text[start : text.index(f"# --- {end}", start)]


def rule(title: str) -> str:
    """A heading."""
    return f"# --- {title} ".ljust(119, "-")


def nodes_toml(machine: Machine, text: str) -> str:
    """nodes.toml of a machine; text: machine.toml."""
    n = network(machine)
    lines = [
        "# The drive of machine.toml as a node model: capacities and conductances, no mesh (paper 001, 16.3.1). Made",
        "# by make_nodes.py from the dimensions there; README.md says how. Signals, sources, films, sensors stay.",
        "",
        "[machine]",
        'name = "ball_screw_axis"',
        'description = "ball-screw feed axis as a node model: nine nodes, bed and screw as bars"',
        f'reference_temperature = "{machine.machine.reference_temperature:g} degC"',
        "",
    ]
    materials = section(text, "materials", 'body "bed"')
    lines += [materials[materials.index("[") : materials.index("[materials.motor]")].strip(), ""]
    lines += [rule("nodes and bars"), ""]
    for node, told in TOLD.items():
        pair = "carriages" if node.startswith("carriages") else node
        lines += [f"[nodes.{node}]{told}", f'capacity = "{n[f"{pair}.capacity"]:.1f} J/K"']
        lines += [f'area = "{1e4 * n[f"{pair}.area"]:.2f} cm^2"']
        if node == "nut":
            lines += ["position = [0.0, 0.0, 0.041]"]
        elif pair != node:
            lines += [f"position = [{n[node.replace('_', '.')]:g}, 0.0, 0.03]"]
        lines += [""]
    for bar, elements, height, material in (
        ("bed", 16, 0.0, "cast_iron"),
        ("screw", 2 * machine.contacts["nut"].segments, n["screw.height"], "steel"),  # half of a nut's segment
    ):
        lines += [
            f"[bars.{bar}]" + (" # with its rails" if bar == "bed" else ""),
            f'material = "{material}"',
            f"origin = [{n[f'{bar}.start']:g}, 0.0, {height:g}]",
            "direction = [1.0, 0.0, 0.0]",
            f'length = "{1e3 * n[f"{bar}.length"]:g} mm"',
            f'cross_section = "{1e4 * n[f"{bar}.section"]:.4g} cm^2"',
            *([f'perimeter = "{1e3 * n["screw.perimeter"]:.4g} mm"'] if bar == "screw" else []),
            f"elements = {elements}",
            "",
        ]
    lines += [rule("how they touch"), ""]
    for name, a, b, key in (
        ("motor", "motor", "block", "motor"),
        ("motor_foot", "motor", "block_foot", "motor_foot"),
        ("end_plate", "block", "block_foot", "block_middle"),
        ("block", "block_foot", "bed.start", "block"),
        ("bearing", "block", "bearing", "bearing"),
        ("screw", "bearing", "screw.start", "screw"),
        ("far_block", "far_block", "bed.end", "far_block"),
        ("nut_table", "nut", "table", "nut_table"),
        ("table", "table", "table_rim", "table_rim"),
        ("carriages_rear", "carriages_rear", "table_rim", "carriages"),
        ("carriages_front", "carriages_front", "table_rim", "carriages"),
    ):
        lines += [
            f"[contacts.{name}]",
            'kind = "fixed"',
            f'surfaces = ["{a}", "{b}"]',
            f'total = "{n[key]:.4g} W/K"',
            "",
        ]
    lines += [
        "[contacts.nut] # as in machine.toml: to the segment of the screw below the nut",
        'kind = "moving"',
        'axis = "x"',
        'pairs = [["screw", "nut"]]',
        f'assignment = "{machine.contacts["nut"].assignment}"',
        f'total = "{n["nut"]:.4g} W/K"',
        "",
        "[contacts.guide]",
        'kind = "moving"',
        'axis = "x"',
        'pairs = [["bed", "carriages_rear"], ["bed", "carriages_front"]]',
        f'total = "{n["guide"]:.4g} W/K" # each',
        "",
    ]
    motion = section(text, "motion", "load log")
    axis = motion[motion.index("[axes.x]") : motion.index("[contacts.nut]")].strip()
    loads = section(text, "load log", "what is watched")
    for surface, place in SOURCES.items():
        loads = loads.replace(f'"{surface}"', f'"{place}"')
    for film, places in FILMS.items():
        head = loads.index("surfaces = ", loads.index(f"[films.{film}]"))
        end = loads.index("\n", head)
        named = f"surfaces = [{', '.join(f'{chr(34)}{p}{chr(34)}' for p in places)}]"
        if film == "bed":  # its top and bottom exchange no heat
            named += f'\narea = "{1e4 * n["bed.area"]:.2f} cm^2"'
        loads = loads[:head] + named + loads[end:]
    lines += [rule("motion"), "", axis, "", loads.strip(), ""]
    watched = section(text, "what is watched", "structure")
    for sensor, part, inside in (
        ("fixed_bearing", "block", False),
        ("nut", "nut", False),
        ("table", "table_rim", False),
        ("motor", "motor", False),
        ("bed", "bed", True),
        ("screw", "screw", True),
    ):
        head = watched.index("part = ", watched.index(f"[sensors.{sensor}]"))
        end = watched.index("\n\n", head)
        place = watched[watched.index("position", head) : end]
        watched = watched[:head] + f'part = "{part}"' + (f"\n{place}" if inside else "") + watched[end:]
    lines += [watched.strip(), "", rule("what it does to the table"), "", "[tcp.expansion]"]
    lines += [f'bearing = ["{1e6 * n["expansion.bearing"]:.4g} um/K", "0 um/K", "0 um/K"]']
    lines += ["", "[tcp.screws]", 'screw = "tool"', "", text[text.index("[poses]") :].strip(), ""]
    return "\n".join(lines)


def main() -> None:
    text = (FOLDER / "machine.toml").read_text(encoding="utf-8")
    target = FOLDER / "nodes.toml"
    target.write_text(nodes_toml(load_machine(FOLDER / "machine.toml"), text), encoding="utf-8")
    print(target)


if __name__ == "__main__":
    main()

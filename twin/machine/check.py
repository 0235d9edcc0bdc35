"""What looks wrong in a description although every value is allowed: materials off by powers of ten, unused names.

Checks that need meshes are in `twin.build.check_meshes`; `twin check` makes both.
"""

from __future__ import annotations

from collections.abc import Iterator

from twin.errors import Problem
from twin.machine.check_bounds import beyond_at_bounds
from twin.machine.check_lumped import lumped_oddities
from twin.machine.description import Machine, Material
from twin.machine.size import asked
from twin.machine.wiring import law_use
from twin.physics.laws import LAWS

# From polymers and foams to copper, diamond tools and Invar: wide enough for what machines are made of, narrow enough
# to catch a factor 1000 (W/(mm K) for W/(m K), t/mm^3, MPa for Pa). Metals are bounded more closely.
_BANDS: dict[str, tuple[float, float, str]] = {
    "conductivity": (0.02, 2500.0, "W/(m*K)"),
    "density": (15.0, 23_000.0, "kg/m^3"),
    "heat_capacity": (100.0, 5000.0, "J/(kg*K)"),
    "youngs_modulus": (1e6, 1.3e12, "Pa"),
    "expansion": (-2e-6, 3e-4, "1/K"),
}
_METAL = {  # density above 2600 kg/m^3: metals, ceramics, mineral casting is below
    "conductivity": (1.0, 450.0, "W/(m*K)"),
    "heat_capacity": (110.0, 1100.0, "J/(kg*K)"),
    "youngs_modulus": (1e10, 8e11, "Pa"),
    "expansion": (-1e-6, 4e-5, "1/K"),
}
_FACTORS = (1e3, 1e-3, 1e6, 1e-6, 1e9, 1e-9, 1e12, 1e-12)


def check_machine(machine: Machine) -> list[Problem]:
    """Errors for values that a mistaken unit explains, warnings for the merely unusual and for what nobody uses."""
    problems: list[Problem] = []
    for name, material in machine.materials.items():
        problems += _material(name, material)
    problems += lumped_oddities(machine) if machine.lumped else _without_tcp(machine)
    problems += _joints(machine)
    problems += _encoders(machine)
    problems += _unused(machine)
    problems += asked(machine)
    problems += beyond_at_bounds(machine)
    return problems


def _without_tcp(machine: Machine) -> Iterator[Problem]:
    """What nothing reads in a machine of parts that describes no TCP."""
    if machine.has_tcp:
        return
    unread = [f"supports.{name}" for name in machine.supports]
    unread += [
        f"contacts.{name}.stiffness" for name, c in machine.contacts.items() if "stiffness" in c.model_fields_set
    ]
    unread += [f"poses.{name}" for name in machine.poses]
    if unread:
        what = f"without a TCP nothing reads {', '.join(unread[:4])}" + (" ..." if len(unread) > 4 else "")
        remedy = "describe [tcp.tool] and [tcp.work]; or leave it: temperatures are computed all the same"
        yield Problem(what, "machine.toml: tcp", remedy, warning=True)


def _encoders(machine: Machine) -> Iterator[Problem]:
    """Scales whose expansion no material has."""
    low, high, unit = _BANDS["expansion"]
    for name, axis in machine.axes.items():
        value = axis.encoder.expansion
        if axis.encoder.kind == "linear" and not low <= value <= high:
            what = f"{value:g} {unit} is outside {low:g} .. {high:g} of such materials"
            remedy = 'steel has "11.7e-6 1/K", glass "8e-6 1/K"'
            yield Problem(what, f"machine.toml: axes.{name}.encoder.expansion", remedy)


def _joints(machine: Machine) -> Iterator[Problem]:
    """Joint laws outside their validity: a joint is evaluated once, so no step of a run can flag it."""
    for name, contact in machine.contacts.items():
        if contact.joint is None:
            continue
        law, where = LAWS[contact.joint.law], f"contacts.{name}.joint"
        use = law_use(contact.joint.law, "joint", contact.joint.parameters, {}, where, machine)
        values = {n: use.parameters.get(n, a.default) for n, a in law.parameters.items()}
        if law.validity and not bool(law.validity.holds(**values)):
            remedy = f"check its parameters with twin losses --explain contacts.{name}, or give a conductance"
            what = f"outside the validity of its law: {law.validity.text}"
            yield Problem(what, f"machine.toml: {where}", remedy, warning=True)


def _material(name: str, material: Material) -> Iterator[Problem]:
    bands = _BANDS | (_METAL if material.density > 2600.0 else {})
    for key, (low, high, unit) in bands.items():
        value = getattr(material, key)
        if key not in material.model_fields_set:
            continue  # what only a TCP needs
        if low <= value <= high:
            continue
        where = f"machine.toml: materials.{name}.{key}"
        what = f"{value:g} {unit} is outside {low:g} .. {high:g} of such materials"
        factor = next((f for f in _FACTORS if low <= value * f <= high), None)
        if factor is None:
            yield Problem(what, where, "check the value and its unit; leave it if it is right", warning=True)
        else:
            off = f"{1 / factor:g}" if factor < 1 else f"1/{factor:g}"
            remedy = f'off by a factor {off}? {value * factor:g} {unit} would fit; write the unit: {key} = "... {unit}"'
            yield Problem(what, where, remedy)


def _unused(machine: Machine) -> Iterator[Problem]:
    used_materials = {p.material for p in machine.parts.values()} | {b.material for b in machine.bars.values()}
    used_materials |= {n.material for n in machine.nodes.values() if n.material is not None}
    used_signals = {a.position for a in machine.axes.values()} | {e.signal for e in machine.environment.values()}
    used_signals |= {e.switch for e in machine.environment.values()}
    used_signals |= {s for source in machine.sources.values() for s in source.signals.values()}
    used_signals |= {s for film in machine.films.values() for s in film.signals.values()}
    used_signals |= {c.switch for c in machine.contacts.values()}
    used_environments = {f.environment for f in machine.films.values()} | {
        s.environment for s in machine.sensors.values()
    }
    used_environments |= {f.radiant for f in machine.films.values()}
    for section, names, used in (
        ("materials", machine.materials, used_materials),
        ("signals", machine.signals, used_signals),
        ("environment", machine.environment, used_environments),
    ):
        for name in names:
            if name not in used:
                where = f"machine.toml: {section}.{name}"
                yield Problem("nothing uses it", where, "remove it, or wire it to what it drives", warning=True)

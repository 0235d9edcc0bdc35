"""What a TCP needs to know of a machine of parts besides its temperatures: elastic constants, and what holds the parts.

A machine without a TCP is a thermal problem, and needs neither.
"""

from __future__ import annotations

from collections.abc import Iterator

from twin.errors import Problem
from twin.machine.bodies import bodies_of, body_of, owner_of
from twin.machine.description import Machine

_ELASTIC = {"youngs_modulus": '"120 GPa"', "poisson_ratio": "0.26", "expansion": '"10e-6 1/K"'}


def elastic_constants(machine: Machine) -> Iterator[Problem]:
    """What a TCP needs to know of the materials of parts; without one, temperatures are computed alone."""
    made: dict[str, list[str]] = {}
    for name, part in machine.parts.items() if machine.has_tcp else ():
        if part is not None and machine.materials.get(part.material) is not None:
            made.setdefault(part.material, []).append(name)
    for name, parts in made.items():
        shown = f"parts.{parts[0]} is" if len(parts) == 1 else f"parts.{parts[0]} and {len(parts) - 1} more are"
        for key, example in _ELASTIC.items():
            if key not in machine.materials[name].model_fields_set:
                remedy = f"{shown} made of it and may move the TCP: write {key} = {example}; or describe no [tcp]"
                yield Problem(f"missing key '{key}'", f"materials.{name}.{key}", remedy)


def held_by_a_gap(machine: Machine) -> Iterator[Problem]:
    """Parts that only a gap joins: with a TCP it must be known what holds the one in front of the other."""
    gaps = {name: c for name, c in machine.contacts.items() if c.kind == "fixed" and not c.glues}
    if not gaps or not machine.has_tcp:
        return
    glued = {name: c for name, c in machine.contacts.items() if name not in gaps}
    bodies = bodies_of(machine.model_copy(update={"contacts": glued}))
    for name, contact in gaps.items():
        a, b = (owner_of(s) for s in contact.surfaces or ())
        if body_of(bodies, a) != body_of(bodies, b):
            remedy = "join the parts by fixed contacts without a gap, directly or through others; or describe no [tcp]"
            yield Problem(f"nothing but the gap holds '{a}' in front of '{b}'", f"contacts.{name}.gap", remedy)

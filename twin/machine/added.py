"""Do the switches of contacts, the tanks and the scales of a description make sense? What can be told without meshes.

As in `references`, entries that are themselves broken are None, and names that point at them are not reported again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from twin.errors import Problem, TwinError
from twin.machine.description import Machine
from twin.machine.wiring import expect_switch
from twin.nearest import did_you_mean

# A surface, node or bar and where it is named, to what is wrong with it
Place = Callable[[str, str], Iterator[Problem]]


def added_problems(machine: Machine, place: Place) -> Iterator[Problem]:
    """Problems of switched contacts, tanks and scales; `place` judges the surfaces, nodes and bars they name."""
    yield from _switches(machine)
    for name, tank in machine.tanks.items():
        if tank is not None:
            yield from place(tank.surface, f"tanks.{name}.surface")
    linear = [n for n, a in machine.axes.items() if a is None or a.kind == "linear"]
    for name, scale in machine.scales.items():
        if scale is None:
            continue
        yield from place(scale.surface, f"scales.{name}.surface")
        if scale.axis not in linear:
            remedy = did_you_mean(scale.axis, linear, "linear axes")
            yield Problem(f"'{scale.axis}' is not a linear axis", f"scales.{name}.axis", remedy)


def _switches(machine: Machine) -> Iterator[Problem]:
    for name, contact in machine.contacts.items():
        if contact is None:
            continue
        where = f"contacts.{name}.switch"
        if (contact.switch is None) != (contact.switched is None):
            remedy = 'switch = "clamped" and switched = 2.5, the factor of the conductance, or neither'
            yield Problem("a switch and what it switches belong together", where, remedy)
        if contact.switch is not None:
            try:
                expect_switch(contact.switch, where, machine)
            except TwinError as e:
                yield from e.problems

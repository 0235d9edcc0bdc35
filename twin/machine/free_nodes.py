"""Nodes beside parts: bodies of one temperature that no contact touches, such as a probe holder in the air.

They exchange heat by films and get it from sources, as the nodes of a lumped machine, and move the tool by their rows
in `[tcp.expansion]`. What touches a part is a tank (`[tanks.NAME]`) or a part of its own.
"""

from __future__ import annotations

from collections.abc import Iterator

from twin.errors import Problem
from twin.machine.description import Film, Machine, Node
from twin.nearest import did_you_mean


def free_nodes(machine: Machine) -> dict[str, Node]:
    """The nodes of a machine of parts; none of a lumped machine, whose nodes are all it has."""
    return machine.nodes if machine.parts else {}


def on_parts(machine: Machine, film: Film) -> tuple[str, ...]:
    """The surfaces of a film that are no free nodes."""
    return tuple(s for s in film.surfaces if s not in free_nodes(machine))


def free_node_problems(machine: Machine) -> Iterator[Problem]:
    """Problems of nodes beside parts. As in `references`, entries that are broken are None."""
    for name in machine.bars:
        remedy = "a machine has meshes, or nodes and bars: describe the bar as a part"
        yield Problem("both parts and bars", f"bars.{name}", remedy)
    films = [film for film in machine.films.values() if film is not None]
    filmed = [s for film in films for s in film.surfaces]
    graded = {name for name, e in machine.environment.items() if e is not None and e.gradient != 0.0}
    for name, node in machine.nodes.items():
        where = f"nodes.{name}"
        if name in machine.parts:
            yield Problem(f"'{name}' is also a part", where, "give each part and node a name of its own")
        if node is None:
            continue
        if node.capacity is None:
            yield Problem("a node beside parts without a capacity", where, 'write capacity = "1200 J/K"')
        if node.area is None:
            yield Problem(f"node '{name}' has a film but no area", where, 'add area = "0.1 m^2"')
        if filmed.count(name) != 1:
            remedy = "nothing else takes heat from it: put it into the surfaces of one film"
            yield Problem(f"node '{name}' is in {filmed.count(name) or 'no'} films", where, remedy)
        if any(name in f.surfaces and graded & {f.environment, f.radiant} for f in films):
            remedy = "put it into a film with air of one temperature"
            yield Problem(f"node '{name}' has no height, and its air is warmer above", where, remedy)
    yield from _moving(machine)


def _moving(machine: Machine) -> Iterator[Problem]:
    if machine.tcp is None:
        return
    for name in machine.tcp.expansion:
        if name not in machine.nodes:
            remedy = did_you_mean(name, machine.nodes, "nodes") if machine.nodes else "the meshes know it: remove it"
            yield Problem(f"'{name}' is no node: parts move the tool as they grow", f"tcp.expansion.{name}", remedy)

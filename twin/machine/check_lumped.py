"""What looks wrong in nodes, bars and contacts of a lumped machine although every value is allowed."""

from __future__ import annotations

import math
from collections.abc import Iterator

from twin.errors import Problem
from twin.machine.bodies import owner_of
from twin.machine.description import Film, Machine

LIGHTEST = 0.5  # J/K: one gram of steel
HEAVIEST = 2.5e8  # J/K: 500 t
VOLUMETRIC = 3.6e6  # J/(m^3 K), of steel and cast iron; polymers, aluminium and water are within a factor 2
THINNEST = 1e-4  # m, and
THICKEST = 5.0  # m: of a wall whose two sides are the node's area
TIGHTEST = 0.1  # s: time in which two nodes become one
LARGEST = 50.0  # m
GROWTH = 2e-4  # m/K: ten metres of aluminium


def total_capacity(machine: Machine) -> float:
    """J/K of all nodes, bars and tanks."""
    nodes = sum(node_capacity(machine, name) for name in machine.nodes)
    bars = sum(bar_capacity(machine, name) for name in machine.bars)
    return nodes + bars + sum(tank.capacity for tank in machine.tanks.values())


def node_capacity(machine: Machine, name: str) -> float:
    """J/K, given or of its mass or volume."""
    node = machine.nodes[name]
    if node.capacity is not None:
        return node.capacity
    material = machine.materials[str(node.material)]
    mass = node.mass if node.mass is not None else material.density * float(node.volume or 0.0)
    return mass * material.heat_capacity


def bar_capacity(machine: Machine, name: str) -> float:
    """J/K."""
    bar = machine.bars[name]
    material = machine.materials[bar.material]
    return material.density * material.heat_capacity * bar.cross_section * bar.length


def lumped_oddities(machine: Machine) -> Iterator[Problem]:
    """Errors for what cannot be, warnings for the merely unusual."""
    yield from _nodes(machine)
    yield from _bars(machine)
    yield from _contacts(machine)
    for place, row in machine.tcp.expansion.items():
        largest = max(abs(v) for v in row)
        if largest > GROWTH:
            what = f"{largest * 1e6:.4g} um/K is more than ten metres of aluminium grow"
            remedy = 'numbers are m/K: write "3.2 um/K"'
            yield _problem(what, f"tcp.expansion.{place}", remedy, warning=largest < 1e-2)
    if not (machine.tcp.expansion or machine.tcp.screws or machine.tcp.platform):
        remedy = "give [tcp.expansion] or [tcp.screws], or leave it: temperatures are computed all the same"
        yield _problem("no temperature moves the tool", "tcp", remedy)


def _problem(what: str, where: str, remedy: str, warning: bool = True) -> Problem:
    return Problem(what, f"machine.toml: {where}", remedy, warning=warning)


def _nodes(machine: Machine) -> Iterator[Problem]:
    for name, node in machine.nodes.items():
        capacity = node_capacity(machine, name)
        if not LIGHTEST <= capacity <= HEAVIEST:
            what = f"{capacity:.4g} J/K is that of {capacity / 470.0:.3g} kg of steel"
            yield _problem(what, f"nodes.{name}", "check the number and its unit (J/K, kg, m^3)")
        elif node.area is not None:
            wall = capacity / VOLUMETRIC / node.area
            if not THINNEST <= wall <= THICKEST:
                what = f"an area of {node.area:.4g} m^2 makes its {capacity:.4g} J/K a wall of {wall * 1e3:.3g} mm"
                yield _problem(what, f"nodes.{name}.area", "check capacity and area, and their units")


def _bars(machine: Machine) -> Iterator[Problem]:
    for name, bar in machine.bars.items():
        circle = math.sqrt(4.0 * math.pi * bar.cross_section)
        if bar.perimeter is not None and bar.perimeter < circle * 0.98:  # numbers are rounded
            what = f"a perimeter of {bar.perimeter:.4g} m cannot hold a cross-section of {bar.cross_section:.4g} m^2"
            remedy = f"a circle has {circle:.4g} m, everything else more: check both and their units"
            yield _problem(what, f"bars.{name}.perimeter", remedy, warning=False)
        if bar.length > LARGEST or circle > LARGEST:
            shown = f"{bar.length:.4g} m by {bar.cross_section:.4g} m^2"
            yield _problem(f"a bar of {shown}", f"bars.{name}", 'lengths are in m: write "800 mm"', warning=False)
        elif bar.length < math.sqrt(bar.cross_section):
            what = f"a bar of {bar.length:.4g} m is shorter than it is thick"
            yield _problem(what, f"bars.{name}", "a node would do; check length and cross_section")


def _contacts(machine: Machine) -> Iterator[Problem]:
    for name, contact in machine.contacts.items():
        conductance = contact.total
        if conductance is None and contact.conductance is not None and contact.area is not None:
            conductance = contact.conductance * contact.area
        if conductance is None or contact.surfaces is None:
            continue
        lighter = min(
            node_capacity(machine, n) if n in machine.nodes else bar_capacity(machine, n) / machine.bars[n].elements
            for n in map(owner_of, contact.surfaces)
        )
        if lighter / conductance < TIGHTEST:
            what = f"{conductance:.4g} W/K make its two sides one within {lighter / conductance:.2g} s"
            yield _problem(what, f"contacts.{name}", "check the number and its unit (W/K), or make the two one node")


def film_area(machine: Machine, film: Film, place: str) -> float:
    """m^2 of one node or bar through which a film exchanges heat: the film's own, else all the node or bar has."""
    if film.area is not None:
        return film.area
    if place in machine.nodes:
        return float(machine.nodes[place].area or 0.0)
    bar = machine.bars[place]
    return float(bar.perimeter or 0.0) * bar.length

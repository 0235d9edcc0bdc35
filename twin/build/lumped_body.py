"""Nodes and bars as numbers: capacities, conduction, areas and places of the states of one body of a lumped machine.

A node is one state. A bar is a rod in one dimension, divided into elements of equal length with linear temperatures;
its states are the temperatures of the element borders, so that contacts meet its ends and heat flows into them without
an extra resistance. Capacities and film areas are lumped at the borders (trapezoid rule): second order in the element
length, as with full element matrices, and free of their undershoots. Lumped models of axes were used in paper 001
(1.20: "capacity-conductance" node model).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from twin.machine.bodies import Body, owner_of, tank_of, tanks_on
from twin.machine.check_lumped import bar_capacity, film_area, node_capacity
from twin.machine.description import Bar, Film, Machine


@dataclass(frozen=True)
class LumpedBody:
    """The states of a body: members one after the other, its tanks ("tanks.NAME") last."""

    name: str
    members: tuple[str, ...]
    first: tuple[int, ...]  # of each member
    n: int

    def __contains__(self, place: str) -> bool:
        return owner_of(place) in self.members

    def states(self, member: str, machine: Machine) -> slice:
        """Where a node or bar is among the states."""
        first = self.first[self.members.index(member)]
        return slice(first, first + count(machine, member))


def lumped_body(machine: Machine, body: Body) -> LumpedBody:
    """Number the states of a body."""
    members = (*body.parts, *tanks_on(machine, body.parts))
    ends = np.cumsum([0, *(count(machine, member) for member in members)])
    return LumpedBody(body.name, members, tuple(int(e) for e in ends[:-1]), int(ends[-1]))


def count(machine: Machine, member: str) -> int:
    """How many states a node, bar or tank has."""
    return machine.bars[member].elements + 1 if member in machine.bars else 1


def borders(bar: Bar) -> np.ndarray:
    """Element borders (elements + 1,) [m] from the bar's start."""
    return np.linspace(0.0, bar.length, bar.elements + 1)


def unit(bar: Bar) -> np.ndarray:
    """Unit direction (3,) from start to end."""
    d = np.asarray(bar.direction, dtype=float)
    return d / np.linalg.norm(d)


def shares(bar: Bar) -> np.ndarray:
    """(elements + 1,) share of the bar's length at each border; sums to 1. Exact mean of a linear temperature."""
    share = np.full(bar.elements + 1, 1.0 / bar.elements)
    share[[0, -1]] /= 2.0
    return share


def capacity(machine: Machine, member: str) -> np.ndarray:
    """J/K per state of a node, bar or tank."""
    if member in machine.bars:
        return bar_capacity(machine, member) * shares(machine.bars[member])
    if tank := tank_of(machine, member):
        return np.array([tank.capacity])
    return np.array([node_capacity(machine, member)])


def conduction(machine: Machine, body: LumpedBody) -> sp.csr_array:
    """W/K (n, n): the conduction along the bars of a body, and to its tanks."""
    rows, columns, values = [], [], []
    for member in body.members:
        if member in machine.bars:
            bar = machine.bars[member]
            g = machine.materials[bar.material].conductivity * bar.cross_section * bar.elements / bar.length
            left = body.states(member, machine).start + np.arange(bar.elements)
            for i, j, sign in ((left, left, 1), (left + 1, left + 1, 1), (left, left + 1, -1), (left + 1, left, -1)):
                rows.append(i)
                columns.append(j)
                values.append(np.full(bar.elements, sign * g))
    for member, tank in tanks_on(machine, body.members).items():  # against the mean of the place: `twin.build.tanks`
        apart = row(machine, body, tank.surface)
        apart[body.states(member, machine)] = -1.0
        states = np.flatnonzero(apart)
        rows.append(np.repeat(states, len(states)))
        columns.append(np.tile(states, len(states)))
        values.append(tank.conductance * np.outer(apart[states], apart[states]).ravel())
    if not rows:
        return sp.csr_array((body.n, body.n))
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return sp.csr_array(sp.coo_array(entries, (body.n, body.n)))


def film_areas(machine: Machine, film: Film, body: LumpedBody) -> np.ndarray:
    """m^2 (n,) per state of a body through which a film exchanges heat."""
    areas = np.zeros(body.n)
    for place in film.surfaces:
        if place in body:
            areas[body.states(place, machine)] += film_area(machine, film, place) * mean(machine, place)
    return areas


def mean(machine: Machine, place: str) -> np.ndarray:
    """Weights over the states of the place's owner whose sum is its mean temperature: of a node, a bar, or a bar's end.

    Heat into the place is spread by the same weights.
    """
    owner, _, end = place.partition(".")
    if owner in machine.nodes:
        return np.ones(1)
    bar = machine.bars[owner]
    if not end:
        return shares(bar)
    weights = np.zeros(bar.elements + 1)
    weights[0 if end == "start" else -1] = 1.0
    return weights


def at(bar: Bar, point: np.ndarray) -> np.ndarray:
    """Weights (elements + 1,) of the temperature at a point (3,) [m], projected on the bar, its ends at most."""
    s = float(np.clip((point - np.asarray(bar.origin)) @ unit(bar), 0.0, bar.length)) / bar.length * bar.elements
    left = min(int(s), bar.elements - 1)
    weights = np.zeros(bar.elements + 1)
    weights[[left, left + 1]] = left + 1 - s, s - left
    return weights


def row(machine: Machine, body: LumpedBody, place: str, weights: np.ndarray | None = None) -> np.ndarray:
    """`weights` over the states of the place's owner, `mean` by default, as (n,) over those of the body."""
    result = np.zeros(body.n)
    result[body.states(owner_of(place), machine)] = mean(machine, place) if weights is None else weights
    return result


def heights(machine: Machine, body: LumpedBody) -> np.ndarray:
    """m (n,): vertical machine coordinate of each state at axis positions zero; 0 of tanks and nodes without one."""
    up = "xyz".index(machine.machine.vertical)
    result = np.zeros(body.n)
    for member in body.members:
        if member in machine.bars:
            bar = machine.bars[member]
            result[body.states(member, machine)] = bar.origin[up] + borders(bar) * unit(bar)[up]
        elif member in machine.nodes:
            result[body.states(member, machine)] = (machine.nodes[member].position or (0.0, 0.0, 0.0))[up]
    return result

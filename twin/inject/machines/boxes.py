"""Boxes in machine coordinates and in those of a linear axis, and the divisions of their meshes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

Triple = tuple[int, int, int]
Role = Literal["main", "foot", "rail", "carriage", "screw", "nut", "block", "motor"]
LETTERS = "xyz"


@dataclass(frozen=True)
class Solid:
    """A part: a box of one material [mm], in machine coordinates."""

    name: str
    role: Role
    material: str
    origin: Triple
    size: Triple
    adiabatic: tuple[str, ...] = ()
    divisions: Triple = (1, 1, 1)

    @property
    def end(self) -> Triple:
        return _triple(np.add(self.origin, self.size))

    @property
    def middle(self) -> Triple:
        return _triple(np.add(self.origin, self.end) // 2)


@dataclass(frozen=True)
class Frame:
    """Coordinates of a linear axis on the face of a part: along the axis, across it, and away from the face [mm].

    along, across, normal: indices of the machine coordinates; upward: whether normal points along +.
    """

    origin: Triple
    along: int
    across: int
    normal: int
    upward: bool = True

    def solid(self, name: str, role: Role, material: str, start: Triple, size: Triple) -> Solid:
        """A box that begins at `start` and has `size`, both along, across and normal."""
        low, extent = list(self.origin), [0, 0, 0]
        for index, s, e in zip((self.along, self.across, self.normal), start, size, strict=True):
            extent[index] = e
            low[index] += s if index != self.normal or self.upward else -s - e
        return Solid(name, role, material, _triple(low), _triple(extent))

    def face(self, away: bool) -> str:
        """The surface of a box whose normal points away from the face that the axis lies on, or towards it."""
        return f"{LETTERS[self.normal]}_{'max' if away == self.upward else 'min'}"

    def end(self, far: bool) -> str:
        """The surface of a box at its far or near end along the axis."""
        return f"{LETTERS[self.along]}_{'max' if far else 'min'}"


def with_divisions(solids: Sequence[Solid], nodes: int) -> tuple[Solid, ...]:
    """The solids with divisions of about equal length that give as many nodes as `nodes` allows.

    A box of n1 n2 n3 divisions has (2 n1 + 1)(2 n2 + 1)(2 n3 + 1) nodes of quadratic elements.
    """
    found = tuple(solids)
    for length in np.geomspace(400.0, 40.0, 40):  # mm, of an element
        finer = tuple(replace(s, divisions=_divided(s, float(length))) for s in solids)
        if sum(node_count(s) for s in finer) > nodes:
            break
        found = finer
    return found


def node_count(solid: Solid) -> int:
    return int(np.prod([2 * n + 1 for n in solid.divisions]))


def _divided(solid: Solid, length: float) -> Triple:
    """Rails and screws are slender: one element across, half as long ones along."""
    if solid.role in ("rail", "screw"):
        long = int(np.argmax(solid.size))
        return _triple([max(4, round(2.0 * e / length)) if i == long else 1 for i, e in enumerate(solid.size)])
    return _triple([max(1, round(e / length)) for e in solid.size])


def _triple(values: Sequence[int] | np.ndarray) -> Triple:
    a, b, c = (int(v) for v in values)
    return a, b, c

"""The kinematic chain from the workpiece to the tool, written as in ISO 10791-6: "w-C-B-Z-b-X-Y-t".

w is the workpiece, b the bed, t the tool; capital letters between are axes: X, Y, Z linear along the machine
coordinates, A, B, C rotary about them. Axes between w and b move the workpiece, those between b and t the tool.
Positions count the motion of what the axis carries along the machine coordinate; a prime (Z') marks the opposite, as of
an axis that carries the workpiece and whose position is the tool's as seen from there (ISO 841), or one that turns
left-handed.
"""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass

import numpy as np

from twin.errors import ModelError
from twin.rom.artefact import Artefact
from twin.run.correction_axes import axis_jacobian

LINEAR, ROTARY = "XYZ", "ABC"
EXAMPLE = "w-C-B-Z-b-X-Y-t"
_ALONG = 1e-6  # how far a direction may be off its coordinate


@dataclass(frozen=True)
class ChainAxis:
    """One axis of a chain."""

    letter: str  # X, Y, Z, or A, B, C
    side: int  # 1 where it carries the tool, -1 where it carries the workpiece
    sense: int = 1  # -1 where positive positions move what it carries against the machine coordinate

    @property
    def coordinate(self) -> int:
        """0, 1, 2: the machine coordinate it moves along or turns about."""
        return (LINEAR + ROTARY).index(self.letter) % 3


@dataclass(frozen=True)
class Chain:
    """Axes of a machine. Rotary axes stand between the linear ones and the workpiece."""

    linear: tuple[ChainAxis, ...]  # from the tool to the workpiece
    rotary: tuple[ChainAxis, ...]  # from the linear axes to the workpiece

    def __str__(self) -> str:
        def name(axis: ChainAxis) -> str:
            return axis.letter + "'" * (axis.sense < 0)

        tool = [name(a) for a in self.linear if a.side > 0]
        work = [name(a) for a in (*self.linear, *self.rotary) if a.side < 0]
        return "-".join(["w", *reversed(work), "b", *reversed(tool), "t"])


def parse_chain(text: str, where: str = "--chain") -> Chain:
    """The chain in a string such as "w-C-B-Z-b-X-Y-t".

    Raises ModelError for other letters or orders, axes named twice, and rotary axes that carry the tool or a linear
    axis: the probe must not turn, and what a linear axis' error does would change with the angle.
    """
    remedy = f"write it from workpiece over bed to tool, for example {EXAMPLE}"
    axes = _axes(text)
    if axes is None:
        raise ModelError(f"'{text}' is no kinematic chain", where, remedy)
    letters = [a.letter for a in axes]
    if len(set(letters)) < len(letters):
        raise ModelError(f"an axis stands twice in '{text}'", where, remedy)
    linear = tuple(a for a in axes if a.letter in LINEAR)
    rotary = tuple(a for a in axes if a.letter in ROTARY)
    if not linear:
        raise ModelError(f"no linear axis in '{text}'", where, remedy)
    if axes[: len(linear)] != list(linear) or any(a.side > 0 for a in rotary):
        what = f"in '{text}' a rotary axis carries the tool or a linear axis"
        raise ModelError(what, where, "this is for machines whose rotary axes are those of the table")
    return Chain(linear, rotary)


def _axes(text: str) -> list[ChainAxis] | None:
    """The axes of a chain from the tool to the workpiece; None where w, b, t or other letters stand wrong."""
    links = [link.strip() for link in text.split("-")]
    if len(links) < 3 or links[0] != "w" or links[-1] != "t" or links.count("b") != 1:
        return None
    bed = links.index("b")
    axes = []
    for k, link in enumerate(links[1:-1], start=1):
        if k == bed:
            continue
        if not re.fullmatch("[XYZABC]'?", link):
            return None
        axes.append(ChainAxis(link[0], 1 if k > bed else -1, -1 if link.endswith("'") else 1))
    return axes[::-1]


def chain_of(artefact: Artefact) -> Chain:
    """The chain of the machine in an artefact: linear axes from its wiring, rotary axes from its description.

    Rotary axes are taken in the order of the description, the first one next to the linear axes.
    Raises ModelError for linear axes that are not called x, y, z or do not lie along that coordinate.
    """
    model = artefact.model
    wiring = {a.name: a for a in model.load_model.axes}
    jacobian = axis_jacobian(artefact, list(wiring))
    linear = []
    for name, column in zip(wiring, jacobian.T, strict=True):
        direction = np.array(wiring[name].direction)
        letter = name.upper()
        if letter not in LINEAR or not np.isclose(abs(direction[LINEAR.index(letter)]), 1.0, atol=_ALONG):
            raise ModelError(
                f"axis '{name}' is not one of x, y, z along its coordinate",
                "axes",
                f"give the chain and columns of these names instead: --chain {EXAMPLE}",
            )
        sense = int(np.sign(direction[LINEAR.index(letter)]))
        linear.append(ChainAxis(letter, int(np.sign(column @ direction)), sense))
    depth = _depths(artefact)
    linear.sort(key=lambda a: -a.side * depth[a.letter.lower()])  # tool side: the last axis first
    rotary = []
    for name, axis in tomllib.loads(artefact.description).get("axes", {}).items():
        if axis.get("kind") == "rotary" and name.upper() in ROTARY:
            along = np.array(axis["direction"], dtype=float)[ROTARY.index(name.upper())]
            rotary.append(ChainAxis(name.upper(), -1, -1 if along < 0.0 else 1))
    return Chain(tuple(linear), tuple(rotary))


def _depths(artefact: Artefact) -> dict[str, int]:
    """Per linear axis how many linear axes carry it, plus one: 1 for those that stand on the bed."""
    model = artefact.model
    load = model.load_model
    body_of_port = {port: body.name for body in model.bodies for port in body.ports}
    carrier: dict[str, tuple[str, str]] = {}  # body -> (axis that moves it, body it runs on)
    for pair in load.pairs:
        rail, pad = body_of_port[load.rails[pair.rail].first_port], body_of_port[pair.pad_port]
        moving, standing = (rail, pad) if pair.rail_moves else (pad, rail)
        carrier[moving] = (load.axes[pair.axis].name, standing)
    depths = {}
    for axis, standing in carrier.values():
        depth, body = 1, standing
        while body in carrier and depth <= len(carrier):
            depth, body = depth + 1, carrier[body][1]
        depths[axis] = depth
    return depths

"""Six struts that carry a platform: do they make a machine?"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np

from twin.errors import ModelError, Problem
from twin.machine.description import Machine
from twin.machine.kinematics import linear_axes
from twin.machine.tcp import Strut
from twin.nearest import did_you_mean
from twin.rom.parallel import Geometry, worst_condition

NUMBER = 6
ALONG = 1e-3  # rad between an axis and its strut at positions zero
WORST = 100.0  # condition of the struts: a strut's error of 1 um may then move the tool by 100 um


def struts_of(machine: Machine) -> tuple[Strut, ...]:
    """The struts in the order of their axes."""
    by_axis = {strut.axis: strut for strut in machine.struts.values()}
    return tuple(by_axis[axis] for axis in linear_axes(machine))


def geometry_of(machine: Machine) -> Geometry:
    """Joints in the order of the axes. For a description that is sound."""
    struts, platform = struts_of(machine), machine.tcp.platform
    assert platform is not None
    base, joint = (np.array([getattr(s, key) for s in struts], dtype=float) for key in ("base", "joint"))
    return Geometry(np.array(platform.point, dtype=float), base, joint)


def platform_problems(machine: Machine) -> Iterator[Problem]:
    """Problems of struts and platform by themselves; those of the places they name, too."""
    platform = machine.tcp.platform if machine.tcp is not None else None
    if platform is None:
        if machine.struts:
            remedy = "add [tcp.platform] with the point of the tool"
            yield Problem("struts without a platform", f"struts.{next(iter(machine.struts))}", remedy)
        return
    if machine.parts:
        remedy = "describe it by [nodes.NAME] and [bars.NAME]: struts carry a platform of a lumped machine"
        yield Problem("a platform on struts in a machine with meshes", "tcp.platform", remedy)
        return
    if machine.tcp is not None and machine.tcp.screws:
        yield Problem("screws beside a platform", "tcp.screws", "name each in its [struts.NAME] instead")
    if machine.scales:
        remedy = "give what it does as the growth of its strut"
        yield Problem("a scale of a platform on struts", f"scales.{next(iter(machine.scales))}", remedy)
    for key, place in (("moving", platform.moving), ("frame", platform.frame)):
        if place is not None:
            yield from _spreading(place, f"tcp.platform.{key}", machine)
    if None in machine.struts.values() or None in machine.axes.values():
        return
    for name, strut in machine.struts.items():
        yield from _strut(name, strut, machine)
    linear = linear_axes(machine)
    if sorted(s.axis for s in machine.struts.values()) != sorted(linear) or len(linear) != NUMBER:
        remedy = "a platform has six struts, each with an axis of its own, and no other linear axes"
        yield Problem(f"{len(machine.struts)} struts and {len(linear)} linear axes", "struts", remedy)


def _spreading(place: str, where: str, machine: Machine) -> Iterator[Problem]:
    node = machine.nodes.get(place)
    if place not in machine.nodes:
        yield Problem(f"no node '{place}'", where, did_you_mean(place, machine.nodes, "nodes"))
    elif node is not None and node.material is None:
        remedy = 'give it a material and a mass instead of a capacity: material = "steel", mass = "20 kg"'
        yield Problem(f"node '{place}' has no material to expand", f"nodes.{place}", remedy)
    elif node is not None:
        yield from _expands(place, str(node.material), machine)


def _expands(place: str, material: str, machine: Machine) -> Iterator[Problem]:
    entry = machine.materials.get(material)
    if entry is not None and "expansion" not in entry.model_fields_set:
        remedy = f"'{place}' is made of it: write expansion = \"11.5e-6 1/K\""
        yield Problem("missing key 'expansion'", f"materials.{material}.expansion", remedy)


def _strut(name: str, strut: Strut, machine: Machine) -> Iterator[Problem]:
    where = f"struts.{name}"
    linear = linear_axes(machine)
    if strut.axis not in linear:
        yield Problem(f"'{strut.axis}' is not a linear axis", f"{where}.axis", did_you_mean(strut.axis, linear, "axes"))
        return
    if strut.screw not in machine.bars:
        yield Problem(f"no bar '{strut.screw}'", f"{where}.screw", did_you_mean(strut.screw, machine.bars, "bars"))
    elif machine.bars[strut.screw] is not None:
        yield from _expands(strut.screw, machine.bars[strut.screw].material, machine)
    pairs = [(c.axis, rail) for c in machine.contacts.values() if c is not None for rail, _ in c.pairs]
    if strut.screw in machine.bars and [axis for axis, rail in pairs if rail == strut.screw] != [strut.axis]:
        remedy = f"give one moving contact of axis '{strut.axis}' with the one pair of screw and nut"
        yield Problem(f"no nut of axis '{strut.axis}' alone runs on '{strut.screw}'", f"{where}.screw", remedy)
    for place in strut.growth:
        if place not in machine.members:
            remedy = did_you_mean(place, machine.members, "nodes and bars")
            yield Problem(f"no node or bar '{place}'", f"{where}.growth", remedy)
    along = np.subtract(strut.joint, strut.base)
    length, given = float(np.linalg.norm(along)), np.array(machine.axes[strut.axis].direction, dtype=float)
    if not length > 0.0 or np.linalg.norm(given / np.linalg.norm(given) - along / length) > ALONG:
        remedy = "a positive position is a longer strut: write the direction from base to joint"
        yield Problem(f"axis '{strut.axis}' does not point along its strut", f"axes.{strut.axis}.direction", remedy)


def closure_problems(machine: Machine) -> Iterator[Problem]:
    """Do the struts close, and hold the platform, at all ends of their strokes? Of a description without mistakes."""
    if machine.tcp is None or machine.tcp.platform is None:
        return
    geometry = geometry_of(machine)
    ends = np.array(list(product(*(machine.axes[axis].stroke for axis in linear_axes(machine)))))
    lever = float(np.linalg.norm(geometry.joint - geometry.point, axis=1).mean())
    try:
        condition = worst_condition(geometry, ends, lever)
    except ModelError as e:
        yield Problem(e.problems[0].what, "struts", "shorten the strokes, or move the joints apart")
        return
    if not condition <= WORST:
        what = f"the platform is near a singular pose at an end of the strokes (condition number {condition:.3g})"
        yield Problem(what, "struts", "shorten the strokes, or move the joints apart")

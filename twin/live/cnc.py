"""Nodes of a control by the names of OPC 40502 (OPC UA for CNC systems, 1.0), for channels that no file names.

    position of axis NAME              PosDirect.ActPos of the axis, PosIndirect.ActPos where that has no good value
    NAME_speed                         ActSpeed of the spindle
    NAME_power, NAME_torque, NAME_load ActPower, ActTorque, ActLoad of the axis or spindle

in CncAxisList and CncSpindleList, wherever below Objects they are. NAME is compared without regard to case; the table
[opcua.drives] of the channels file says what the server calls it otherwise; "spindle" is a server's only one. Units are
those that the server states (EngineeringUnits, by the codes of UNECE recommendation 20). The standard has no speeds of
axes, no currents and no temperatures.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from twin.errors import TwinError
from twin.live.channels import Channels
from twin.live.facts import Channel, Facts
from twin.units import parse_unit

NAMESPACE = "http://opcfoundation.org/UA/CNC"
AXES, SPINDLES = "CncAxisList", "CncSpindleList"
_QUANTITIES = {"_speed": "ActSpeed", "_power": "ActPower", "_torque": "ActTorque", "_load": "ActLoad"}
_LEVELS = 6  # below Objects that lists are looked for
_NODES = 2000  # objects that are looked into: an address space without lists must end
_OBJECT = 1  # class of a node
_SERVER = 2253  # the object that tells of the server itself
_UNECE = {
    "MMT": "mm", "CMT": "cm", "MTR": "m", "INH": "in", "DD": "deg", "C81": "rad", "RPM": "1/min", "C94": "1/min",
    "RPS": "1/s", "C97": "1/s", "WTT": "W", "KWT": "kW", "NU": "N*m", "P1": "%", "C62": "1",
}  # fmt: skip

Drives = list[tuple[str, dict[str, Any]]]  # what the server calls a drive, and nodes of its parts by name


class NoNodes(TwinError):
    """Of a server that may still be starting: the unit of systemd tries again, as it does not after a status of 2."""

    status = 1


def nodes_by_default(client: Any, facts: Facts, channels: Channels) -> dict[str, tuple[str, str]]:
    """Column -> node, unit of every channel without a node of its own that the server has.

    Raises NoNodes where the server has none for a channel that is needed, or several, or one without a unit;
    ConnectionError and the like where it goes away meanwhile.
    """
    axes, spindles = _drives(client)
    found, wrong = {}, []
    for channel in facts.channels:
        if channel.column in channels.nodes:
            continue
        told = _node(client, channel, axes, spindles, channels.opcua.get("drives", {}))
        if not isinstance(told, str):
            unit = channels.units.get(channel.column) or _unit(client, told)
            own = _si(unit)
            if own == channel.unit:
                found[channel.column] = (told[0].nodeid.to_string(), unit)
                continue
            told = f"is in {unit}" if own else "the server states no unit of it"
        if channel.needed and channel.default is None:
            wrong.append(f"{channel.column}: {told}")
    if wrong:
        there = f"the server has axes {_listed(axes)}, spindles {_listed(spindles)}"
        remedy = "name node and unit in the channels file, or what the server calls a drive: docs/live.md"
        raise NoNodes(f"no nodes by the names of OPC 40502 ({there}): {'; '.join(wrong)}", "--channels", remedy)
    return found


def _listed(drives: Drives) -> str:
    return ", ".join(name for name, _ in drives) or "none"


def _drives(client: Any) -> tuple[Drives, Drives]:
    """All axes and all spindles."""
    try:
        space = client.get_namespace_index(NAMESPACE)
    except ValueError:  # the server does not know the standard
        return [], []
    lists: dict[str, Drives] = {AXES: [], SPINDLES: []}
    for name, node in _lists(client, space):
        for own, child in _children(client, node).items():
            parts = _children(client, child)
            if "ActLoad" in parts:  # every drive has one; the list has other children, such as its NodeVersion
                lists[name].append((own, parts))
    return lists[AXES], lists[SPINDLES]


def _lists(client: Any, space: int) -> Iterator[tuple[str, Any]]:
    """The lists of axes and spindles, level by level below Objects."""
    level, seen = [client.nodes.objects], set()
    for _ in range(_LEVELS):
        below = []
        for told in [t for node in level for t in node.get_children_descriptions()]:
            name, node = told.BrowseName, told.NodeId
            if node in seen or (node.NamespaceIndex == 0 and node.Identifier == _SERVER):
                continue
            seen.add(node)
            if name.NamespaceIndex == space and name.Name in (AXES, SPINDLES):
                yield name.Name, client.get_node(node)
            elif told.NodeClass == _OBJECT and len(seen) < _NODES:
                below.append(client.get_node(node))
        level = below


def _children(client: Any, node: Any) -> dict[str, Any]:
    return {told.BrowseName.Name: client.get_node(told.NodeId) for told in node.get_children_descriptions()}


def _node(
    client: Any, channel: Channel, axes: Drives, spindles: Drives, names: Mapping[str, str]
) -> tuple[Any, ...] | str:
    """The node of a channel and those that may state its unit, or why there is none."""
    ending = next((e for e in _QUANTITIES if channel.column.endswith(e)), "")
    if channel.axis:
        axis = _one(channel.axis, axes, names, "axis")
        return axis if isinstance(axis, str) else _position(client, axis)
    if not ending:
        return "the standard has no such name"
    own, wanted = channel.column.removesuffix(ending), _QUANTITIES[ending]
    drives, what = (spindles, "spindle") if wanted == "ActSpeed" else ([*axes, *spindles], "drive")
    if own == "spindle" and own not in names and len(spindles) == 1:
        drives, own = spindles, spindles[0][0]
    parts = _one(own, drives, names, what)
    if isinstance(parts, str):
        an_axis = what == "spindle" and not isinstance(_one(own, axes, names, "axis"), str)
        return "the standard has no speed of an axis" if an_axis else parts
    return (parts[wanted],) if wanted in parts else f"no {wanted}"


def _one(own: str, drives: Drives, names: Mapping[str, str], what: str) -> dict[str, Any] | str:
    wanted = names.get(own, own)
    found = [parts for name, parts in drives if name.casefold() == wanted.casefold()]
    if len(found) == 1:
        return found[0]
    return f"{len(found)} drives are called '{wanted}'" if found else f"no {what} is called '{wanted}'"


def _position(client: Any, axis: dict[str, Any]) -> tuple[Any, ...] | str:
    """The first with a good value; the direct one where neither has."""
    places = []
    for group in (axis[name] for name in ("PosDirect", "PosIndirect") if name in axis):
        node = _children(client, group).get("ActPos")
        if node is None:
            continue
        places.append((node, group))
        told = node.read_data_value(raise_on_bad_status=False)
        if told.StatusCode is None or told.StatusCode.is_good():
            return node, group
    return places[0] if places else "no PosDirect.ActPos"


def _unit(client: Any, nodes: Sequence[Any]) -> str:
    """As the server states it; empty where it does not."""
    for node in nodes:
        told = _children(client, node).get("EngineeringUnits")
        value = None if told is None else told.read_value()
        if value is not None:
            code = (int(value.UnitId) & 0xFFFFFFFF).to_bytes(4, "big").strip(b"\0").decode("ascii", "replace")
            return str(_UNECE.get(code) or value.DisplayName.Text or "")
    return ""


def _si(unit: str) -> str:
    """Of a unit; empty where it is unknown."""
    try:
        return parse_unit(unit).si if unit else ""
    except ValueError:
        return ""

"""What pydantic finds wrong with a description, in the words of the description."""

from __future__ import annotations

import types
import typing
from typing import Any

from pydantic import BaseModel
from pydantic_core import ErrorDetails

from twin.errors import Problem
from twin.machine.description import Machine
from twin.nearest import did_you_mean

Keys = tuple[str, ...]  # a dotted path; places in arrays are digits


def schema_problem(error: ErrorDetails, data: dict[str, Any]) -> tuple[Keys, Problem]:
    """The path of a pydantic error in `data` and the problem to show, its place the dotted path."""
    keys, found = _existing(error["loc"], data, error["type"] in ("missing", "extra_forbidden"))
    where = ".".join(keys)
    name = keys[-1] if keys else ""
    kind = error["type"]
    if kind == "extra_forbidden":
        return keys, Problem(f"unknown key '{name}'", where, did_you_mean(name, known_keys(keys[:-1]), "keys here"))
    if kind == "missing":
        return keys, Problem(f"missing key '{name}'", where, _example(keys))
    message = error["msg"].removeprefix("Value error, ")
    message = message[0].lower() + message[1:]
    shown = f"{found!r}: " if isinstance(found, str | int | float) and repr(found) not in message else ""
    if kind == "literal_error":
        choices = [c for c in typing.get_args(_annotation(keys)) if isinstance(c, str)]
        return keys, Problem(f"{shown}{message}", where, did_you_mean(str(found), choices, "choices"))
    return keys, Problem(f"{shown}{message}", where, _example(keys))


def missing_section(name: str) -> Problem:
    """What to say about a section that a machine with meshes needs and a lumped one does not."""
    return Problem(f"missing key '{name}'", name, _example((name,)))


def known_keys(path: Keys) -> list[str]:
    """Keys that the table at `path` may have; none where any name may stand."""
    model = _annotation(path)
    if isinstance(model, type) and issubclass(model, BaseModel):
        return [k for k in model.model_fields if (model, k) != (Machine, "folder")]
    return []


def _existing(loc: tuple[int | str, ...], data: Any, absent: bool) -> tuple[Keys, Any]:
    """`loc` without the names of union branches that pydantic appends, and the value there.

    absent: the last item is a key that is missing or not allowed.
    """
    keys: list[str] = []
    for item in loc:
        inside = (
            item in data
            if isinstance(data, dict)
            else isinstance(data, list) and isinstance(item, int) and item < len(data)
        )
        if not inside:
            return (*keys, str(item)) if absent else tuple(keys), data
        keys.append(str(item))
        data = data[item]
    return tuple(keys), data


def _annotation(path: Keys) -> Any:
    """The type that the description gives to the value at `path`."""
    kind: Any = Machine
    for item in path:
        kind = _strip(kind)
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            field = kind.model_fields.get(item)
            kind = field.annotation if field else None
        elif typing.get_origin(kind) is dict:
            kind = typing.get_args(kind)[1]
        elif typing.get_origin(kind) is tuple:
            arguments = typing.get_args(kind)
            index = int(item) if item.isdigit() and arguments[-1] is not Ellipsis else 0
            kind = arguments[index] if index < len(arguments) else None
        else:
            return None
    return _strip(kind)


def _strip(kind: Any) -> Any:
    """The type without `| None` and annotations."""
    if typing.get_origin(kind) in (typing.Union, types.UnionType):
        rest = [a for a in typing.get_args(kind) if a is not type(None)]
        kind = rest[0] if len(rest) == 1 else kind
    if typing.get_origin(kind) is typing.Annotated:
        kind = typing.get_args(kind)[0]
    return kind


_EXAMPLES = {
    "conductivity": '"50 W/(m*K)"', "density": '"7200 kg/m^3"', "heat_capacity": '"500 J/(kg*K)"',
    "youngs_modulus": '"120 GPa"', "poisson_ratio": "0.26", "expansion": '"10e-6 1/K"', "material": '"cast_iron"',
    "direction": "[1, 0, 0]", "stroke": '["-400 mm", "400 mm"]', "carries": '["column"]', "position": '"x_position"',
    "kind": '"fixed"', "conductance": '"2000 W/(m^2*K)"', "surfaces": '["bed.top", "column.bottom"]',
    "law": '"motor_copper"', "environment": '"shop"', "unit": '"A"', "range": "[0, 20]", "surface": '"bed.top"',
    "stiffness": '["50 N/um", "50 N/um", "200 N/um"]', "name": '"my machine"', "point": "[0, 0, 0.3]",
    "origin": "[0, 0, 0]", "size": '["800 mm", "300 mm", "100 mm"]', "divisions": "[8, 3, 1]",
    "pairs": '[["bed.rail_1", "column.pad_1"]]', "temperature": '"20 degC"', "reference_temperature": '"20 degC"',
    "segments": "12", "elements": "20", "capacity": '"1200 J/K"', "total": '"12 W/K"', "area": '"0.1 m^2"',
    "volume": '"0.4 l"', "mass": '"3 kg"', "length": '"800 mm"', "perimeter": '"100 mm"', "cross_section": '"8 cm^2"',
    "fixed_end": '"start"', "path": '"sources.*.gain"', "tolerance": '"30 %"', "fixed": "true",
    "tool": '{ surface = "spindle.nose", point = [0, 0, 0.3] }', "work": '{ surface = "table.top" }',
}  # fmt: skip
_SECTIONS = {
    "machine": '[machine] with name = "..."', "materials": "[materials.NAME]",
    "parts": "[parts.NAME], or [nodes.NAME] for a machine without meshes",
    "environment": '[environment.shop] with temperature = "20 degC"', "films": "[films.NAME]",
    "parameters": '[[parameters]] with path = "sources.*.gain" and tolerance = "30 %"',
    "tcp": "[tcp.tool] and [tcp.work]", "supports": "[supports.NAME]",
}  # fmt: skip


def _example(path: Keys) -> str:
    """How a value at `path` is written."""
    if len(path) == 1 and path[0] in _SECTIONS:
        return f"add {_SECTIONS[path[0]]}"
    names = [p for p in path if not p.isdigit()]
    name = names[-1] if names else ""
    if path and path[0] == "axes" and name == "position":
        return 'write position = "x_position", the name of a signal'
    if name == "position":
        return "write position = [0.1, 0.2, 0.3], in m or with units"
    if path and path[0] == "contacts" and "stiffness" in names:
        return 'write stiffness = { normal = "300 N/um" }'
    if path and path[0] == "poses":
        return "write x = 5 for five equidistant positions, or a list of positions"
    return (
        f"write {name} = {_EXAMPLES[name]}" if name in _EXAMPLES else "`twin check --schema` prints what may stand here"
    )

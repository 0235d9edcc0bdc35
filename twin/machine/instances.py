"""What a machine has several times, described once: [templates.NAME.SECTION.ENTRY], placed by [instances.NAME].

An instance is the template's entries under names that begin with the instance's, "strut_1" + "_" + "screw". Within a
template, names of its own entries mean those of the same instance; all other names, of materials and environments for
example, mean the machine's. Points are turned and moved with the instance, directions turned. What comes out is an
ordinary description, so nothing after the loader knows templates.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from pydantic import ValidationError

from twin.errors import DescriptionError, Problem
from twin.machine.description import Instance
from twin.machine.each import each_apart
from twin.machine.toml_text import Section, Table, toml_text
from twin.nearest import did_you_mean
from twin.units import to_si

Keys = tuple[str, ...]
SECTIONS = (
    "nodes", "bars", "axes", "contacts", "tanks", "signals", "environment", "sources", "films", "sensors", "struts",
)  # fmt: skip
MEMBERS = ("nodes", "bars")
# Keys whose text, or texts in lists, are names of entries of these sections, whatever entry they stand in.
_NAMES: dict[str, tuple[str, ...]] = {
    "carries": MEMBERS, "surfaces": MEMBERS, "pairs": MEMBERS, "surface": MEMBERS, "part": MEMBERS, "screw": MEMBERS,
    "contact": ("contacts",), "axis": ("axes",), "signal": ("signals",), "switch": ("signals",),
    "environment": ("environment",), "radiant": ("environment",), "signals": ("signals",),
}  # fmt: skip
_POINTS = ("position", "origin", "base", "joint", "point")
_DIGITS = 12  # of coordinates after the point: a picometre


def expanded(data: Mapping[str, Any]) -> tuple[dict[str, Any], dict[Keys, Keys]]:
    """The description with every instance, and every film with `each`, written out, and where entries come from.

    Returns tables as `tomllib` gives them, without `templates` and `instances`, and for each (section, name) that was
    made the keys of what it was made from: (templates, template, section, name) of instances.
    Raises DescriptionError with all that is wrong with templates and instances; what is wrong within their entries is
    found later, like anywhere.
    """
    made, origins = _with_instances(data)
    if "films" not in made:
        return made, origins
    films, apart = each_apart(made["films"])
    of_films = {("films", own): origins.get(("films", name), ("films", name)) for own, name in apart.items()}
    return {**made, "films": films}, origins | of_films


def _with_instances(data: Mapping[str, Any]) -> tuple[dict[str, Any], dict[Keys, Keys]]:
    """The description with every instance written out."""
    rest = {key: value for key, value in data.items() if key not in ("templates", "instances")}
    if "templates" not in data and "instances" not in data:
        return rest, {}
    templates, given = data.get("templates", {}), data.get("instances", {})
    if problems := list(_problems(templates, given)):
        raise DescriptionError.collect(problems)
    if any(not isinstance(rest.get(section, {}), dict) for section in SECTIONS):
        return rest, {}  # "nodes = 3" is refused by the types
    origins: dict[Keys, Keys] = {}
    made = {section: dict(rest.get(section, {})) for section in SECTIONS}
    clashes = []
    for name, table in given.items():
        instance = Instance.model_validate(table)
        template = templates[instance.of]
        for section, entries in template.items():
            for local, entry in entries.items():
                own = f"{name}_{local}"
                if own in made[section]:
                    remedy = "rename the instance, or the entry"
                    where = f"instances.{name}"
                    clashes.append(Problem(f"makes {section}.{own}, which there is already", where, remedy))
                made[section][own] = _Placed(name, template, instance).entry(section, local, entry)
                origins[section, own] = ("templates", instance.of, section, local)
    if clashes:
        raise DescriptionError.collect(clashes)
    return {**rest, **{section: entries for section, entries in made.items() if entries}}, origins


def written_out(text: str) -> str:
    """The text of a sound description with every instance and `each` written out; as it is where there is none."""
    data = tomllib.loads(text)
    written, origins = expanded(data)
    if not origins and "templates" not in data and "instances" not in data:
        return text
    sections = tuple(Section(key, _tables(key, value)) for key, value in written.items())
    return toml_text("All instances and films of each place written out.", sections)


def _tables(key: str, value: Any) -> tuple[Table, ...]:
    if isinstance(value, list):  # [[parameters]]
        return tuple(Table(f"[{key}]", entry) for entry in value)
    single = not all(isinstance(entry, dict) for entry in value.values()) or key == "tcp"
    return (Table(key, value),) if single else tuple(Table(f"{key}.{name}", entry) for name, entry in value.items())


def _problems(templates: Any, instances: Any) -> Iterator[Problem]:
    for section, tables in (("templates", templates), ("instances", instances)):
        if not isinstance(tables, dict) or not all(isinstance(table, dict) for table in tables.values()):
            remedy = "write [templates.NAME.nodes.motor], and [instances.NAME] with of = 'NAME'"
            yield Problem(f"'{section}' is no table of tables", section, remedy)
            return
    for name, template in templates.items():
        for section, entries in template.items():
            where = f"templates.{name}.{section}"
            if section == "parts":
                remedy = "use nodes and bars, or write each part: a mesh stands where it was drawn"
                yield Problem("parts in a template", where, remedy)
            elif section not in SECTIONS:
                yield Problem(f"no '{section}' in a template", where, did_you_mean(section, SECTIONS, "sections of it"))
            elif not isinstance(entries, dict) or not all(isinstance(entry, dict) for entry in entries.values()):
                yield Problem(f"'{section}' is no table of tables", where, f"write [{where}.NAME]")
        if not any(table.get("of") == name for table in instances.values()):
            remedy = f"add [instances.NAME] with of = '{name}', or remove it"
            yield Problem("no instance of this template", f"templates.{name}", remedy)
    for name, table in instances.items():
        yield from _instance_problems(name, table, templates)


def _instance_problems(name: str, table: dict[str, Any], templates: Mapping[str, Any]) -> Iterator[Problem]:
    where = f"instances.{name}"
    try:
        instance = Instance.model_validate(table)
    except ValidationError as error:
        for detail in error.errors(include_url=False, include_context=False):
            key = str(detail["loc"][0])
            remedy = "write of = 'strut', origin = [0, 0, 0.5], x = [0, 0, 1]"
            if detail["type"] == "extra_forbidden":
                remedy = did_you_mean(key, tuple(Instance.model_fields), "keys here")
            yield Problem(f"'{key}': {detail['msg'].removeprefix('Value error, ')}", f"{where}.{key}", remedy)
        return
    if instance.of not in templates:
        yield Problem(f"no template '{instance.of}'", f"{where}.of", did_you_mean(instance.of, templates, "templates"))
    if not _frame_holds(instance):
        remedy = "give x, and perhaps z, a length, and not the same direction"
        yield Problem("x and z span no frame", where, remedy)


def _frame_holds(instance: Instance) -> bool:
    x, z = np.array(instance.x), np.array(instance.z) if instance.z else None
    if not np.linalg.norm(x) > 0.0:
        return False
    return z is None or bool(np.linalg.norm(np.cross(x, z)) > 1e-6 * np.linalg.norm(x) * np.linalg.norm(z))


def rotation(instance: Instance) -> np.ndarray:
    """(3, 3): columns are the template's x, y and z in the machine. Without a z that of the machine as near as can be,
    or its y, where x is vertical."""
    x = np.array(instance.x) / np.linalg.norm(instance.x)
    wanted = instance.z or ((0.0, 0.0, 1.0) if abs(x[2]) < 1.0 - 1e-9 else (0.0, 1.0, 0.0))
    z = np.array(wanted) - np.dot(wanted, x) * x
    z = z / np.linalg.norm(z)
    return np.stack([x, np.cross(z, x), z], axis=1)


class _Placed:
    """One instance of a template."""

    def __init__(self, name: str, template: Mapping[str, Mapping[str, Any]], instance: Instance):
        self._prefix, self._template = name, template
        self._turn, self._origin = rotation(instance), np.array(instance.origin)

    def entry(self, section: str, local: str, given: dict[str, Any]) -> dict[str, Any]:
        made = {key: self._value(section, key, value) for key, value in given.items()}
        if section == "signals" and "column" in made:
            made["column"] = f"{self._prefix}_{made['column']}"
        return made

    def _value(self, section: str, key: str, value: Any) -> Any:
        if section == "axes" and key == "position":
            return self._named(("signals",), value)
        if (key in _POINTS and section != "axes") or key == "point":
            return self._moved(value)
        if key == "direction":
            return self._turned(value)
        if key == "growth" and isinstance(value, dict):
            return {self._named(MEMBERS, place): rate for place, rate in value.items()}
        return self._named(_NAMES[key], value) if key in _NAMES else value

    def _named(self, sections: tuple[str, ...], value: Any) -> Any:
        """Names of the template's own entries, within lists and tables, with the instance's before them."""
        if isinstance(value, list):
            return [self._named(sections, one) for one in value]
        if isinstance(value, dict):
            return {key: self._named(sections, one) for key, one in value.items()}
        own = isinstance(value, str) and any(value.partition(".")[0] in self._template.get(s, {}) for s in sections)
        return f"{self._prefix}_{value}" if own else value

    def _moved(self, value: Any) -> Any:
        """A point [m, or with units]; what is none stays, and is refused with the rest of the description."""
        try:
            return _rounded(self._origin + self._turn @ np.array([to_si(v, "m") for v in value]))
        except (ValueError, TypeError):
            return value

    def _turned(self, value: Any) -> Any:
        try:
            return _rounded(self._turn @ np.array(value, dtype=float))
        except (ValueError, TypeError):
            return value


def _rounded(point: np.ndarray) -> list[float]:
    return [round(float(v), _DIGITS) + 0.0 for v in point]

"""machine.toml -> Machine, with everything that is wrong with it reported at once."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterable
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import BaseModel, TypeAdapter, ValidationError

from twin.atomic import atomic_path
from twin.errors import DescriptionError, Problem
from twin.machine.description import Instance, Machine, MachineEntry, ParameterEntry
from twin.machine.instances import SECTIONS, expanded
from twin.machine.reason import unreasonable
from twin.machine.references import reference_problems
from twin.machine.schema_errors import Keys, known_keys, missing_section, schema_problem
from twin.machine.toml_lines import key_lines, line_of
from twin.nearest import nearest
from twin.ordinary import ordinary

SHOWN = 20  # of values beyond all reason, of which a file may be full


def load_machine(path: Path, text: str | None = None) -> Machine:
    """The machine described by the file `path`, or by machine.toml in the folder `path`; meshes are not read.

    text: read instead of the file, as if it stood there (a calibrated artefact brings its own description).

    Raises DescriptionError with one problem per mistake, each with file, key, line and remedy: TOML syntax, unknown or
    missing keys, units, names that mean nothing, laws with wrong parameters or signals, values out of range.
    """
    path = _file_of(path)
    text = read_text(path) if text is None else text
    try:
        data = tomllib.loads(text)
    except ValueError as e:  # a TOMLDecodeError, or of whole numbers of more than 4300 digits
        raise DescriptionError(f"not valid TOML: {e}", str(path), _syntax_remedy(text, str(e))) from e
    except RecursionError as e:
        raise DescriptionError("not valid TOML: nested too deeply", str(path), "close the brackets") from e
    lines = key_lines(text)
    if far := list(unreasonable(data)):
        raise DescriptionError.collect([_placed(path, lines, keys, problem) for keys, problem in far[:SHOWN]])
    try:
        data, origins = expanded(data)
    except DescriptionError as e:
        wrong = [_placed(path, lines, tuple(p.where.split(".")), p) for p in e.problems]
        raise DescriptionError.collect(wrong) from e
    found, sound = _schema_problems(data)
    partial = _partial(data, sound, path.parent)
    if partial is not None:
        reported = {keys for keys, _ in found}
        mistyped = {(*keys[:-1], close) for keys, _ in found if (close := _meant(keys, data))}
        for problem in reference_problems(partial):
            keys = tuple(problem.where.split("."))
            if keys not in reported | mistyped:  # what follows from a mistake is not another mistake
                found.append((keys, problem))
    problems = {}
    for keys, problem in _once(found, origins):
        problems[_placed(path, lines, keys, problem)] = line_of(lines, keys) or 0
    if any(not p.warning for p in problems):
        raise DescriptionError.collect(sorted(problems, key=problems.__getitem__))
    return Machine.model_validate({**data, "folder": path.parent})


def _once(found: list[tuple[Keys, Problem]], origins: dict[Keys, Keys]) -> Iterable[tuple[Keys, Problem]]:
    """Problems of entries that instances made, at what they were made from: what several share is said of the first."""
    told = set()
    for keys, problem in found:
        if (origin := origins.get(keys[:2])) is not None:
            prefix = keys[1].removesuffix(origin[-1])  # keys of growth are names that got it, too
            keys = (*origin, *(key.removeprefix(prefix) for key in keys[2:]))
            if keys in told:
                continue
            told.add(keys)
        yield keys, problem


def located(path: Path, problems: Iterable[Problem]) -> list[Problem]:
    """Problems of a description that say where by key alone, with its file and line; others as they are.

    path: of machine.toml, or its folder.
    """
    path = _file_of(path)
    lines = key_lines(read_text(path))
    found = []
    for problem in problems:
        keys = tuple(problem.where.removeprefix("machine.toml: ").split("."))
        found.append(_placed(path, lines, keys, problem) if line_of(lines, keys) else problem)
    return found


def _file_of(path: Path) -> Path:
    path = Path(path)
    return path / "machine.toml" if path.is_dir() else path


def _placed(path: Path, lines: dict[Keys, int], keys: Keys, problem: Problem) -> Problem:
    """The problem with the file, the key and its line as its place."""
    line = line_of(lines, keys)
    return replace(problem, where=f"{path}: {'.'.join(keys)}" + (f" (line {line})" if line else ""))


def json_schema() -> dict[str, Any]:
    """The JSON schema of machine.toml: editors complete and check with it."""
    schema = Machine.model_json_schema()
    schema["properties"].pop("folder")
    instance = Instance.model_json_schema()
    sections = {name: schema["properties"][name] for name in SECTIONS}
    template = {"type": "object", "properties": sections, "additionalProperties": False}
    schema["properties"] |= {
        "templates": {"type": "object", "additionalProperties": template},
        "instances": {"type": "object", "additionalProperties": instance},
    }
    schema["title"] = "twin machine description"
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def write_schema(path: Path) -> None:
    """Write `json_schema` to a file. Raises TwinError where it cannot be written."""
    with atomic_path(Path(path)) as temporary:
        temporary.write_text(json.dumps(json_schema(), indent=1) + "\n", encoding="utf-8")


def read_text(path: Path) -> str:
    """The text of a description, its line ends as in Unix. Raises DescriptionError where it cannot be read."""
    try:
        return ordinary(path).read_bytes().decode("utf-8-sig").replace("\r\n", "\n")
    except FileNotFoundError as e:
        raise DescriptionError("no such file", str(path), "give the path of a machine.toml, or of its folder") from e
    except UnicodeDecodeError as e:
        raise DescriptionError(f"not UTF-8 at byte {e.start}", str(path), "save the file as UTF-8") from e
    except OSError as e:
        raise DescriptionError(
            f"cannot read: {e.strerror or e}", str(path), "check the path and its permissions"
        ) from e


def _syntax_remedy(text: str, message: str) -> str:
    line = message.rpartition("line ")[2].partition(",")[0]
    if line.isdigit() and 0 < int(line) <= len(text.splitlines()):
        return f"fix this line or the one before it: {text.splitlines()[int(line) - 1].strip()[:80]}"
    return "strings need quotes, arrays a closing bracket"


def _schema_problems(data: dict[str, Any]) -> tuple[list[tuple[Keys, Problem]], dict[str, Any]]:
    """What the types refuse, and the description without it: unknown keys left out, broken entries None."""
    found = _with_missing_sections(_refused(data), data)
    if "folder" in data:
        found["folder",] = Problem("unknown key 'folder'", "folder", "remove it")
    unknown = [keys for keys in found if _has(data, keys) and keys[-1] not in (known_keys(keys[:-1]) or [keys[-1]])]
    mistyped = {(*keys[:-1], _meant(keys, data)) for keys in unknown}
    told = [(keys, p) for keys, p in found.items() if keys not in mistyped or keys in unknown]
    return told, _sound(data, unknown, [keys for keys in found if keys not in unknown])


def _refused(data: dict[str, Any]) -> dict[Keys, Problem]:
    """What the types refuse, one problem per place."""
    found: dict[Keys, Problem] = {}
    try:
        Machine.model_validate({k: v for k, v in data.items() if k != "folder"})
    except ValidationError as error:
        for detail in error.errors(include_url=False, include_context=False):
            keys, problem = schema_problem(detail, data)
            found.setdefault(keys, problem)  # every branch of a union complains; the first will do
    return found


def _with_missing_sections(found: dict[Keys, Problem], data: dict[str, Any]) -> dict[Keys, Problem]:
    """Those of a machine of meshed parts besides, and all in the order of the description; a lumped one needs none."""
    if any(isinstance(data.get(key), dict) and data[key] for key in ("nodes", "bars")):
        return found
    needed = _OF_PARTS if data.get("tcp") in (None, {}) else (*_OF_PARTS, "supports")
    every = found | {(key,): missing_section(key) for key in needed if key not in data or data[key] == {}}
    place = {section: i for i, section in enumerate(Machine.model_fields)}
    return dict(sorted(every.items(), key=lambda item: place.get(item[0][0] if item[0] else "", -1)))


def _sound(data: dict[str, Any], unknown: list[Keys], broken: list[Keys]) -> dict[str, Any]:
    """A copy without unknown keys, and with None for broken entries."""
    sound = deepcopy(data)
    for keys in unknown:
        _get(sound, keys[:-1]).pop(keys[-1])
    for keys in broken:
        _mark_broken(sound, keys)
    return sound


_OF_PARTS = ("materials", "parts")  # sections that only lumped machines can do without


def _meant(keys: Keys, data: dict[str, Any]) -> str | None:
    """The key that an unknown one probably stands for."""
    known = known_keys(keys[:-1])
    return nearest(keys[-1], known) if known and _has(data, keys) and keys[-1] not in known else None


def _get(data: Any, keys: Keys) -> Any:
    for key in keys:
        data = data[int(key)] if isinstance(data, list) else data[key]
    return data


def _has(data: Any, keys: Keys) -> bool:
    try:
        _get(data, keys)
    except (KeyError, TypeError, IndexError, ValueError):
        return False
    return True


def _mark_broken(data: dict[str, Any], keys: Keys) -> None:
    """Set the named or numbered entry, or the section without entries, that `keys` lies in to None."""
    section = data.get(keys[0])
    if len(keys) > 1 and isinstance(section, list):
        section[int(keys[1])] = None
    elif len(keys) > 1 and isinstance(section, dict) and not known_keys(keys[:1]):
        section[keys[1]] = None
    else:
        data[keys[0]] = None


def _partial(data: dict[str, Any], sound: dict[str, Any], folder: Path) -> Machine | None:
    """A machine of the sound entries, the broken ones None; None where there is nothing to cross-check."""
    values: dict[str, Any] = {"folder": folder}
    for section, field in Machine.model_fields.items():
        if section == "folder":
            continue
        kept = sound.get(section)
        if isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel):
            default = None if field.is_required() or section in data else field.get_default()
            values[section] = field.annotation.model_validate(kept) if kept is not None else default
            continue
        if section == "parameters":
            tables = kept if isinstance(kept, list) else []
            values[section] = tuple(_entry(ParameterEntry, table) for table in tables)
            continue
        given = data.get(section)
        if section in data and not isinstance(kept, dict):
            return None  # "parts = 3": everything would look unknown
        entry_type = field.annotation.__args__[1] if field.annotation else None  # dict[str, entry]
        values[section] = {
            name: _entry(entry_type, (kept or {}).get(name)) for name in (given if isinstance(given, dict) else {})
        }
    if values["machine"] is None:
        values["machine"] = MachineEntry(name="?")
    return Machine.model_construct(**values)


def _entry(kind: Any, value: Any) -> Any:
    return None if value is None else TypeAdapter(kind).validate_python(value)

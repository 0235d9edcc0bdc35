"""What a program adds to a machine.toml, at the level of text: new tables in a marked block at the end, and changed
values that keep the old one in a comment. Every byte of what was there stays, and `removed` brings it back.

    gain = 1.3 # of the housing  # found: was 1.0
    switch = "found_2"  # found: new

    # --- found by twin diagnose ---
    # heat_source: 12 W into bed.x_motor
    [sources.found_1]
    ...
    # --- end of found by twin diagnose ---
"""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Mapping, Sequence
from copy import deepcopy
from typing import Any

from twin.errors import DescriptionError
from twin.machine.edit import edited, insertion
from twin.machine.toml_spans import Keys, Statement, spans

BY = {  # by the mark of changed values
    "found": "found by twin diagnose",
    "hidden": "hidden by twin hide",
    "proposed": "proposed by twin new",
}
_BARE = re.compile(r"[A-Za-z0-9_-]+")
_MARK = re.compile(rf"[ ]{{2}}# (?:{'|'.join(BY)}): (was |new$)")
_BLOCK = re.compile(rf"\r?\n# --- ({'|'.join(BY.values())}) ---\r?\n.*?# --- end of \1 ---\r?(?:\n|\Z)", re.DOTALL)


def appended(text: str, tables: Sequence[tuple[str, Mapping[str, object]]], comment: str, mark: str = "found") -> str:
    """The text with new tables at its end: ("sources.found_1", {"law": "constant_heat", ...}), ("parameters", {...}).

    comment: one line above them. mark: a key of `BY`; what one program adds in several calls lies in one block. Values
    are strings, numbers, booleans, sequences or mappings of them.
    Raises DescriptionError where a table is there already, or its section is written as an inline table.
    """
    data = _loads(text)
    expected = deepcopy(data)
    for name, values in tables:
        section, _, key = name.partition(".")
        content = _loads("".join(f"{_key(k)} = {_value(v)}\n" for k, v in values.items()))
        if not key:
            expected.setdefault(section, []).append(content)
            continue
        if _at(data, (section, key)) is not None:
            raise DescriptionError("is there already", name, "choose another name for the new table")
        expected.setdefault(section, {})[key] = content
    newline = "\r\n" if "\r\n" in text else "\n"
    lines = [f"# {' '.join(comment.split())}"]
    for name, values in tables:
        header = f"[{'.'.join(_key(k) for k in name.split('.', 1))}]"
        lines.append(header if "." in name else f"[{header}]")
        lines += [*(f"{_key(k)} = {_value(v)}" for k, v in values.items()), ""]
    end = f"# --- end of {BY[mark]} ---{newline}"
    if text.endswith(f"\n{end}"):
        text = text[: -len(end)]
    else:
        lines.insert(0, f"{newline}# --- {BY[mark]} ---")
    return _expect(text + newline.join(lines) + newline + end, expected)


def changed(text: str, values: Mapping[str, float | str | bool | Sequence[str]], mark: str = "found") -> str:
    """The text with other values at dotted paths ("sources.x_motor.surface"), each line with its old value behind it.

    Parameters (`parameter_units`) are numbers in SI and are written in the unit that they were written in; of others a
    string or a bare number is written as it is. A missing key is written after the last one of its table.
    Raises DescriptionError for paths without an owner, values on several lines, and all that `edited` refuses.
    """
    for path, value in values.items():
        text = _changed(text, tuple(path.split(".")), value, mark)
    return text


def removed(text: str) -> str:
    """The text before `appended` and `changed`, byte by byte as far as nothing else was edited meanwhile."""
    text = _BLOCK.sub(lambda block: "\n" if _would_join(text, block) else "", text)
    for statement in reversed(spans(text).statements):
        end = _line_end(text, statement.end)
        match = _MARK.search(text, statement.end, end)
        if match is None:
            continue
        if match[1] == "new":
            start = text.rfind("\n", 0, statement.key_start)  # its line was put in with the line end before it
            start -= text[start - 1 : start] == "\r"
            text = text[:start] + text[end:]
        else:
            later = _MARK.search(text, match.end(), end)
            old = text[match.end() : later.start() if later else end]
            text = text[: statement.start] + old + text[statement.end : match.start()] + text[end:]
    return text


def free_name(text: str, prefix: str) -> str:
    """The first of prefix_1, prefix_2, ... that names nothing in a description."""
    data = _loads(text)
    taken = {name for section in data.values() if isinstance(section, dict) for name in section}
    return next(name for n in range(1, len(taken) + 2) if (name := f"{prefix}_{n}") not in taken)


def _changed(text: str, keys: Keys, value: float | str | bool | Sequence[str], mark: str) -> str:
    found = spans(text)
    owner = keys[:-1]
    if keys not in found.values and not _owned(text, owner):
        raise DescriptionError("there is no such table", ".".join(owner), "check the path")
    token = _token(text, keys, value)
    expected = _loads(text)
    owned = _at(expected, owner)
    owned[keys[-1]] = tomllib.loads(f"v = {token}")["v"]
    if (span := found.values.get(keys)) is not None:
        statement = span.statement
        new = text[statement.start : span.start] + token + text[span.end : statement.end]
        return _expect(_replaced(text, statement, new, mark), expected)
    if owner not in found.values and owner not in found.headers and not _dotted(found.statements, owner):
        raise DescriptionError("has no table of its own", ".".join(owner), f"write it as [{'.'.join(owner)}]")
    at, new, inline = insertion(text, found, keys, token, f"{mark}: new")
    if owner not in found.values:
        return _expect(text[:at] + new + text[at:], expected)
    assert inline is not None  # the end of the statement that holds the inline table
    statement = found.values[owner].statement
    return _expect(
        _replaced(text, statement, text[statement.start : at] + new + text[at : statement.end], mark), expected
    )


def _replaced(text: str, statement: Statement, new: str, mark: str) -> str:
    """A statement with another value. The first change of several keeps its mark: it knows what a person wrote."""
    old = text[statement.start : statement.end]
    if "\n" in old:
        where = ".".join(statement.keys)
        raise DescriptionError("its value is on several lines", where, "write it on one line, so that it can be kept")
    end = _line_end(text, statement.end)
    rest = text[statement.end : end]
    told = rest if _MARK.search(rest) else f"{rest}  # {mark}: was {old}"
    return text[: statement.start] + new + told + text[end:]


def _token(text: str, keys: Keys, value: float | str | bool | Sequence[str]) -> str:
    if isinstance(value, str | bool | Sequence):
        return _value(value)
    try:
        after = edited(text, {".".join(keys): value})
    except DescriptionError as e:
        if e.problems[0].what.startswith("no parameter of this machine"):
            return _value(value)
        raise
    span = spans(after).values[keys]
    return after[span.start : span.end]


def _value(value: object) -> str:
    """A TOML value."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return repr(float(value))
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(k)} = {_value(v)}" for k, v in value.items()) + " }"
    if isinstance(value, Sequence):
        return "[" + ", ".join(_value(v) for v in value) + "]"
    raise TypeError(f"no value of a description: {value!r}")


def _key(name: str) -> str:
    return name if _BARE.fullmatch(name) else json.dumps(name, ensure_ascii=False)


def _loads(text: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as e:
        raise DescriptionError(f"not valid TOML: {e}", "machine.toml", "fix it with `twin check`") from e


def _expect(text: str, expected: dict[str, Any]) -> str:
    """What must not happen is that anything else changes."""
    try:
        if tomllib.loads(text) == expected:
            return text
        what = "other values would change"
    except tomllib.TOMLDecodeError as e:
        what = str(e)
    remedy = "write its tables as [section.NAME] with one key on each line"
    raise DescriptionError(f"cannot extend this TOML: {what}", "machine.toml", remedy)


def _at(data: Any, keys: Keys) -> Any:
    for key in keys:
        data = data.get(key) if isinstance(data, dict) else None
    return data


def _owned(text: str, owner: Keys) -> bool:
    return isinstance(_at(_loads(text), owner), dict)


def _dotted(statements: Sequence[Statement], owner: Keys) -> bool:
    return any(s.keys[: len(owner)] == owner and s.header == owner[: len(s.header)] for s in statements)


def _line_end(text: str, at: int) -> int:
    end = text.find("\n", at)
    end = len(text) if end < 0 else end
    return end - 1 if text[end - 1 : end] == "\r" else end


def _would_join(text: str, block: re.Match[str]) -> bool:
    """Whether what stands before and after a block would become one line without it."""
    before, after = text[: block.start()], text[block.end() :]
    return bool(before and after) and not before.endswith("\n")

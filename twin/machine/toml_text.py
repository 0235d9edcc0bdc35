"""The text of a machine.toml from tables: one section after the other, each under a line that says what it is."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

WIDTH = 120  # characters of a line, as everywhere here


@dataclass(frozen=True)
class Table:
    """One table: [header], a key on each line, and a remark behind the header."""

    header: str
    entries: Mapping[str, Any]
    remark: str = ""


@dataclass(frozen=True)
class Section:
    """Tables that belong together."""

    title: str
    tables: tuple[Table, ...]


def toml_text(remark: str, sections: Sequence[Section]) -> str:
    """The text of sections that are not empty; remark: the line at the top. Values: what `value_text` takes."""
    blocks = [f"# {remark}"]
    for section in sections:
        if section.tables:
            head = f"# --- {section.title} " if section.title else ""
            blocks += [head.ljust(WIDTH, "-")] if head else []
            blocks += [_table_text(table) for table in section.tables]
    return "\n\n".join(blocks) + "\n"


def value_text(value: Any) -> str:
    """A TOML value on one line: strings, numbers, lists, and dictionaries as inline tables."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{k} = {value_text(v)}" for k, v in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(value_text(v) for v in value) + "]"
    if isinstance(value, float):
        return repr(value)
    return json.dumps(value, ensure_ascii=False)


def _table_text(table: Table) -> str:
    head = f"[{table.header}]" + (f" # {table.remark}" if table.remark else "")
    return "\n".join([head, *(_entry_text(k, v) for k, v in table.entries.items())])


def _entry_text(key: str, value: Any) -> str:
    line = f"{key} = {value_text(value)}"
    if len(line) <= WIDTH or not isinstance(value, list | tuple):
        return line
    return "\n".join([f"{key} = [", *(f"  {value_text(v)}," for v in value), "]"])

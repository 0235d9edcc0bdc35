"""On which line of a TOML file a key stands, so that messages can point at it."""

from __future__ import annotations

from bisect import bisect_right

from twin.machine.toml_spans import Keys, spans


def key_lines(text: str) -> dict[Keys, int]:
    """Line (from 1) of every table header and key of valid TOML; keys inside inline tables count as their owner's.

    Places in arrays of tables are digits: ("parameters", "0", "path").
    """
    found = spans(text)
    places = dict(found.headers)
    for statement in found.statements:
        places.setdefault(statement.keys, statement.key_start)
    ends = [i for i, character in enumerate(text) if character == "\n"]
    return {keys: bisect_right(ends, at - 1) + 1 for keys, at in sorted(places.items(), key=lambda item: item[1])}


def line_of(lines: dict[Keys, int], path: Keys) -> int | None:
    """The line of a path, or of the nearest owner that has one."""
    while path:
        if path in lines:
            return lines[path]
        path = path[:-1]
    return None

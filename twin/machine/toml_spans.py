"""Where in the text of a TOML file each value stands, so that it can be replaced and all else left as it is.

tomlkit was tried: it writes a new key behind the comments that head the next table, and loses spaces of inline tables.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

Keys = tuple[str, ...]  # a dotted path; places in arrays are digits

_PART = r"(?:[A-Za-z0-9_-]+|\"(?:\\.|[^\"\\])*\"|'[^']*')"
_KEY = re.compile(rf"{_PART}(?:[ \t]*\.[ \t]*{_PART})*")
_BLANK = re.compile(r"(?:[ \t\r\n]+|#[^\n]*)*")
_STRING = re.compile(
    r'"""(?:\\.|[^\\])*?"{3,5}(?!")' r"|'''.*?'{3,5}(?!')" r'|"(?:\\.|[^"\\])*"' r"|'[^']*'", re.DOTALL
)
_OTHER = re.compile(r"\d{4}-\d\d-\d\d[ Tt]\d\d:[^\s,\]}#]*|[^\s,\]}#]+")  # numbers, booleans, dates


@dataclass(frozen=True)
class Statement:
    """One `key = value` that is not inside an inline table; its value is text[start:end]."""

    keys: Keys  # from the root
    header: Keys  # of the table it is written in
    key_start: int
    start: int
    end: int


@dataclass(frozen=True)
class Span:
    """One value, of a statement or in its array or inline table: text[start:end]."""

    statement: Statement
    start: int
    end: int


@dataclass(frozen=True)
class Spans:
    """All values of a text, and the places of its table headers."""

    values: dict[Keys, Span]
    headers: dict[Keys, int]  # where the header ends

    @property
    def statements(self) -> list[Statement]:
        """In the order of the text."""
        return [span.statement for keys, span in self.values.items() if span.statement.keys == keys]


def spans(text: str) -> Spans:
    """Find all values of valid TOML (`tomllib.loads` accepts it), also those in arrays and inline tables."""
    values: dict[Keys, Span] = {}
    headers: dict[Keys, int] = {}
    count: dict[Keys, int] = {}  # of tables in arrays
    header: Keys = ()
    at = _blank(text, 0)
    while at < len(text):
        if text[at] == "[":
            array = text.startswith("[[", at)
            keys, at = _key(text, _blank(text, at + 1 + array))
            at = _blank(text, at) + 1 + array
            keys = _numbered(keys, count)
            if array:
                headers.setdefault(keys, at)
                count[keys] = count.get(keys, -1) + 1
                keys = (*keys, str(count[keys]))
            header = keys
            headers.setdefault(header, at)
        else:
            found: list[tuple[Keys, int, int]] = []
            key_start, at = at, _pair(text, at, header, found)
            keys, start, end = found[-1]  # what is inside comes first
            statement = Statement(keys, header, key_start, start, end)
            values |= {keys: Span(statement, start, end) for keys, start, end in found}
        at = _blank(text, at)
    return Spans(values, headers)


def _numbered(keys: Keys, count: dict[Keys, int]) -> Keys:
    """[a.b] after [[a]] is in the last table of a."""
    full: Keys = ()
    for key in keys:
        full = (*full, str(count[full]), key) if full in count else (*full, key)
    return full


def _blank(text: str, at: int) -> int:
    """After spaces, line ends and comments."""
    found = _BLANK.match(text, at)
    return found.end() if found else at


def _key(text: str, at: int) -> tuple[Keys, int]:
    found = _KEY.match(text, at)
    assert found is not None, f"no key at {at}"  # the text is valid TOML
    return tuple(part.strip("\"'") for part in re.findall(_PART, found[0])), found.end()


def _pair(text: str, at: int, owner: Keys, found: list[tuple[Keys, int, int]]) -> int:
    keys, at = _key(text, at)
    return _value(text, _blank(text, text.index("=", at) + 1), (*owner, *keys), found)


def _value(text: str, at: int, keys: Keys, found: list[tuple[Keys, int, int]]) -> int:
    """Append the values inside a value, then itself; the place after it."""
    start, first = at, text[at]
    if first in "[{":
        at, number = _blank(text, at + 1), 0
        while text[at] not in "]}":
            at = _value(text, at, (*keys, str(number)), found) if first == "[" else _pair(text, at, keys, found)
            at, number = _blank(text, at), number + 1
            at = _blank(text, at + 1) if text[at] == "," else at
        at += 1
    else:
        match = (_STRING if first in "\"'" else _OTHER).match(text, at)
        assert match is not None, f"no value at {at}"
        at = match.end()
    found.append((keys, start, at))
    return at

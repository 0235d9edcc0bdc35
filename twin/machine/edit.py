"""A description with other values of its parameters: the text edited in place, as a careful person would.

Only numbers change. Comments, order, spaces and the units that values are written in stay; a gain or an offset that
was left at its default is written after the last key of its table.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Mapping
from copy import deepcopy
from typing import Any

from pydantic import ValidationError

from twin.errors import DescriptionError
from twin.machine.description import Machine
from twin.machine.parameters import parameter_units
from twin.machine.toml_spans import Keys, Spans, Statement, spans
from twin.nearest import did_you_mean
from twin.units import to_si

_NUMBER = re.compile(r"(\s*)([+-]?(?:\d[\d_]*\.?\d*|\.\d+)(?:[eE]([+-]?\d+))?)(.*)", re.DOTALL)
_COMMENT = re.compile(r"([ \t]*)(#[^\r\n]*)?")


def edited(text: str, values: Mapping[str, float], comments: Mapping[str, str] = {}, digits: int = 6) -> str:
    """The text of a machine.toml with parameters (`parameter_units`) at new values [SI], written with `digits` digits.

    "25 W/(m^2*K)" becomes "27.31 W/(m^2*K)", a bare number stays a bare SI number. comments: by path, a remark for the
    end of the line that changes, without the #; "calibrated: ..." takes the place of an older one that begins alike,
    other comments stay.

    Raises DescriptionError for paths that are no parameters of this machine, values that are not finite or that the
    description refuses, and text that is no description.
    """
    data, units = _read(text)
    found = spans(text)
    expected = deepcopy(data)
    replaced: list[tuple[int, int, str]] = []  # start, end, new text
    remarks: dict[int, list[tuple[int, str]]] = {}  # by the end of the value that they follow; with the place of theirs
    for path, value in values.items():
        if path not in units:
            remedy = did_you_mean(path, units, "parameters")
            raise DescriptionError(f"no parameter of this machine is called '{path}'", path, remedy)
        if not math.isfinite(value):
            raise DescriptionError(f"{value} is no value", path, "give a finite number")
        keys, remark = _keys(path), comments.get(path, "")
        if (span := found.values.get(keys)) is not None:
            token = _token(text[span.start : span.end], value, units[path], digits)
            replaced.append((span.start, span.end, token))
            if remark:
                remarks.setdefault(span.statement.end, []).append((span.start, remark))
        else:
            token = _bare(value, digits)
            at, new, end = insertion(text, found, keys, token, remark)
            replaced.append((at, at, new))
            if remark and end is not None:
                remarks.setdefault(end, []).append((at, remark))
        _set(expected, keys, tomllib.loads(f"v = {token}")["v"])
    for end, placed in remarks.items():
        match = _COMMENT.match(text, end)
        assert match is not None  # it may be empty
        comment = _comment(match[2] or "", [remark for _, remark in sorted(placed)])
        replaced.append((end, match.end(), f"{match[1] if match[2] else '  '}{comment}"))
    result = text
    for start, end, new in sorted(replaced, key=lambda r: r[:2], reverse=True):
        result = result[:start] + new + result[end:]
    _expect(result, expected)
    return result


def _read(text: str) -> tuple[dict[str, Any], dict[str, str]]:
    """The data of a description and its parameters with their units."""
    try:
        data = tomllib.loads(text)
        return data, parameter_units(Machine.model_validate(data))
    except (tomllib.TOMLDecodeError, ValidationError, RecursionError) as e:
        what = str(e).partition("\n")[0]
        raise DescriptionError(f"no machine description: {what}", "machine.toml", "fix it with `twin check`") from e


def _expect(text: str, expected: dict[str, Any]) -> None:
    """The one thing that an edit must not do is to change anything else."""
    try:
        data = tomllib.loads(text)
        if data != expected:
            raise ValueError("other values would change")
        Machine.model_validate(data)
    except ValidationError as e:
        first = e.errors(include_url=False)[0]
        where = ".".join(map(str, first["loc"]))
        remedy = "give a value that the description allows"
        raise DescriptionError(f"{first['input']!r}: {first['msg'].lower()}", where, remedy) from e
    except ValueError as e:
        remedy = "write its tables as [section.NAME] with one key on each line"
        raise DescriptionError(f"cannot edit this TOML: {e}", "machine.toml", remedy) from e


def _keys(path: str) -> Keys:
    """ "tcp.expansion.shaft.x" is the first element of an array."""
    keys = tuple(path.split("."))
    return (*keys[:-1], str("xyz".index(keys[-1]))) if keys[:2] == ("tcp", "expansion") else keys


def _token(old: str, value: float, unit: str, digits: int) -> str:
    """The TOML value `old` at a new value [SI] in the unit that it is written in."""
    if old[0] not in "\"'":
        match = _NUMBER.fullmatch(old)
        return _bare(value, digits, match[3] if match else None)
    quote = old[:3] if old[:3] in ('"""', "'''") else old[0]
    match = _NUMBER.fullmatch(old[len(quote) : -len(quote)])
    assert match is not None, old  # to_si has read it
    space, _, exponent, written = match.groups()
    zero, one = (to_si(f"{number}{written}", unit) for number in (0, 1))
    return f"{quote}{space}{_number((value - zero) / (one - zero), digits, exponent)}{written}{quote}"


def _bare(value: float, digits: int, exponent: str | None = None) -> str:
    """A TOML float."""
    token = _number(value, digits, exponent)
    return token if any(c in token for c in ".e") else f"{token}.0"


def _number(value: float, digits: int, exponent: str | None = None) -> str:
    """With the exponent of ten that the old one had, as long as that is readable: "11.7e-6" stays a number of 1e-6."""
    if exponent is not None and 1e-3 <= abs(mantissa := value / 10.0 ** int(exponent)) < 10.0**digits:
        return f"{mantissa:.{digits}g}e{exponent}"
    return f"{value:.{digits}g}"


def insertion(text: str, found: Spans, keys: Keys, token: str, remark: str) -> tuple[int, str, int | None]:
    """Where a missing key goes, the text to put there, and the end of the value whose line the remark follows."""
    owner, key = keys[:-1], keys[-1]
    if (inline := found.values.get(owner)) is not None:
        inside = [s.end for k, s in found.values.items() if k[:-1] == owner and s.statement == inline.statement]
        if inside:
            return max(inside), f", {key} = {token}", inline.statement.end
        return inline.start + 1, f" {key} = {token}", inline.statement.end
    comment = f"  # {remark}" if remark else ""
    newline = "\r\n" if "\r\n" in text else "\n"
    beside = [s for s in found.statements if _beside(s, owner)]
    if not beside:
        at = _line_end(text, found.headers[owner])
        return at, f"{newline}{key} = {token}{comment}", None
    last = beside[-1]
    indent = text[text.rfind("\n", 0, last.key_start) + 1 : last.key_start]
    name = ".".join(keys[len(last.header) :])
    return _line_end(text, last.end), f"{newline}{indent}{name} = {token}{comment}", None


def _beside(statement: Statement, owner: Keys) -> bool:
    """Whether a key of `owner` can stand after a statement: in the owner's table, or with a dotted key in one above."""
    return statement.keys[: len(owner)] == owner and statement.header == owner[: len(statement.header)]


def _line_end(text: str, at: int) -> int:
    end = text.find("\n", at)
    end = len(text) if end < 0 else end
    return end - 1 if text[end - 1 : end] == "\r" else end


def _comment(old: str, new: list[str]) -> str:
    """Remarks after an old comment, without those in it that begin as they do."""
    labels = {remark.partition(":")[0] for remark in new}
    kept = [part for part in old.removeprefix("#").strip().split("; ") if part.partition(":")[0] not in labels]
    return "# " + "; ".join([*filter(None, kept), *new])


def _set(data: Any, keys: Keys, value: Any) -> None:
    for key in keys[:-1]:
        data = data[key]
    if isinstance(data, list):
        data[int(keys[-1])] = value
    else:
        data[keys[-1]] = value

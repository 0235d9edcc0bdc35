"""Edits of the text of a machine.toml that change single values, and leave comments, order and the rest as they are."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np

from twin.machine.edit import insertion
from twin.machine.toml_spans import Keys, spans


def with_values(text: str, values: Mapping[Keys, str]) -> str:
    """The text with other TOML values at paths of keys; places in arrays are digits.

    A key that is not there yet is written behind the others of its table, which must be there (KeyError).
    """
    found = spans(text)
    new = [(s.start, s.end, values[k]) for k, s in found.values.items() if k in values]
    for keys, token in values.items():
        if keys not in found.values:
            at, line, _ = insertion(text, found, keys, token, "")
            new.append((at, at, line))
    return _replaced(text, new)


def with_table(text: str, header: Keys, entries: Mapping[str, str]) -> str:
    """The text with other values [TOML] of keys of one table; "" leaves a key out, with all that it holds."""
    found, new = spans(text), []
    for statement in found.statements:
        if statement.header == header and statement.keys[len(header)] in entries:
            start = text.rfind("\n", 0, statement.key_start) + 1
            end = text.find("\n", statement.end) + 1
            new.append((start, end or len(text), ""))
    at = found.headers[header]
    at = text.find("\n", at) if "\n" in text[at:] else len(text)  # behind the header's remark
    lines = [f"{key} = {token}" for key, token in entries.items() if token]
    return _replaced(text, [(at, at, "".join(f"\n{line}" for line in lines)), *new])


def with_divisions(text: str, divisions: Mapping[str, str]) -> str:
    """The text with other divisions of boxes: "[8, 4, 2]" -> "[11, 6, 3]"."""
    for old, new in divisions.items():
        text = text.replace(f"divisions = {old}", f"divisions = {new}")
    return text


def spread_values(text: str, spread: Mapping[str, float], rng: np.random.Generator) -> str:
    """The text with quantities times exp(normal): of every `name = "number unit"`, by the standard deviation of `name`.

    Draws are made name by name, in the order of `spread`, and of each in the order of the text.
    """
    for name, sigma in spread.items():

        def drawn(match: re.Match[str], sigma: float = sigma) -> str:
            return f"{match[1]}{float(match[2]) * np.exp(sigma * rng.standard_normal()):.6g}"

        text = re.sub(rf'(\b{name} = ")([\d.]+)', drawn, text)
    return text


def _replaced(text: str, new: list[tuple[int, int, str]]) -> str:
    for start, end, token in sorted(new, key=lambda n: n[:2], reverse=True):
        text = text[:start] + token + text[end:]
    return text

"""Values that no description means, whatever the key: numbers beyond all reason, names with control characters.

Looked for before anything is validated, so that nothing has to be made for a number of 400 digits.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from twin.errors import Problem
from twin.machine.schema_errors import Keys
from twin.rom.names import has_control_characters
from twin.units import LARGEST

_FREE_TEXT = ("machine", "description")  # may have lines


def unreasonable(data: Any, keys: Keys = ()) -> Iterator[tuple[Keys, Problem]]:
    """The places of a TOML document with values that cannot be meant, and what to say about each."""
    if isinstance(data, dict):
        for key, value in data.items():
            yield from unreasonable(value, (*keys, key))
    elif isinstance(data, list):
        for i, value in enumerate(data):
            yield from unreasonable(value, (*keys, str(i)))
    elif isinstance(data, str):
        if has_control_characters(data) and (keys != _FREE_TEXT or "\0" in data):
            yield keys, Problem("text with control characters", ".".join(keys), "letters, digits and signs only")
    elif isinstance(data, int | float) and abs(data) > LARGEST:  # NaN and infinity are told by their types
        shown = f"a whole number of {data.bit_length()} bits" if isinstance(data, int) else f"{data:g}"
        yield keys, Problem(f"{shown} is beyond {LARGEST:g}", ".".join(keys), "check the number and its unit")

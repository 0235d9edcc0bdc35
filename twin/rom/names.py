"""What may stand in a name: it becomes a path in HDF5, a header in CSV and a line on a terminal."""

from __future__ import annotations

import unicodedata


def has_control_characters(text: str) -> bool:
    """Whether text holds NUL, a line end, an escape or another control character (category Cc of Unicode)."""
    return any(unicodedata.category(character) == "Cc" for character in text)

"""Numbers as C text."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

_LINE = 8  # numbers in a line


class Arrays:
    """Static arrays of a C file, in the order in which they are added."""

    def __init__(self, single: bool, name: str):
        self.single, self.name = single, name
        self.parts: list[str] = []

    def add(self, text: str) -> None:
        """Any other code; public names in it begin with twin_."""
        self.parts.append(named(text, self.name))

    def reals(self, name: str, values: Any, kind: str = "static const real") -> None:
        """Numbers in C order, at least one: C knows no empty arrays."""
        flat = np.asarray(values, dtype=float).ravel()
        if self.single:
            flat = flat.astype(np.float32)
        self._put(f"{kind} {name}[]", ["NAN" if v != v else repr(v) for v in flat.tolist()])

    def integers(self, name: str, values: Any, kind: str = "static const int") -> None:
        self._put(f"{kind} {name}[]", [str(v) for v in np.asarray(values, dtype=int).ravel().tolist()])

    def table(self, name: str, values: Sequence[Sequence[int]], width: int) -> None:
        """Integers in rows (rows, width)."""
        flat = np.asarray(values, dtype=int).reshape(-1, max(width, 1))
        rows = [", ".join(map(str, row)) for row in flat.tolist()] or ["0"]
        self.parts.append(f"static const int {name}[][{max(width, 1)}] = {{{', '.join(f'{{{r}}}' for r in rows)}}};\n")

    def names(self, name: str, values: Iterable[str]) -> None:
        self._put(f"const char *const {name}[]", [quoted(v) for v in values], 1)

    def _put(self, head: str, texts: list[str], line: int = _LINE) -> None:
        texts = texts or ["0"]
        lines = (", ".join(texts[i : i + line]) for i in range(0, len(texts), line))
        self.parts.append(named(head, self.name) + " = {\n" + ",\n".join(lines) + "};\n")

    def text(self) -> str:
        return "".join(self.parts)


def named(text: str, name: str) -> str:
    """Public names with the machine's in place of `twin`, so that several machines link into one program."""
    return re.sub(r"\bTWIN_", f"{name.upper()}_", re.sub(r"\btwin_(?!\.)", f"{name}_", text))


def quoted(text: str) -> str:
    """A C string."""
    raw = text.encode("utf-8")
    return '"' + "".join(chr(c) if 32 <= c < 127 and chr(c) not in '"\\?' else f"\\{c:03o}" for c in raw) + '"'


def identifier(name: str) -> str:
    """A name that C and every tool accepts: letters, digits and underscores, a letter first."""
    plain = re.sub(r"\W", "_", name, flags=re.ASCII)
    return plain if plain[:1].isalpha() else f"x_{plain}"

"""Numbers as C text."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from importlib import resources
from typing import Any

import numpy as np

_LINE = 8  # numbers in a line


class Arrays:
    """Static arrays of a C file, in the order in which they are added."""

    def __init__(self, single: bool, name: str):
        self.single, self.name = single, name
        self.parts: list[str] = []
        self._weights: list[np.ndarray] = []

    def add(self, text: str) -> None:
        """Any other code; public names in it begin with twin_."""
        self.parts.append(named(text, self.name))

    def reals(self, name: str, values: Any, kind: str = "static const real") -> None:
        """Numbers in C order, at least one: C knows no empty arrays."""
        self._put(f"{kind} {name}[]", _numbers(self._flat(values)))

    def weights(self, name: str, values: Any) -> None:
        """Many numbers: a pointer into the one table that all of these share."""
        start = sum(len(w) for w in self._weights)
        self._weights.append(self._flat(values))
        self.add(f"static const real *const {name} = twin_weights + {start};\n")

    def weights_as_bytes(self) -> bytes:
        """The shared table as a compiler for little-endian processors would write it."""
        numbers = np.concatenate([*self._weights, self._flat([0.0])])
        return numbers.astype("<f4" if self.single else "<f8").tobytes()

    def integers(self, name: str, values: Any, kind: str = "static const int") -> None:
        self._put(f"{kind} {name}[]", [str(v) for v in np.asarray(values, dtype=int).ravel().tolist()])

    def table(self, name: str, values: Sequence[Sequence[int]], width: int) -> None:
        """Integers in rows (rows, width)."""
        flat = np.asarray(values, dtype=int).reshape(-1, max(width, 1))
        rows = [", ".join(map(str, row)) for row in flat.tolist()] or ["0"]
        self.parts.append(f"static const int {name}[][{max(width, 1)}] = {{{', '.join(f'{{{r}}}' for r in rows)}}};\n")

    def names(self, name: str, values: Iterable[str]) -> None:
        self._put(f"const char *const {name}[]", [quoted(v) for v in values], 1)

    def _flat(self, values: Any) -> np.ndarray:
        flat = np.asarray(values, dtype=float).ravel()
        return flat.astype(np.float32) if self.single else flat

    def _put(self, head: str, texts: list[str], line: int = _LINE) -> None:
        self.parts.append(f"{named(head, self.name)} = {{\n{_lines(texts or ['0'], line)}}};\n")

    def text(self) -> str:
        """All of it, the shared table first."""
        table = _lines(_numbers(np.concatenate([*self._weights, self._flat([0.0])])))
        frame = (resources.files("twin.export.c") / "weights.c").read_text(encoding="utf-8")
        return "".join([named(frame, self.name).replace("THE_NUMBERS", table), *self.parts])


def _numbers(flat: np.ndarray) -> list[str]:
    return ["NAN" if v != v else repr(v) for v in flat.tolist()]


def _lines(texts: list[str], line: int = _LINE) -> str:
    return ",\n".join(", ".join(texts[i : i + line]) for i in range(0, len(texts), line))


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

"""Decimal marks of files whose cells are not separated by commas: points or commas, but not both.

`1.234` is a little more than one in an English file and over a thousand in a German one. Which is meant is plain where
the file keeps to one mark; a file that mixes them is refused, and so is one whose points look like thousands.
"""

from __future__ import annotations

import re

import numpy as np

from twin.errors import Problem
from twin.logs.found import at

_THOUSANDS = re.compile(r'"?\s*[+-]?[1-9]\d{0,2}(?:\.\d{3})+\s*"?')  # 1.234, 12.345.678; not 0.123
_SMALL = re.compile(r'"?\s*[+-]?\d{1,3}\s*"?')
_LEAST = 5  # such numbers before they are taken for thousands


def mark_problems(body: list[str], delimiter: str, first: int, names: list[str], path: str) -> list[Problem]:
    """Errors about the marks in the cells from column `first` on; body: rows as read, row i on line i + 2.

    Raises nothing. Files of plain points or plain commas cost one search through the text.
    """
    text = "\n".join(body)
    if "." not in text:
        return []
    rows = [line.split(delimiter)[first:] for line in body]
    commas = [i for i, row in enumerate(rows) if any("," in cell for cell in row)]
    points = [i for i, row in enumerate(rows) if any("." in cell for cell in row)]
    if commas and points:
        fewer, mark, other = (commas, "commas", "points") if len(commas) < len(points) else (points, "points", "commas")
        what = f"decimal {mark} in {len(fewer)} rows, decimal {other} in others: numbers cannot be told from thousands"
        return [Problem(what, at(path, np.array(fewer)), "write one decimal mark, and no thousands separators")]
    return [p for k, name in enumerate(names[first:]) if (p := _thousands(rows, k, name, path))] if points else []


def _thousands(rows: list[list[str]], k: int, name: str, path: str) -> Problem | None:
    """A column whose points always stand before three digits, and whose numbers below 1000 have none."""
    grouped: list[int] = []
    for i, row in enumerate(rows):
        cell = row[k] if k < len(row) else ""
        if "." not in cell:
            if cell.strip().strip('"') and not _SMALL.fullmatch(cell):
                return None
        elif _THOUSANDS.fullmatch(cell):
            grouped.append(i)
        else:
            return None
    if len(grouped) < _LEAST or len({rows[i][k] for i in grouped}) < _LEAST or len(grouped) == len(rows):
        return None
    what = f"column '{name}' seems to hold thousands separators: points stand before three digits, as in "
    what += rows[grouped[0]][k].strip()
    return Problem(what, at(path, np.array(grouped)), "write numbers without thousands separators")

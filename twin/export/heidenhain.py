"""Compensation-value tables of a HEIDENHAIN control: one .COM per axis that is read, and config.cma that assigns them.

A .COM has the positions of its axis in AXISPOS [mm, machine datum] and a column for every axis that is moved; a .CMA
names, in the column of an axis, the .COM that is read at its position: column axis = F(axis of the .CMA's column).
Source: HEIDENHAIN Technical Manual MANUALplus 620, January 2012, pages 716 to 718; TNC 407, pages 4-28 to 4-31.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from twin.atomic import atomic_folder, check_folder
from twin.errors import TwinError
from twin.export.additive import AdditiveTables, fit_additive
from twin.export.axis_offsets import Left, left, sampled
from twin.export.control_table import Source, head, source_of, summary
from twin.export.options import ExportOptions
from twin.rom.artefact import Artefact

DIGITS = 7  # of a metre: the tables count in 0.0001 mm
LOSES = "what the positions of two axes do together"


def export_heidenhain(artefact: Artefact, path: Path, options: ExportOptions) -> tuple[str, ...]:
    """The format `heidenhain`: `write_heidenhain` of the result that the options name."""
    return summary(path, write_heidenhain(path, source_of(artefact, options)))


def write_heidenhain(folder: Path, source: Source) -> Left:
    """Write AXIS.com, config.cma and readme.txt to a new folder, or over tables; returns what they leave.

    Raises TwinError where the folder holds anything else: it is not for us to replace.
    """
    _refuse_other_files(folder)
    tables = fit_additive(sampled(source.errors, source.jacobian)).rounded(DIGITS)
    found = left(tables.offsets, source.errors, source.jacobian)
    with atomic_folder(folder) as temporary:
        for b in range(len(tables.axes)):
            (temporary / f"{tables.axes[b]}.com").write_text("\n".join(_table(tables, b)), encoding="ascii")
        (temporary / "config.cma").write_text("\n".join(_assignment(tables.axes)), encoding="ascii")
        said = ["HEIDENHAIN compensation-value tables", *head(source, found, LOSES), ""]
        (temporary / "readme.txt").write_text("\n".join(said), encoding="ascii")
    return found


def _table(tables: AdditiveTables, axis: int) -> list[str]:
    moved = [k for k in range(len(tables.axes)) if np.any(tables.columns[axis][:, k])]
    names = "".join(f"{tables.axes[k].upper():>12}" for k in moved)
    rows = [
        f"{i:<6}{1e3 * p:>+14.4f}{0.0:>+12.4f}" + "".join(f"{1e3 * values[k]:>+12.4f}" for k in moved)
        for i, (p, values) in enumerate(zip(tables.grid[axis], tables.columns[axis], strict=True))
    ]
    return [
        f"BEGIN {tables.axes[axis].upper()}.COM MM",
        f"{'NR':<6}{'AXISPOS':>14}{'BACKLASH':>12}{names}",
        *rows,
        "[END]",
        "",
    ]


def _assignment(axes: tuple[str, ...]) -> list[str]:
    names = "".join(f"{a.upper():>16}" for a in axes)
    files = "".join(f"{a.upper() + '.COM':>16}" for a in axes)
    return ["BEGIN CONFIG.CMA MM", f"{'NR':<6}{'ACTIVE':<8}{names}", f"{0:<6}{'*':<8}{files}", "[END]", ""]


def _refuse_other_files(folder: Path) -> None:
    check_folder(folder)
    if not folder.exists():
        return
    strange = [p.name for p in folder.iterdir() if p.suffix.lower() not in (".com", ".cma") and p.name != "readme.txt"]
    if strange:
        what = f"holds '{strange[0]}', which is no table of this export, so it is not replaced"
        raise TwinError(what, str(folder), "choose another folder with -o")

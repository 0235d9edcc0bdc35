"""The offsets of all axes on a grid over the workspace, as CSV or JSON: for a control with a volumetric table."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from twin.atomic import atomic_path
from twin.export.axis_offsets import Left, Sampled, left, sampled
from twin.export.control_table import SIGN, Source, commented, head, source_of, summary
from twin.export.options import ExportOptions
from twin.rom.artefact import Artefact

DIGITS = 9  # of a metre: 1 nm
LOSES = "what bends between the points of the grid (read it linearly between them)"


def export_generic(artefact: Artefact, path: Path, options: ExportOptions) -> tuple[str, ...]:
    """The format `generic`: `write_generic` of the result that the options name."""
    return summary(path, write_generic(path, source_of(artefact, options)))


def write_generic(path: Path, source: Source) -> Left:
    """Write a .json, or a CSV under any other name; returns what it leaves."""
    table = sampled(source.errors, source.jacobian)
    table = Sampled(table.axes, table.grid, table.position, np.round(table.offset, DIGITS))
    found = left(lambda position: grid_offsets(table, position), source.errors, source.jacobian)
    with atomic_path(path) as temporary:
        text = _json(source, table, found) if path.suffix.lower() == ".json" else _csv(source, table, found)
        temporary.write_text(text, encoding="utf-8")
    return found


def grid_offsets(table: Sampled, position: np.ndarray) -> np.ndarray:
    """(m, n_axes) [m] at positions (m, n_axes) [m]: linear in every position, held beyond the grid."""
    wide = [k for k, nodes in enumerate(table.grid) if len(nodes) > 1]
    if not wide:
        return np.repeat(table.offset, len(position), axis=0)
    nodes = tuple(table.grid[k] for k in wide)
    values = table.offset.reshape(*(len(n) for n in nodes), len(table.axes))
    inside = np.clip(position[:, wide], [n[0] for n in nodes], [n[-1] for n in nodes])
    return np.asarray(RegularGridInterpolator(nodes, values)(inside))


def _csv(source: Source, table: Sampled, found: Left) -> str:
    names = [*(f"{a} [m]" for a in table.axes), *(f"offset_{a} [m]" for a in table.axes)]
    rows = [",".join(f"{value:.9g}" for value in row) for row in np.hstack([table.position, table.offset])]
    return "\n".join([*commented("#", head(source, found, LOSES)), ",".join(names), *rows, ""])


def _json(source: Source, table: Sampled, found: Left) -> str:
    shape = [len(nodes) for nodes in table.grid]
    content = {
        "format": "twin correction grid",
        "machine": source.machine,
        "artefact": source.artefact,
        "time_s": source.time,
        "sign": " ".join(SIGN),
        "cannot_express": LOSES,
        "axes": list(table.axes),
        "grid_m": [nodes.tolist() for nodes in table.grid],
        "shape": shape,
        "order": "the last axis fastest",
        "offset_m": {name: table.offset[:, k].tolist() for k, name in enumerate(table.axes)},
        **{f"{name}_um": (1e6 * value).tolist() for name, value in vars(found).items()},
        "left_share": found.share,
    }
    return json.dumps(content, indent=1) + "\n"

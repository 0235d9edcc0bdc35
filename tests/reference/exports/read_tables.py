"""Control tables that `twin export` wrote, read as a control reads them: axis offsets [m] at positions [m].

    python read_tables.py siemens|beckhoff|heidenhain|generic FILE X Y Z

Every function returns the names of the axes in the file and `offsets(positions)`, (m, n_axes) -> (m, n_axes).
"""

from __future__ import annotations

import csv
import json
import re
import sys
from pathlib import Path

import numpy as np
from scipy.interpolate import RegularGridInterpolator


def siemens(path):
    """dK = K0 + tan_beta (P - P0), mm; what stands behind a semicolon is a comment."""
    data = {}
    for line in Path(path).read_text().splitlines():
        found = re.fullmatch(r"\$SA_TEMP_COMP_(\w+)\[(\w+)\]=(\S+)", line.partition(";")[0].strip())
        if found:
            data.setdefault(found[2], {})[found[1]] = float(found[3])

    def offsets(P):
        mm = 1e3 * np.asarray(P)
        K = [d["ABS_VALUE"] + d["SLOPE"] * (p - d["REF_POSITION"]) for d, p in zip(data.values(), mm.T, strict=True)]
        return 1e-3 * np.stack(K, axis=1)

    return list(data), offsets


def beckhoff(path):
    """ds = offset_0 + coefficient (s - s_0), whole numbers of 0.1 um and um/m."""
    names, blocks = [], []
    for line in Path(path).read_text().splitlines():
        if line.startswith("# axis "):
            names.append(line.split()[2].rstrip(";"))
        elif not line.startswith("#") and line.strip():
            key, value = line.split()
            if key == "kopf.achs_nr":
                blocks.append({})
            blocks[-1][key.removeprefix("lr_param.temp_comp")] = int(value)

    def offsets(P):
        columns = [
            1e-7 * b["_offset_0"] + 1e-6 * b["_coefficient"] * (p - 1e-7 * b["_position_0"])
            for b, p in zip(blocks, np.asarray(P).T, strict=True)
        ]
        return np.stack(columns, axis=1)

    return names, offsets


def heidenhain(folder):
    """Sum over the .COM tables that the active line of config.cma names, each read at the position of its axis; mm."""
    head, *lines = [line.split() for line in (Path(folder) / "config.cma").read_text().splitlines()[1:-1]]
    (active,) = [dict(zip(head, line, strict=True)) for line in lines if "*" in line]
    axes = [name for name in head if name not in ("NR", "ACTIVE")]
    tables = []
    for axis in axes:
        text = (Path(folder) / active[axis].lower()).read_text().splitlines()
        columns, rows = text[1].split(), [[float(v) for v in line.split()] for line in text[2:] if line != "[END]"]
        tables.append(dict(zip(columns, np.array(rows).T, strict=True)))

    def offsets(P):
        total = np.zeros(np.shape(P))
        for b, table in enumerate(tables):
            for a, axis in enumerate(axes):
                if axis in table:
                    total[:, a] += np.interp(1e3 * np.asarray(P)[:, b], table["AXISPOS"], table[axis])
        return 1e-3 * total

    return axes, offsets


def generic(path):
    """Linear between the points of a grid; .csv or .json, m."""
    if str(path).endswith(".json"):
        told = json.loads(Path(path).read_text())
        axes, grid = told["axes"], [np.array(g) for g in told["grid_m"]]
        values = np.stack([told["offset_m"][a] for a in axes], axis=1)
    else:
        lines = [line for line in Path(path).read_text().splitlines() if not line.startswith("#")]
        names, *rows = csv.reader(lines)
        table = np.array(rows, dtype=float)
        axes = [name.removesuffix(" [m]") for name in names[: len(names) // 2]]
        grid, values = [np.unique(c) for c in table.T[: len(axes)]], table[:, len(axes) :]
    shaped = values.reshape(*map(len, grid), len(axes))
    return axes, RegularGridInterpolator(grid, shaped)


if __name__ == "__main__":
    names, offsets = globals()[sys.argv[1]](sys.argv[2])
    at = offsets(np.array([sys.argv[3:]], dtype=float))[0]
    print("  ".join(f"{name}: {1e6 * value:+.2f} um" for name, value in zip(names, at, strict=True)))

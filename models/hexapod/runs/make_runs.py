"""Write the runs beside this file: `python make_runs.py`. Needs numpy only.

Paper 001, section 16.3: of every drive the current, speed and position, and the ambient temperature, every 10 ms in
blocks of 10 s. The paper prints curves without values, so the motion is ours: for 8 h the tool goes round circles that
grow, tilts, rests, and does it again with another share of the work on each strut. `records` gives the records of
10 ms; a row of `mixed_paths` holds the means of a block (rms of currents, mean magnitude of speeds), and the
position of one of its records, drawn evenly, so that the rows spread along the screws as the records do.
"""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).parent
STRUTS = tuple(f"strut_{k}" for k in range(1, 7))
CORE, PER_BLOCK, HOURS = 0.01, 1000, 8.0  # s, records, h
CYCLE = 5400.0  # s: of work and rest
FORCE_CONSTANT = 45.0  # N per A rms at the screw: 0.075 N m/A over a lead of 10 mm, less friction
HOLDING, MASS, DRAG = 45.0, 15.0, 60.0  # N at rest, kg that a strut moves, the motor's inertia included, N of friction
NAMES = tuple(f"{strut}_{kind}" for strut in STRUTS for kind in ("position", "speed", "current"))
UNITS = ("m", "m/s", "A") * 6


def geometry() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Joints on the frame and on the platform (6, 3), and the tool centre point (3,) [m], of machine.toml."""
    machine = tomllib.loads((FOLDER.parent / "machine.toml").read_text(encoding="utf-8"))
    strut = machine["templates"]["strut"]["struts"]["strut"]
    base = np.array([machine["instances"][name]["origin"] for name in STRUTS])
    along = np.array([machine["instances"][name]["x"] for name in STRUTS])
    return base, base + strut["joint"][0] * along, np.array(machine["tcp"]["platform"]["point"])


def path(time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The tool's shift (n, 3) [m] and the platform's tilt (n, 2) [rad] about x and y."""
    inside = np.mod(time, CYCLE)
    size = np.interp(inside, [0, 60, 1800, 1900, 3600, 3660, CYCLE], [0, 0.010, 0.022, 0.014, 0.020, 0, 0])
    turn = 2.0 * np.pi * 1.1 * time  # 11 in a block of 10 s, so that means of blocks do not beat
    lean = np.interp(inside, [0, 1800, 1860, 3600, 3660, CYCLE], [0, 0, 0.05, 0.05, 0, 0])
    slow = 2.0 * np.pi * 0.2 * time
    aside = 0.008 * np.sin(2.0 * np.pi * time / (3.1 * CYCLE))
    shift = np.stack(
        [size * np.cos(turn) + aside, 0.7 * size * np.sin(turn), 0.8 * size * np.sin(8.0 / 11.0 * turn)], axis=1
    )
    return shift, np.stack([lean * np.cos(slow), lean * np.sin(slow)], axis=1)


def lengths(shift: np.ndarray, tilt: np.ndarray) -> np.ndarray:
    """(n, 6) [m] of the struts: the closed inverse of a platform that turns by small angles about x, then y."""
    base, joint, point = geometry()
    b = joint - point
    cx, sx, cy, sy = np.cos(tilt[:, :1]), np.sin(tilt[:, :1]), np.cos(tilt[:, 1:]), np.sin(tilt[:, 1:])
    y, z = cx * b[:, 1] - sx * b[:, 2], sx * b[:, 1] + cx * b[:, 2]
    turned = np.stack([cy * b[:, 0] + sy * z, y, -sy * b[:, 0] + cy * z], axis=2)
    return np.linalg.norm(point + shift[:, None, :] + turned - base, axis=2)


def records(first: int, count: int) -> np.ndarray:
    """Records first .. first + count (count, 18): position [m], speed [m/s], rms current [A] of every strut in turn."""
    time = CORE * np.arange(first - 1, first + count + 1)
    length = lengths(*path(time)) - lengths(np.zeros((1, 3)), np.zeros((1, 2)))
    speed = (length[2:] - length[:-2]) / (2.0 * CORE)
    acceleration = (length[2:] - 2.0 * length[1:-1] + length[:-2]) / CORE**2
    force = HOLDING + MASS * acceleration + DRAG * np.tanh(speed / 1e-3)
    return np.stack([length[1:-1], speed, np.abs(force) / FORCE_CONSTANT], axis=2).reshape(count, 18)


def ambient(time: np.ndarray) -> np.ndarray:
    """degC: the room drifts by a kelvin and a half."""
    return 21.0 + 1.5 * np.sin(0.5 * np.pi * np.minimum(time / (6 * 3600.0), 1.0)) ** 2


def row(block: np.ndarray, chosen: int) -> np.ndarray:
    """(18,) of a block's records: position of the chosen one, mean magnitude of the speed, rms current."""
    each = block.reshape(len(block), 6, 3)
    kinds = each[chosen, :, 0], np.abs(each[:, :, 1]).mean(axis=0), np.sqrt((each[:, :, 2] ** 2).mean(axis=0))
    return np.stack(kinds, axis=1).ravel()


def main() -> None:
    n = round(HOURS * 3600.0 / (CORE * PER_BLOCK))
    drawn = np.random.default_rng(1).integers(PER_BLOCK, size=n)
    values = np.array([row(records(k * PER_BLOCK, PER_BLOCK), drawn[k]) for k in range(n)])
    values = np.vstack([values, values[-1]])
    time = CORE * PER_BLOCK * np.arange(n + 1)
    shown = np.where(np.arange(18) % 3 == 0, 1e3, 1.0)
    digits = [2, 4, 3] * 6
    heads = [
        f"{name} [{'mm' if unit == 'm' else unit}]" for name, unit in zip(NAMES, ("m", "m/s", "A") * 6, strict=True)
    ]
    lines = [",".join(["time [s]", *heads, "ambient [degC]"])]
    for t, told, air in zip(time, values * shown, ambient(time), strict=True):
        cells = [f"{round(v, d) + 0.0:.10g}" for v, d in zip(told, digits, strict=True)]
        lines.append(",".join([f"{t:.10g}", *cells, f"{air:.2f}"]))
    folder = FOLDER / "mixed_paths"
    folder.mkdir(exist_ok=True)
    (folder / "loads.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    head = f"""# Circles that grow, tilt, and rests for {HOURS:g} h; means over 10 s of records of 10 ms.
# Made by ../make_runs.py.
start = 2026-03-02T06:00:00+01:00
zone = "Europe/Berlin"
sampling = "{CORE * PER_BLOCK:g} s"
provenance = "synthetic: signals and sampling of paper 001, section 16.3.6; the paper prints no values"
synthetic = ["loads"]
initial_temperature = "21 degC"
"""
    (folder / "run.toml").write_text(head, encoding="utf-8")
    speeds = values[:, 1::3].max(axis=0)
    print(f"mixed_paths: {len(lines) - 1} rows; struts at {speeds.min():.3f} to {speeds.max():.3f} m/s at most (10 s)")


if __name__ == "__main__":
    main()

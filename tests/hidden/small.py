"""The small machine of the tests with a hidden fault: its full model on another mesh, with other parameters, and noise.

The description that is diagnosed is `tests/machines/slide` with more sensors. The truth is the same machine on a finer
mesh, its films, conductances and losses drawn anew (standard deviations 15 %, 25 % and 8 %), stepped as a full model by
the command line: `twin hide`, then `twin simulate`. Faults of a log are hidden in the run of a machine without a fault.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from twin.cli.main import run as command
from twin.inject.machines.text_edits import spread_values, with_divisions

SLIDE = Path(__file__).parents[1] / "machines" / "slide" / "machine.toml"
HOURS, RUNS, SAMPLING = 4, 2, 120.0
NOISE = ("--noise", "0.05 K", "--tcp-noise", "0.5 um", "--tcp-every", "15 min")
SENSORS = {
    "rail": ("rail_1", (0.3, -0.1, 0.13)),
    "screw": ("screw", (0.2, 0.0, 0.135)),
    "bed_back": ("bed", (-0.2, 0.15, 0.05)),
    "bed_end": ("bed", (0.4, 0.0, 0.05)),
    "slide_end": ("slide", (0.12, 0.0, 0.175)),
    "bed_top": ("bed", (0.1, -0.05, 0.1)),
}
FINER = {  # divisions of boxes
    "[8, 4, 2]": "[11, 6, 3]", "[4, 5, 1]": "[5, 6, 2]", "[10, 1, 1]": "[13, 1, 1]", "[9, 1, 1]": "[12, 1, 1]",
    "[3, 3, 1]": "[4, 4, 1]",
}  # fmt: skip
SPREAD = {"natural": 0.15, "forced": 0.15, "conductance": 0.25, "resistance": 0.08, "preload": 0.08}  # of logarithms


def twin(*arguments: object) -> None:
    """A command that must succeed."""
    assert command([str(a) for a in arguments]) == 0, arguments


@cache
def described() -> str:
    """machine.toml as it is diagnosed."""
    more = (f'\n[sensors.{name}]\npart = "{part}"\nposition = {list(at)}\n' for name, (part, at) in SENSORS.items())
    return SLIDE.read_text("utf-8") + "".join(more)


def other(seed: int) -> str:
    """machine.toml of the real machine: a finer mesh, parameters drawn."""
    return spread_values(with_divisions(described(), FINER), SPREAD, np.random.default_rng(seed))


def folder_of(text: str, folder: Path) -> Path:
    """A machine's folder."""
    folder.mkdir()
    (folder / "machine.toml").write_text(text, encoding="utf-8")
    return folder


def loads(folder: Path, seed: int) -> Path:
    """A run folder of loads alone: strokes, currents and pauses that are drawn, air that swings."""
    folder.mkdir()
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 3600.0 * HOURS + 1.0, SAMPLING)

    def switched(top: float, length: int) -> np.ndarray:
        return top * np.repeat(rng.random(len(time) // length + 1), length)[: len(time)]

    speed = switched(20.0, 20) * (switched(1.0, 33) > 0.3)
    current = switched(9.0, 26) * (switched(1.0, 41) > 0.25)
    position = 150.0 * np.sin(time / 700.0) * (speed > 0.0)
    air = 20.0 + 1.5 * np.sin(2.0 * np.pi * time / (6.0 * 3600.0) + seed)
    header = "time [s],x_position [mm],x_speed [m/min],x_motor_current [A],shop_air [degC]"
    rows = np.column_stack([time, position, speed, current, air])
    lines = [header, *(",".join(f"{v:.6g}" for v in row) for row in rows)]
    (folder / "loads.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (folder / "run.toml").write_text(
        f'sampling = "{SAMPLING:g} s"\nprovenance = "made for a test"\nsynthetic = ["loads"]\n'
        'initial_temperature = "20 degC"\n',
        encoding="utf-8",
    )
    return folder


def simulated(machine: Path, out: Path) -> list[Path]:
    """The measured runs of a machine."""
    made = []
    for k in range(RUNS):
        source = out.parent / f"loads_{k}"
        if not source.exists():
            loads(source, k)
        made.append(out / f"run_{k}")
        twin("simulate", machine, source, "-o", made[-1], *NOISE, "--seed", k + 1)
    return made

"""Three days of production for the machine of the tests: jobs at their own speeds and currents, pauses, swinging air.

usage: python tests/diagnose/four_nodes/runs/make_runs.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
ROWS, EVERY = 480, 60.0  # eight hours, a row a minute


def write(name: str, seed: int) -> None:
    """A run folder with loads."""
    rng = np.random.default_rng(seed)
    time = EVERY * np.arange(ROWS)
    speed, current, at = np.zeros(ROWS), np.zeros(ROWS), 0
    while at < ROWS:
        length, pause = rng.integers(10, 60), rng.choice([3, 10, 50])
        speed[at : at + length], current[at : at + length] = rng.uniform(500.0, 6000.0), rng.uniform(2.5, 14.0)
        at += length + pause
    air = 20.0 + 1.5 * np.sin(2 * np.pi * time / (14 * 3600.0) + seed)
    folder = HERE / name
    folder.mkdir(exist_ok=True)
    rows = np.column_stack([time, speed, current, air])
    header = "time [s],speed [1/min],current [A],air [degC]"
    np.savetxt(folder / "loads.csv", rows, ["%.0f", "%.0f", "%.2f", "%.3f"], ",", header=header, comments="")
    facts = 'sampling = "60 s"\nprovenance = "made by make_runs.py"\nsynthetic = ["loads"]\n'
    (folder / "run.toml").write_text(facts + 'initial_temperature = "20 degC"\n', encoding="utf-8")


if __name__ == "__main__":
    for number, day in enumerate(("monday", "tuesday", "wednesday"), start=1):
        write(day, number)

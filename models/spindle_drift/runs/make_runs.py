"""Run folders from the measured drift of a spindle: `python make_runs.py DATA -o FOLDER`. Needs numpy only.

Without DATA it writes `warm_up` beside this file: synthetic loads, for commands that need a run and no measurement.

DATA holds loads.csv (spindle speed), temperatures.csv (t1 .. t16) and displacement.csv (ch1 .. ch5), one row every
15 s on one clock. Two runs are written:

- `training`: the hours before the first start at the fourth speed (0 to 24 h), a displacement every ten minutes;
- `sealed`: loads from the start of the recording, because a machine remembers, displacements from 24 h on, all of them,
  beside the first row of the recording, from which they count.

ch1 is dx, ch3 dy, ch5 dz. Whether the spindle turns is a column that a law needs; it is made of the speed.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np

HOUR = 3600.0
SPLIT = 24 * HOUR  # s, between training and sealed rows
EVERY = 600.0  # s, between displacements of the training run: residuals of neighbours tell nothing new
# um: what six nodes leave is alike for an hour, so six rows tell little more than one: 2.5 um an hour times sqrt(6).
# Far above the probes' own noise of 0.05 um; with that, 24 hours would seem to know everything about every guess.
SIGMA = 6.0
CHANNELS = {"dx": "ch1", "dy": "ch3", "dz": "ch5"}
ENVIRONMENTS = ("t1", "t4", "t11")  # sensors that machine.toml reads as environments
INITIAL = "t1"  # its first value stands for the machine at the start: see machine.toml


@dataclass(frozen=True)
class Recording:
    """One row per sample."""

    time: np.ndarray  # (n,) s
    speed: np.ndarray  # (n,) 1/min
    temperatures: dict[str, np.ndarray]  # t1 .. t16, (n,) degC
    displacements: dict[str, np.ndarray]  # ch1 .. ch5, (n,) um


def read_table(path: Path) -> dict[str, np.ndarray]:
    """Columns by name, without the unit in the header."""
    with path.open(encoding="utf-8") as file:
        header = file.readline().strip().split(",")
        values = np.loadtxt(file, delimiter=",")
    return {name.split(" [")[0]: values[:, i] for i, name in enumerate(header)}


def read_recording(folder: Path) -> Recording:
    """Raises ValueError where the three tables are not on one clock."""
    loads, temperatures, displacements = (
        read_table(folder / name) for name in ("loads.csv", "temperatures.csv", "displacement.csv")
    )
    time = loads.pop("time")
    for table in (temperatures, displacements):
        if not np.array_equal(table.pop("time"), time):
            raise ValueError(f"{folder}: the tables are not on one clock")
    return Recording(time, loads["spindle.speed"], temperatures, displacements)


def write_table(path: Path, columns: dict[str, np.ndarray], rows: np.ndarray, decimals: int) -> None:
    lines = [",".join(columns)]
    values = np.column_stack([column[rows] for column in columns.values()])
    lines += [",".join(f"{v + 0.0:.10g}" for v in row) for row in np.round(values, decimals)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def write_run(
    folder: Path, recording: Recording, end: float, displacements: np.ndarray, about: str, sigma: float | None = None
) -> None:
    """Loads and temperatures up to `end` [s], displacements at the rows (n,) bool, with `sigma` [um] where given."""
    folder.mkdir(parents=True, exist_ok=True)
    time, until = recording.time, recording.time <= end
    loads = {
        "time [s]": time,
        "spindle_speed [1/min]": recording.speed,
        "running [1]": (recording.speed > 0.0).astype(float),
        **{f"{name} [degC]": recording.temperatures[name] for name in ENVIRONMENTS},
    }
    sensors = {f"{name} [degC]": values for name, values in recording.temperatures.items()}
    tcp = {f"{axis} [um]": recording.displacements[channel] for axis, channel in CHANNELS.items()}
    if sigma is not None:
        tcp["sigma [um]"] = np.full(len(time), sigma)
    write_table(folder / "loads.csv", loads, until, 3)
    write_table(folder / "temperatures.csv", {"time [s]": time, **sensors}, until, 3)
    write_table(folder / "tcp.csv", {"time [s]": time, **tcp}, displacements, 4)
    hours = time[displacements][1:] / HOUR
    text = f"""# {about}
# Made by models/spindle_drift/runs/make_runs.py from a recording on a real machine.
sampling = "15 s"
provenance = "measured; source and licence: models/spindle_drift/README.md"
synthetic = []
initial_temperature = "{recording.temperatures[INITIAL][0]:g} degC"
tcp_reference = "first"
segments = [{{ name = "{folder.name}", start = "{hours[0]:g} h", end = "{hours[-1]:g} h" }}]
"""
    (folder / "run.toml").write_text(text, encoding="utf-8")
    print(f"{folder}: {int(until.sum())} rows, {int(displacements.sum())} displacements")


def warm_up() -> dict[str, np.ndarray]:
    """Synthetic loads: 4 h at 4000 1/min, 2 h off, the air conditioning on all the time."""
    time = np.arange(0.0, 6 * HOUR + 1.0, 60.0)
    speed = np.where((time >= 600.0) & (time < 600.0 + 4 * HOUR), 4000.0, 0.0)
    room = 25.0 + 0.5 * (1.0 - np.cos(2.0 * np.pi * time / (12 * HOUR)))
    cycle = 0.9 * np.sin(2.0 * np.pi * time / (27 * 60.0))
    return {
        "time [s]": time,
        "spindle_speed [1/min]": speed,
        "running [1]": (speed > 0.0).astype(float),
        "t1 [degC]": room + 0.15 * cycle,
        "t4 [degC]": room - 0.8 + cycle + 2.0 * speed / 5000.0,
        "t11 [degC]": 25.3 + 0.1 * (room - 25.0),
    }


def write_warm_up(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    columns = warm_up()
    write_table(folder / "loads.csv", columns, np.ones(len(columns["time [s]"]), dtype=bool), 2)
    text = """# One speed for 4 h, then 2 h at rest: loads alone, nothing of them measured. Made by ../make_runs.py.
start = 2026-03-02T06:00:00+01:00
zone = "Europe/Berlin"
sampling = "60 s"
provenance = "synthetic: plausible speed and temperatures"
synthetic = ["loads"]
initial_temperature = "25 degC"
"""
    (folder / "run.toml").write_text(text, encoding="utf-8")
    print(f"{folder.name}: {len(columns['time [s]'])} rows")


def write_runs(data: Path, folder: Path) -> None:
    recording = read_recording(data)
    time = recording.time
    if time[-1] <= SPLIT:
        raise ValueError(f"{data}: the recording ends before {SPLIT / HOUR:g} h: nothing is left to be sealed")
    few = (np.mod(time, EVERY) == 0.0) & (time <= SPLIT)
    write_run(folder / "training", recording, SPLIT, few, "Three speeds, 4 h on and 4 h off each.", SIGMA)
    sealed = (time == time[0]) | (time > SPLIT)
    write_run(folder / "sealed", recording, float(time[-1]), sealed, "The same and what came afterwards.")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path, nargs="?", help="folder with loads.csv, temperatures.csv, displacement.csv")
    parser.add_argument("-o", "--output", type=Path, default=Path("out/spindle_drift"), help="folder for the runs")
    arguments = parser.parse_args()
    if arguments.data is None:
        write_warm_up(Path(__file__).parent / "warm_up")
    else:
        write_runs(arguments.data, arguments.output)


if __name__ == "__main__":
    main()

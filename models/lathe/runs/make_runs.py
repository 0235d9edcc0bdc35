"""Run folders from the measured days of a lathe: `python make_runs.py DATA -o FOLDER [--days 20200701 ...]`.

Needs numpy only. Without DATA it writes `warm_up` beside this file: synthetic loads, for commands that need a run and
no measurement.

DATA holds one CSV file a day: `Time` [min], 24 temperatures [degC], `Disp. X` and `Disp. Z` [um], a row about every 36
s. Each becomes a run folder of its name. The spindle speed was not logged: it follows PLAN. All temperatures go to
temperatures.csv, those that the description uses as air to loads.csv as well; a displacement every five minutes to
tcp.csv. Nothing is left out or repaired: `twin check` says what is wrong with a day.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

HOUR = 3600.0
# day: (1/min, h) one after the other, from the start of the run; then it rests
PLAN: dict[str, tuple[tuple[float, float], ...]] = {
    "20200615": ((2000, 5),),
    "20200616": ((1000, 5),),
    "20200617": ((1000, 2.5), (2000, 2.5)),
    "20200618": ((2000, 2.5), (1000, 2.5)),
    "20200701": ((2000, 5),),
    "20200702": ((1000, 5),),
    "20200703": ((1000, 2.5), (2000, 2.5)),
    "20200706": ((2000, 2.5), (1000, 2.5)),
    "20200708": ((2000, 6),),
    "20200709": ((1000, 6),),
    "20200710": ((1000, 3), (2000, 3)),
    "20200713": ((2000, 3), (1000, 3)),
    "20200723": ((1200, 2.5), (0, 1), (1800, 2.5)),
    "20200727": ((2000, 5),),
    "20200729": ((1000, 5),),
    "20200730": ((1000, 2.5), (2000, 2.5)),
    "20200805": ((1000, 5),),
    "20200807": ((2000, 2.5), (1000, 2.5)),
    "20200810": ((1800, 2.5), (0, 1), (1200, 2.5)),
    "20200813": ((2000, 6),),
    "20200814": ((1000, 6),),
    "20200817": ((2000, 6),),
    "20200818": ((1000, 6),),
}
NAMES = {"Spindle Motor": "spindle_motor", "X Motor": "x_motor", "Z Motor": "z_motor"}
AIR = ("TC04", "TC08")  # that machine.toml reads as environments
STRUCTURE = tuple(f"PT{k:02d}" for k in range(1, 14))  # their median is the machine at the start
PROBES = {"dx": "Disp. X", "dz": "Disp. Z"}
EVERY = 300.0  # s, between displacements
# um: a network of seven nodes leaves some 10 um that is alike for an hour, so twelve rows tell little more than one
SIGMA = 12.0


@dataclass(frozen=True)
class Day:
    """One row per sample."""

    name: str
    time: np.ndarray  # (n,) s
    speed: np.ndarray  # (n,) 1/min
    temperatures: dict[str, np.ndarray]  # (n,) degC
    displacements: dict[str, np.ndarray]  # (n,) um


def speed_at(plan: Sequence[tuple[float, float]], time: np.ndarray) -> np.ndarray:
    """1/min (n,) at times [s]."""
    ends = np.cumsum([hours for _, hours in plan]) * HOUR
    speeds = np.array([speed for speed, _ in plan] + [0.0])
    return np.asarray(speeds[np.searchsorted(ends, time, side="right")])


def read_day(path: Path) -> Day:
    """A file of the recording. Raises ValueError for a day that is not in PLAN."""
    if path.stem not in PLAN:
        raise ValueError(f"{path}: its spindle speeds are not known; add the day to PLAN")
    with path.open(encoding="utf-8") as file:
        header = file.readline().strip().split(",")
        columns = dict(zip(header, np.loadtxt(file, delimiter=",").T, strict=True))
    time = 60.0 * columns.pop("Time")
    displacements = {axis: columns.pop(name) for axis, name in PROBES.items()}
    temperatures = {NAMES.get(name, name): values for name, values in columns.items()}
    return Day(path.stem, time, speed_at(PLAN[path.stem], time), temperatures, displacements)


def write_table(path: Path, columns: dict[str, np.ndarray], decimals: int) -> None:
    lines = [",".join(columns)]
    lines += [
        ",".join(f"{v + 0.0:.10g}" for v in row) for row in np.round(np.column_stack([*columns.values()]), decimals)
    ]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def write_run(folder: Path, day: Day) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    turns = (day.speed > 0.0).astype(float)
    loads = {"time [s]": day.time, "spindle_speed [1/min]": day.speed, "feeding [1]": turns}
    write_table(folder / "loads.csv", loads | {f"{n} [degC]": day.temperatures[n] for n in AIR}, 3)
    sensors = {f"{name} [degC]": values for name, values in day.temperatures.items()}
    write_table(folder / "temperatures.csv", {"time [s]": day.time, **sensors}, 3)
    few = np.unique(np.searchsorted(day.time, np.arange(day.time[0], day.time[-1], EVERY)))
    tcp = {"time [s]": day.time[few], "dx [um]": day.displacements["dx"][few],
           "dz [um]": day.displacements["dz"][few], "sigma [um]": np.full(len(few), SIGMA)}  # fmt: skip
    write_table(folder / "tcp.csv", tcp, 4)
    begin = float(np.median([day.temperatures[name][0] for name in STRUCTURE]))
    text = f"""# Day {day.name} of a lathe. Made by models/lathe/runs/make_runs.py from a recording on a real machine.
provenance = "measured, but the speed, which is planned; source: models/lathe/README.md"
synthetic = []
initial_temperature = "{begin:g} degC"
tcp_reference = "first"
"""
    (folder / "run.toml").write_text(text, encoding="utf-8")
    print(f"{folder}: {len(day.time)} rows, {len(few)} displacements")


def write_warm_up(folder: Path) -> None:
    """Synthetic loads: 3 h at 2000 1/min, 1 h at rest, in a room of 22 degC."""
    folder.mkdir(parents=True, exist_ok=True)
    time = np.arange(0.0, 4 * HOUR + 1.0, 60.0)
    speed = speed_at(((2000.0, 3.0),), time)
    warmed = np.where(time < 3 * HOUR, 1.0 - np.exp(-time / HOUR), 0.95)
    columns = {"time [s]": time, "spindle_speed [1/min]": speed, "feeding [1]": (speed > 0.0).astype(float),
               "TC04 [degC]": 21.0 + 2.5 * warmed, "TC08 [degC]": 20.0 + 1.0 * warmed}  # fmt: skip
    write_table(folder / "loads.csv", columns, 2)
    text = """# 3 h at 2000 1/min, then 1 h at rest: loads alone, nothing of them measured. Made by ../make_runs.py.
start = 2026-03-02T06:00:00+01:00
zone = "Europe/Berlin"
sampling = "60 s"
provenance = "synthetic: plausible speed and temperatures"
synthetic = ["loads"]
initial_temperature = "22 degC"
"""
    (folder / "run.toml").write_text(text, encoding="utf-8")
    print(f"{folder.name}: {len(time)} rows")


def write_runs(data: Path, folder: Path, days: Sequence[str] = ()) -> list[Path]:
    """The run folders of some days, all by default. Raises ValueError for a day that is not there."""
    paths = {path.stem: path for path in sorted(data.glob("*.csv"))}
    missing = [day for day in days if day not in paths]
    if missing or not paths:
        raise ValueError(
            f"{data}: no day {', '.join(missing) or 'at all'}; days are {', '.join(paths) or 'files DATE.csv'}"
        )
    chosen = list(days) or list(paths)
    for day in chosen:
        write_run(folder / day, read_day(paths[day]))
    return [folder / day for day in chosen]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path, nargs="?", help="folder with one CSV file a day")
    parser.add_argument("-o", "--output", type=Path, default=Path("out/lathe"), help="folder for the runs")
    parser.add_argument("--days", nargs="*", default=[], help="only these")
    arguments = parser.parse_args()
    if arguments.data is None:
        write_warm_up(Path(__file__).parent / "warm_up")
    else:
        write_runs(arguments.data, arguments.output, arguments.days)


if __name__ == "__main__":
    main()

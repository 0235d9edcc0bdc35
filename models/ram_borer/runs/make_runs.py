"""Write the load logs of the five tests beside this file: `python make_runs.py`. Needs numpy only.

Table 1 of paper 003: the spindle idles at constant speed for hours, the headstock stands at a height or travels between
0 and 1200 mm (test 5). One test a day, from a machine at the temperature of the hall: every test is a run of its own
with its own initial state. The paper logs at 1 s and prints neither power nor air: those here are plausible for a
spindle of 31 kW, and synthetic.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

HOUR = 3600.0
CYCLE, TRAVEL, STROKE = 300.0, 240.0, 80.0  # s of test 5: a cycle, its part on the move, one way up, down and back
MIDDLE, TOP = 600.0, 1200.0  # mm
FEED = 1.8  # m/min: the strokes start and end on rows of the log
IDLE, REST, MOVING = 1.9, 8.0, 11.0  # kW at 4000 1/min; A of the Y motor


@dataclass(frozen=True)
class Test:
    """A row of Table 1. The duration and the hall are ours."""

    speed: float  # 1/min
    height: float | None  # mm; None: on the move
    hours: float
    drift: float  # K, of the hall over a day
    date: str


TESTS = {
    "test_1": Test(4000.0, 0.0, 6.5, 0.6, "2026-03-09"),
    "test_2": Test(2000.0, 600.0, 6.0, -0.4, "2026-03-10"),
    "test_3": Test(4000.0, 1200.0, 7.0, 0.8, "2026-03-11"),
    "test_4": Test(4000.0, 600.0, 6.5, 0.3, "2026-03-12"),
    "test_5": Test(4000.0, None, 8.0, -0.6, "2026-03-13"),
}


def heights(test: Test, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Position [mm] and speed [m/min] of Y. On the move: three strokes, then a minute at 600 mm to measure."""
    if test.height is not None:
        return np.full_like(time, test.height), np.zeros_like(time)
    moving = np.mod(time, CYCLE) < TRAVEL
    stroke = np.interp(np.mod(time, CYCLE) / STROKE % 1.0, [0.0, 0.25, 0.75, 1.0], [MIDDLE, TOP, 0.0, MIDDLE])
    return np.where(moving, stroke, MIDDLE), np.where(moving, FEED, 0.0)


def columns(test: Test, seed: int) -> list[tuple[str, np.ndarray, int]]:
    """Header, values and decimals of every column."""
    sampling = 10.0 if test.height is None else 30.0
    time = np.arange(0.0, test.hours * HOUR + sampling / 2, sampling)
    rng = np.random.default_rng(seed)
    position, speed = heights(test, time)
    # the losses of gears and bearings grow with speed to the power of 1.25, and fall as the oil warms
    power = IDLE * (test.speed / 4000.0) ** 1.25 * (1.0 + 0.15 * np.exp(-time / 2400.0))
    power = power + 0.02 * rng.standard_normal(len(time))
    day = np.sin(2.0 * np.pi * time / (20.0 * HOUR))
    air = 20.0 + test.drift * day + 0.1 * np.sin(2.0 * np.pi * time / 4200.0)
    return [
        ("time [s]", time, 0),
        ("y_position [mm]", position, 1),
        ("z_position [mm]", np.zeros_like(time), 0),
        ("y_speed [m/min]", speed, 1),
        ("y_current [A]", np.where(speed > 0.0, MOVING, REST) + 0.03 * rng.standard_normal(len(time)), 2),
        ("spindle_speed [1/min]", np.full_like(time, test.speed), 0),
        ("spindle_power [kW]", power, 3),
        ("oil_flow [l/min]", np.full_like(time, 8.0), 0),
        ("oil [degC]", 20.0 + 0.5 * (air - 20.0), 2),
        ("ambient [degC]", air, 2),
    ]


def facts(name: str, test: Test) -> str:
    height = f"Y = {test.height:.0f} mm" if test.height is not None else "Y moving between 0 and 1200 mm"
    return f"""\
# Paper 003, Table 1, {name.replace("_", " ")}: {test.speed:.0f} 1/min, {height}. Made by ../make_runs.py.
start = {test.date}T07:00:00+01:00
zone = "Europe/Prague"
sampling = "{10 if test.height is None else 30} s"
provenance = "synthetic loads after Table 1 of paper 003: power, current, oil and air are plausible, not measured"
synthetic = ["loads"]
initial_temperature = "20 degC"
"""


def main() -> None:
    for seed, (name, test) in enumerate(TESTS.items(), start=1):
        table = columns(test, seed)
        lines = [",".join(header for header, _, _ in table)]
        for row in zip(*(values.tolist() for _, values, _ in table), strict=True):
            lines.append(",".join(f"{round(v, d) + 0.0:.10g}" for v, (_, _, d) in zip(row, table, strict=True)))
        folder = Path(__file__).parent / name
        folder.mkdir(exist_ok=True)
        (folder / "loads.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
        (folder / "run.toml").write_text(facts(name, test), encoding="utf-8")
        print(f"{folder}: {len(lines) - 1} rows")


if __name__ == "__main__":
    main()

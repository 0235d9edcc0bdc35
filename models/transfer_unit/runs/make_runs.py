"""Write the runs beside this file: `python make_runs.py`. Needs numpy only.

Four scenarios of paper 002. `passive`: the machine is off, the hall is heated in the morning and the electronics on
top are switched on first (Fig. 9). `warmup`: the part program without a workpiece for 60 min, the paper's calibration
test. `validation`: the same for 140 min (Fig. 16). `working_day`: 8 h of production in a room that warms up
(Figs. 17, 18). The paper prints no loads: speeds, torques, powers and air temperatures here are plausible for a unit of
this size, and synthetic.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

MINUTE, HOUR = 60.0, 3600.0
LEAD = 0.010  # m, of the screws
GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0

# means over a cycle of the part program: axis speeds m/s, rms currents A, torques N m, speeds 1/s, power W
SPEED = {"x": 0.060, "y": 0.050, "z": 0.100}
CURRENT = {"x": (0.7, 2.3), "y": (0.6, 2.0)}  # at rest, while the program runs
HOLDING, DRIVING = 2.9, 3.4  # N m of the Z motor: the weight of the headstock; rms with the accelerations
TABLE = (8.0, 8.0)  # N m, 1/s: the indexing drive
SPINDLE = 75.0  # 1/s
IDLE, CUTTING = 500.0, 900.0  # W taken up by the spindle motor without and with a workpiece


@dataclass(frozen=True)
class Scenario:
    """One run; times in s, arrays (n,)."""

    duration: float
    sampling: float
    room: Callable[[np.ndarray], np.ndarray]  # degC
    initial: float  # degC of the whole machine
    works: Callable[[np.ndarray], np.ndarray]  # share of the time that the part program runs
    power: float  # W of the spindle while it runs
    electronics_on: float  # s
    about: str  # comment at the head of run.toml


def heated_hall(time: np.ndarray) -> np.ndarray:
    """The heating starts with the shift: 17 degC, quickly to 20 degC, slowly on."""
    return 17.0 + 3.0 * (1.0 - np.exp(-time / (1.2 * HOUR))) + 0.1 * np.sin(2.0 * np.pi * time / (0.9 * HOUR))


def testing_room(time: np.ndarray) -> np.ndarray:
    return 21.0 + 0.1 * np.sin(2.0 * np.pi * time / (1.5 * HOUR))


def warm_day(time: np.ndarray) -> np.ndarray:
    """From 20 to 23 degC in the first six hours."""
    rise = 3.0 * np.sin(0.5 * np.pi * np.minimum(time / (6.0 * HOUR), 1.0)) ** 2
    return 20.0 + rise + 0.1 * np.sin(2.0 * np.pi * time / (1.1 * HOUR))


def off(time: np.ndarray) -> np.ndarray:
    return np.zeros_like(time)


def always(time: np.ndarray) -> np.ndarray:
    return np.ones_like(time)


def with_stops(time: np.ndarray) -> np.ndarray:
    """Production: two minutes of every hour are lost to checks and chips."""
    minute = np.mod(time, HOUR) / MINUTE
    return np.where((minute >= 28.0) & (minute < 30.0), 0.0, 1.0)


SCENARIOS = {
    "passive": Scenario(
        8 * HOUR, 60.0, heated_hall, 17.0, off, 0.0, 10 * MINUTE,
        "Machine off in a hall that is heated in the morning; the electronics on top are switched on after 10 min.",
    ),
    "warmup": Scenario(
        1 * HOUR, 10.0, testing_room, 21.0, always, IDLE, 0.0,
        "Part program without a workpiece for 60 min: the calibration test of paper 002, section 2.3.",
    ),
    "validation": Scenario(
        140 * MINUTE, 10.0, testing_room, 21.0, always, IDLE, 0.0,
        "Part program without a workpiece for 140 min: the validation test of paper 002, Fig. 16.",
    ),
    "working_day": Scenario(
        8 * HOUR, 20.0, warm_day, 20.0, with_stops, CUTTING, 0.0,
        "Production for 8 h in a room that warms by 3 K: the working day of paper 002, Figs. 17 and 18.",
    ),
}  # fmt: skip


def weyl(n: int, seed: float) -> np.ndarray:
    """(n,) numbers in [0, 1), spread evenly over any stretch of rows, as the dwell of a repeated program is."""
    return np.mod(seed + GOLDEN * np.arange(n), 1.0)


def cabin(time: np.ndarray, room: np.ndarray, works: np.ndarray, sampling: float) -> np.ndarray:
    """Air around the unit [degC]: the room's, up to 2.5 K warmer while the unit works (delay 30 min)."""
    warmer = np.zeros_like(time)
    keep = np.exp(-sampling / (30 * MINUTE))
    for k in range(1, len(time)):
        warmer[k] = keep * warmer[k - 1] + (1.0 - keep) * 2.5 * works[k - 1]
    return room + warmer


def loads(scenario: Scenario) -> list[tuple[str, np.ndarray, int]]:
    """Headers, values and decimals of the log."""
    time = np.arange(0.0, scenario.duration + scenario.sampling / 2, scenario.sampling)
    n, works, room = len(time), scenario.works(time), scenario.room(time)
    rng = np.random.default_rng(2)
    busy = works * (1.0 + 0.02 * rng.standard_normal(n))
    columns = [("time [s]", time, 0)]
    places = {"x": 80.0 * weyl(n, 0.1) - 40.0, "y": 80.0 * weyl(n, 0.6) - 40.0, "z": 130.0 * weyl(n, 0.3) - 35.0}
    columns += [(f"{a}_position [mm]", np.where(works > 0, place, 0.0), 1) for a, place in places.items()]
    columns += [(f"{a}_speed [m/min]", 60.0 * busy * v, 2) for a, v in SPEED.items()]
    for axis, (rest, driving) in CURRENT.items():
        columns.append((f"{axis}_current [A]", np.sqrt(rest**2 + busy * (driving**2 - rest**2)), 2))
    on = scenario.power > 0  # the brake holds the headstock of a machine that is off
    columns += [
        ("z_torque [N*m]", on * (HOLDING + busy * (DRIVING - HOLDING)), 2),
        ("z_motor_speed [1/min]", 60.0 * busy * SPEED["z"] / LEAD, 0),
        ("table_torque [N*m]", busy * TABLE[0], 2),
        ("table_motor_speed [1/min]", 60.0 * busy * TABLE[1], 0),
        ("spindle_speed [1/min]", 60.0 * works * SPINDLE, 0),
        ("spindle_power [W]", busy * scenario.power, 0),
        ("electronics_on [1]", (time >= scenario.electronics_on).astype(float), 0),
        ("room [degC]", room, 2),
        ("cabin [degC]", cabin(time, room, works, scenario.sampling), 2),
    ]
    return columns


def write(folder: Path, scenario: Scenario) -> None:
    columns = loads(scenario)
    rows = zip(*(np.round(values, decimals) + 0.0 for _, values, decimals in columns), strict=True)
    lines = [",".join(header for header, _, _ in columns)]
    lines += [",".join(f"{v:.10g}" for v in row) for row in rows]
    folder.mkdir(exist_ok=True)
    (folder / "loads.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    head = f"""# {scenario.about}
# Made by ../make_runs.py.
start = 2026-03-02T06:00:00+01:00
zone = "Europe/Berlin"
sampling = "{scenario.sampling:g} s"
provenance = "synthetic loads after the text of paper 002: speeds, torques, powers and air are plausible, not measured"
synthetic = ["loads"]
initial_temperature = "{scenario.initial:g} degC"
"""
    (folder / "run.toml").write_text(head, encoding="utf-8")
    print(f"{folder.name}: {len(lines) - 1} rows")


def main() -> None:
    for name, scenario in SCENARIOS.items():
        write(Path(__file__).parent / name, scenario)


if __name__ == "__main__":
    main()

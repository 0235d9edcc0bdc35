"""Write the runs beside this file: `python make_runs.py`. Needs numpy only.

Paper 004, sections 3 and 4: for 240 min the gantry travels between Y = -200 and 400 mm at 70 m/min; X and Z stand.
`constant_room`: room at 24.6 degC, machine at 24 degC at the start. `ramped_room`: the room warms from 25.5 to
26.8 degC (Fig. 10); the paper prints neither its course nor the machine's temperature at the start. `standing`: the
ramp alone, nothing moves. Forces and currents are computed here, the paper prints none.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

MINUTE = 60.0
GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0
DURATION, SAMPLING = 240 * MINUTE, 10.0  # s
FROM, TO = -0.200, 0.400  # m
FEED = 70.0 / 60.0  # m/s

# the drive: two motors side by side
MASS = 300.0  # kg, half of what travels
ACCELERATION = 10.0  # m/s^2; the machine could do 25
FRICTION = 30.0  # N of guides and seals of one side, (0.0015 * 10 kN + 40 N) / 2 rounded up
FORCE_PER_CURRENT = 3000.0 / 24.0  # N/A, rms
HOLDING = (150.0, 1.5)  # N, A of the Z motor: what its balance leaves


@dataclass(frozen=True)
class Scenario:
    """One run; times in s, temperatures in degC."""

    room: Callable[[np.ndarray], np.ndarray]
    initial: float
    travels: bool
    about: str  # comment at the head of run.toml


def constant(time: np.ndarray) -> np.ndarray:
    return np.full_like(time, 24.6)


def ramp(time: np.ndarray) -> np.ndarray:
    return 25.5 + 1.3 * time / DURATION


SCENARIOS = {
    "constant_room": Scenario(constant, 24.0, True, "Y at 70 m/min for 240 min in a room at 24.6 degC (Figs. 6 to 8)."),
    "ramped_room": Scenario(ramp, 24.9, True, "The same in a room that warms from 25.5 to 26.8 degC (Figs. 10, 12)."),
    "standing": Scenario(ramp, 24.9, False, "The room warms from 25.5 to 26.8 degC; nothing moves."),
}


def cycle() -> tuple[float, float, float]:
    """Mean speed [m/s] and rms force [N] over a stroke without a pause, and the time [s] that it takes."""
    ramps = 2.0 * FEED / ACCELERATION  # s of speeding up and slowing down
    stroke = (TO - FROM - FEED**2 / ACCELERATION) / FEED + ramps
    accelerating = np.hypot(MASS * ACCELERATION, FRICTION)
    rms = np.sqrt((accelerating**2 * ramps + FRICTION**2 * (stroke - ramps)) / stroke)
    return (TO - FROM) / stroke, float(rms), stroke


def loads(scenario: Scenario) -> list[tuple[str, np.ndarray, int]]:
    """Headers, values and decimals of the log. Rows hold means over their interval, positions at their time."""
    time = np.arange(0.0, DURATION + SAMPLING / 2, SAMPLING)
    room, zero, on = scenario.room(time), np.zeros_like(time), float(scenario.travels)
    speed, force, _ = cycle()
    spread = np.mod(0.3 + GOLDEN * np.arange(len(time)), 1.0)  # evenly over any stretch of rows, as the dwell is
    return [
        ("time [s]", time, 0),
        ("y_position [mm]", on * 1e3 * (FROM + (TO - FROM) * spread), 1),
        ("x_position [mm]", zero, 0),
        ("z_position [mm]", zero, 0),
        ("y_speed [m/min]", zero + on * 60.0 * speed, 2),
        ("x_speed [m/min]", zero, 0),
        ("z_speed [m/min]", zero, 0),
        ("y_force [N]", zero + on * force, 0),
        ("y_current [A]", zero + on * force / FORCE_PER_CURRENT, 2),
        ("x_force [N]", zero, 0),
        ("x_current [A]", zero, 0),
        ("z_force [N]", zero + on * HOLDING[0], 0),
        ("z_current [A]", zero + on * HOLDING[1], 2),
        ("room [degC]", room, 3),
    ]


def write(folder: Path, scenario: Scenario) -> None:
    columns = loads(scenario)
    rows = zip(*(np.round(values, decimals) + 0.0 for _, values, decimals in columns), strict=True)
    lines = [",".join(header for header, _, _ in columns)]
    lines += [",".join(f"{v:.10g}" for v in row) for row in rows]
    folder.mkdir(exist_ok=True)
    (folder / "loads.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    head = f"""# {scenario.about}
# Made by ../make_runs.py.
start = 2026-03-02T08:00:00+01:00
zone = "Europe/Berlin"
sampling = "{SAMPLING:g} s"
provenance = "synthetic: feed, stroke and room after paper 004; forces and currents computed"
synthetic = ["loads"]
initial_temperature = "{scenario.initial:g} degC"
"""
    (folder / "run.toml").write_text(head, encoding="utf-8")
    print(f"{folder.name}: {len(lines) - 1} rows")


def main() -> None:
    speed, force, stroke = cycle()
    print(f"a stroke takes {stroke:.3f} s: mean speed {60 * speed:.1f} m/min, rms force of a motor {force:.0f} N")
    for name, scenario in SCENARIOS.items():
        write(Path(__file__).parent / name, scenario)


if __name__ == "__main__":
    main()

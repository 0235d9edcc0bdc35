"""Write the loads of `identification`: `python make_identification.py`. Needs numpy only.

Twelve hours that tell parameters apart: every axis moves alone, then the spindle turns alone, then all work, then the
machine rests; the shop's door opens twice, once under load and once at rest. What works alone separates the gains of
sources; rest and draught separate films from sources and capacities. An R-test comes every hour.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from make_runs import (
    DOOR_CLOSES,
    DOOR_FALL,
    DOOR_OPENS,
    DRAUGHT,
    DRAUGHT_DELAY,
    DURATION,
    ENCLOSURE_DELAY,
    ENCLOSURE_RISE,
    ENCLOSURE_WARMS,
    FINE,
    HOUR,
    R_TEST,
    SAMPLING,
    SPEED,
    STILL_AIR,
    columns_of,
    follow,
    means,
    r_test,
    sweep,
    table,
)

MOVES = {0: (0.0, 2.0), 1: (2.0, 4.0), 2: (4.0, 6.0)}  # h in which each axis moves alone
SPINDLE, ALL = (6.0, 9.0), (9.0, 10.0)  # h
DOORS = ((5.0, 5.5), (10.5, 11.0))  # h
SPINDLE_SPEED, SPINDLE_CURRENT = 6000.0, 24.0  # 1/min, A


def within(time: np.ndarray, hours: tuple[float, float]) -> np.ndarray:
    return (time >= hours[0] * HOUR) & (time < hours[1] * HOUR)


def main() -> None:
    fine = np.arange(0.0, DURATION + FINE / 2, FINE)
    path, sweeping = np.zeros((len(fine), 5)), np.zeros((len(fine), 3), dtype=bool)
    testing = np.zeros(len(fine), dtype=bool)
    for axis, hours in MOVES.items():
        now = within(fine, hours) | within(fine, ALL)
        # axes that move together take different times, so that their positions fill the workspace
        path[now, axis] = sweep(fine[now] * (1.0 - 0.07 * axis))
        sweeping[now, axis] = True
    for end in np.arange(1, 13) * HOUR:
        now = (fine >= end - R_TEST) & (fine < end)
        path[now] = r_test(fine[now] - (end - R_TEST), path[now][0])
        testing |= now
    sweeping[testing] = False
    speed = np.abs(np.diff(path[:, :3], axis=0, append=path[-1:, :3])) / FINE
    speed[sweeping] = SPEED
    speed = np.minimum(speed, SPEED)
    rest, moving, share = np.array([0.8, 9.0, 0.6]), np.array([9.0, 5.0, 4.0]), speed / SPEED
    current = np.sqrt(rest**2 + share * moving**2)
    cutting = (within(fine, SPINDLE) | within(fine, ALL)) & ~testing

    time = np.arange(0.0, DURATION + SAMPLING / 2, SAMPLING)
    noise = 0.03 * np.random.default_rng(1).standard_normal((len(time), 3))
    is_open = np.any([within(time, hours) for hours in DOORS], axis=0)
    room = 22.0 + 0.4 * np.sin(2.0 * np.pi * time / (16 * HOUR)) + 0.1 * np.sin(2.0 * np.pi * time / (1.3 * HOUR))
    room = room - DOOR_FALL * follow(time, is_open, np.where(is_open, DOOR_OPENS, DOOR_CLOSES))
    wind = STILL_AIR + (DRAUGHT - STILL_AIR) * follow(time, is_open, DRAUGHT_DELAY)
    working = time < ALL[1] * HOUR
    enclosure = follow(time, room, ENCLOSURE_DELAY) + ENCLOSURE_RISE * follow(
        time, working & (time > 0), ENCLOSURE_WARMS
    )
    spindle_current = np.sqrt(means((SPINDLE_CURRENT * cutting) ** 2 + (2.0 * testing) ** 2))
    spindle = means(SPINDLE_SPEED * cutting), spindle_current
    columns = columns_of(time, path, speed, current, noise, spindle, (room, enclosure, wind))
    folder = Path(__file__).parent / "identification"
    folder.mkdir(exist_ok=True)
    (folder / "loads.csv").write_text(table(columns), encoding="utf-8")
    print(folder / "loads.csv")


if __name__ == "__main__":
    main()

"""Write the loads of the three runs for diagnosis: `python make_diagnosis.py`. Needs numpy only.

Twelve hours of production each, a row a minute: jobs of 6 to 20 min with their own speeds, shares of moving, cutting
forces and places in the workspace, so that no current is a multiple of a speed; between them every drive alone, pauses
and cooling. The shop has a daily course of some kelvins and draughts, the air behind the enclosure's doors is warmed by
the work. Every half hour the machine goes to three places, one a minute, where the TCP is measured. `diagnosis_sealed`
is kept for judging: another mix, another day.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from make_runs import (
    DURATION,
    ENCLOSURE_DELAY,
    FINE,
    HOUR,
    SAMPLING,
    STILL_AIR,
    Column,
    columns_of,
    follow,
    means,
    table,
)

MINUTE = 60.0
ROWS = 60.0  # s, of the log
MEASURED_EVERY, PLACES = 1800.0, np.array([[-0.28, -0.25, 0.10], [0.05, 0.28, -0.30], [0.30, -0.02, 0.28]])  # s, m
REST = np.array([0.8, 9.0, 0.6])  # A at standstill: Y carries the headstock
STROKE = 0.38  # m, half of it
WARM_DELAY = 40.0 * MINUTE  # s in which work warms the air behind the doors
WARMED = 3.5  # K by a spindle motor at SPINDLE_HOT
SPINDLE_HOT = 40.0  # A

DRIVES = ("x", "y", "z", "s")  # s: the spindle
Hours = tuple[float, float]


@dataclass(frozen=True)
class Day:
    """One run: what works when, in hours; what no block names rests."""

    name: str
    seed: int
    blocks: tuple[tuple[Hours, str], ...]  # the drives that work: "x", "xyzs"
    swing: float  # K, half of the shop's daily course
    phase: float  # h since the coldest hour of the day, at the start
    draughts: tuple[tuple[Hours, float], ...]  # m/s


DAYS = (
    Day("diagnosis_1", 11, (
        ((0.0, 1.1), "x"), ((1.6, 2.8), "s"), ((2.8, 3.8), "y"), ((4.3, 6.4), "xyzs"), ((6.4, 7.4), "z"),
        ((8.6, 9.4), "xz"), ((9.4, 10.6), "xyzs"),
    ), 2.5, 2.0, (((3.2, 3.7), 0.5), ((7.6, 8.2), 0.7), ((11.0, 11.3), 0.3))),
    Day("diagnosis_2", 12, (
        ((0.0, 1.8), "xyzs"), ((2.4, 3.3), "z"), ((3.3, 4.4), "y"), ((4.4, 5.0), "ys"), ((6.2, 7.4), "s"),
        ((7.4, 8.5), "x"), ((9.0, 10.9), "xyzs"),
    ), 3.0, 9.0, (((1.0, 1.4), 0.6), ((5.2, 5.6), 0.25), ((9.8, 10.4), 0.8))),
    Day("diagnosis_sealed", 13, (
        ((0.3, 2.2), "xyzs"), ((2.5, 3.3), "xs"), ((4.0, 5.4), "xyzs"), ((5.4, 6.2), "yz"), ((7.2, 8.0), "s"),
        ((8.0, 9.2), "xyzs"), ((9.6, 10.3), "xy"),
    ), 2.0, 4.0, (((4.6, 5.0), 0.7), ((6.4, 6.8), 0.4), ((10.6, 11.2), 0.6))),
)  # fmt: skip


@dataclass(frozen=True)
class Motion:
    """What the machine does, at the resolution FINE."""

    path: np.ndarray  # (m, 5) m, deg
    speed: np.ndarray  # (m, 3) m/s
    current: np.ndarray  # (m, 3) A
    spindle_speed: np.ndarray  # (m,) 1/min
    spindle_current: np.ndarray  # (m,) A


def motion(day: Day, time: np.ndarray) -> Motion:
    """time (m,) s. Every job draws its own speeds, shares of moving, forces, strokes and centres."""
    rng = np.random.default_rng(day.seed)
    speed, current = np.zeros((len(time), 3)), np.tile(REST, (len(time), 1))
    centre, half = np.zeros((len(time), 3)), np.full((len(time), 3), 0.1)
    spindle_speed, spindle_current = np.zeros(len(time)), np.zeros(len(time))
    for (begin, end), drives in day.blocks:
        at = begin * HOUR
        while at < end * HOUR - 1.0:
            until = min(at + rng.uniform(6.0, 20.0) * MINUTE, end * HOUR)
            now = (time >= at) & (time < until - rng.uniform(0.5, 2.0) * MINUTE)  # then the part is changed
            for k, name in enumerate("xyz"):
                # all numbers are drawn for every drive, so that a block's drives do not change the other blocks
                feed, share, force = rng.uniform(0.15, 0.58), rng.uniform(0.4, 0.95), rng.uniform(2.0, 10.5)
                cycle, stroke = rng.uniform(20.0, 50.0), rng.uniform(0.1, 0.3)
                middle = rng.uniform(-1.0, 1.0) * (STROKE - stroke)
                centre[time >= at, k], half[time >= at, k] = middle, stroke
                if name in drives:
                    moving = now & (np.mod(time - at, cycle) < share * cycle)
                    speed[moving, k] = feed
                    current[moving, k] = np.hypot(REST[k], force)
            turns, ampere, share = rng.uniform(1500.0, 9000.0), rng.uniform(8.0, 40.0), rng.uniform(0.5, 0.95)
            cycle = rng.uniform(60.0, 150.0)
            if "s" in drives:
                turning = now & (np.mod(time - at, cycle) < share * cycle)
                spindle_speed[turning], spindle_current[turning] = turns, ampere
            at = until
    measuring = np.mod(-time, MEASURED_EVERY) <= len(PLACES) * MINUTE
    measuring &= time > 0.0
    speed[measuring], current[measuring] = 0.0, REST
    spindle_speed[measuring], spindle_current[measuring] = 0.0, 0.0
    travelled = np.cumsum(speed, axis=0) * FINE
    phase = np.mod(travelled / (4.0 * half) + 0.25, 1.0)
    path = np.zeros((len(time), 5))
    path[:, :3] = centre + half * (4.0 * np.minimum(phase, 1.0 - phase) - 1.0)
    which = len(PLACES) - 1 - (np.mod(-time, MEASURED_EVERY) // MINUTE).astype(int)
    path[measuring, :3] = PLACES[np.clip(which[measuring], 0, None)]
    return Motion(path, speed, current, spindle_speed, spindle_current)


def air(day: Day, time: np.ndarray, spindle_current: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Air of the shop and behind the enclosure [degC], and its speed at the machine [m/s], (n,) each."""
    turn = 2.0 * np.pi / (24.0 * HOUR)
    course = -day.swing * np.cos(turn * (time + day.phase * HOUR))
    ripple = 0.25 * np.sin(2.0 * np.pi * time / (1.3 * HOUR)) + 0.1 * np.sin(2.0 * np.pi * time / (0.37 * HOUR))
    wind, cold = np.full(len(time), STILL_AIR), np.zeros(len(time))
    for (begin, end), strength in day.draughts:
        now = (time >= begin * HOUR) & (time < end * HOUR)
        wind[now], cold[now] = strength, 2.0 * strength
    cold = follow(time, cold, 8.0 * MINUTE)
    room = 22.0 + course - course[0] + ripple - cold
    work = np.where(time > 0.0, np.minimum(spindle_current / SPINDLE_HOT, 1.0) ** 2, 0.0)
    return (
        room,
        follow(time, room, ENCLOSURE_DELAY) + WARMED * follow(time, work, WARM_DELAY),
        follow(time, wind, MINUTE),
    )


def log_of(day: Day) -> list[Column]:
    """The columns of the log, a row every 10 s."""
    fine = np.arange(0.0, DURATION + FINE / 2, FINE)
    m = motion(day, fine)
    time = np.arange(0.0, DURATION + SAMPLING / 2, SAMPLING)
    noise = 0.03 * np.random.default_rng(day.seed + 100).standard_normal((len(time), 3))
    current = np.sqrt(means(m.spindle_current**2))
    spindle = means(m.spindle_speed), current
    return columns_of(time, m.path, m.speed, m.current, noise, spindle, air(day, time, current))


def thinned(columns: list[Column]) -> list[Column]:
    """A row every ROWS: speeds and air are means over the interval that a row starts, currents rms, positions are
    those at its time; the last row repeats the one before."""
    per = round(ROWS / SAMPLING)

    def mean(values: np.ndarray) -> np.ndarray:
        over = values[: len(values) // per * per].reshape(-1, per).mean(axis=1)
        return np.append(over, over[-1])

    result = []
    for header, values, decimals in columns:
        if header.startswith("time") or "position" in header:
            rows = values[::per]
        elif header.endswith("[A]"):
            rows = np.sqrt(mean(values**2))
        else:
            rows = mean(values)
        result.append((header, rows, decimals))
    return result


def main() -> None:
    for day in DAYS:
        folder = Path(__file__).parent / day.name
        folder.mkdir(exist_ok=True)
        (folder / "loads.csv").write_text(table(thinned(log_of(day))), encoding="utf-8")
        print(folder / "loads.csv")


if __name__ == "__main__":
    main()

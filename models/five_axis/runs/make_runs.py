"""Write the load logs of the runs beside this file: `python make_runs.py`. Needs numpy only.

Experiment A of paper 000 (section 4): the X axis goes back and forth at constant speed for 4 h, then the machine rests
for 8 h. Experiment B: the same load for 7 h; after 4 h the door of the shop floor stands open for 2 h. A dynamic R-test
of 5 min, with moves of all axes, comes at the start, every hour under load and every two hours afterwards. The Y axis
carries the headstock, so its motor takes current all the time. The paper prints no numbers for speed, currents and air:
those here are plausible for a machine of this size, and synthetic.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

HOUR = 3600.0
DURATION = 12 * HOUR
SAMPLING = 10.0  # s; speeds and currents are means over the interval that a row starts
FINE = 0.05  # s, resolution of the motion itself

# Ten seconds see a motion of four seconds by its phase only. Stepping the phase by the golden ratio spreads the logged
# positions evenly over the stroke, as the dwell times of the axis are.
PERIOD = SAMPLING / (2.0 + (np.sqrt(5.0) - 1.0) / 2.0)  # 3.82 s
SPEED = 0.4  # m/s
LEAD = 0.02  # m per turn of the screws and their motors
SWEEP = SPEED * PERIOD / 2.0  # 0.764 m

# A dynamic R-test: the linear axes follow a ball on the turning table, at ten places one after the other.
R_TEST, PLACES, TRAVEL = 300.0, 10, 2.5  # s, number of places, s to the next one
RADIUS, SPREAD, FEED = 0.15, 0.35, 0.4  # m of the ball's circle, m over which its centres spread, m/s along the circle

# The shop's door: cold air reaches the machine within minutes, the shop is warm again half an hour after closing.
DOOR_FALL, DOOR_OPENS, DOOR_CLOSES = 6.0, 8.0 * 60.0, 30.0 * 60.0  # K, time constants in s
STILL_AIR, DRAUGHT, DRAUGHT_DELAY = 0.05, 0.8, 60.0  # m/s, m/s, s
# The air behind the enclosure's doors follows the shop's with a delay, and the working axes warm it.
ENCLOSURE_DELAY, ENCLOSURE_RISE, ENCLOSURE_WARMS = 20.0 * 60.0, 1.2, 40.0 * 60.0  # s, K under load, s


Column = tuple[str, np.ndarray, int]  # header, values (n,), decimals


@dataclass(frozen=True)
class Experiment:
    """What the paper tells about one of its experiments."""

    name: str
    loaded: float  # s of X motion
    r_tests: tuple[float, ...]  # h at which one ends, besides the first
    door: tuple[float, float] | None = None  # s at which the shop's door opens and closes

    @property
    def r_test_ends(self) -> tuple[float, ...]:
        """s"""
        return (R_TEST, *(h * HOUR for h in self.r_tests))


EXPERIMENTS = (
    Experiment("experiment_a", 4 * HOUR, (1, 2, 3, 4, 6, 8, 10, 12)),
    Experiment("experiment_b", 7 * HOUR, (1, 2, 3, 4, 5, 6, 7, 9, 11), (4 * HOUR, 6 * HOUR)),
)


def sweep(time: np.ndarray) -> np.ndarray:
    """Back and forth at constant speed, from the middle of the stroke. time (n,) s -> position (n,) m."""
    phase = np.mod(time / PERIOD + 0.25, 1.0)
    return SWEEP * (np.minimum(2.0 * phase, 2.0 - 2.0 * phase) - 0.5)


def r_test(time: np.ndarray, before: np.ndarray) -> np.ndarray:
    """Path (n, 5) x, y, z [m], b, c [deg] of one R-test; time (n,) s since its start, before (5,) where it begins.

    At every place the ball goes round about axis C (X and Y follow) or axis B (X and Z), in turn; then back to rest.
    """
    each = R_TEST / PLACES
    k = np.arange(PLACES)
    centres = SPREAD * (np.mod((k + 1.0)[:, None] * np.sqrt([2.0, 3.0, 5.0]), 1.0) - 0.5)
    place = np.minimum((time // each).astype(int), PLACES - 1)
    angle = FEED / RADIUS * np.clip(time - place * each - TRAVEL, 0.0, None)
    about_c = place % 2 == 0
    path = np.zeros((len(time), 5))
    path[:, :3] = centres[place]
    path[:, 0] += RADIUS * np.cos(angle)
    path[about_c, 1] += RADIUS * np.sin(angle[about_c])
    path[~about_c, 2] += RADIUS * np.sin(angle[~about_c])
    turned = np.rad2deg(np.mod(angle + np.pi, 2.0 * np.pi) - np.pi)
    path[about_c, 4], path[~about_c, 3] = turned[about_c], turned[~about_c]
    leaving = np.append(k * each, R_TEST - TRAVEL)
    for start in leaving:
        travelling = (time >= start) & (time < start + TRAVEL)
        here = before if start == 0.0 else path[time < start][-1]
        there = np.zeros(5) if start == leaving[-1] else path[time >= start + TRAVEL][0]
        path[travelling] = here + ((time[travelling] - start) / TRAVEL)[:, None] * (there - here)
    return path


def positions(experiment: Experiment, time: np.ndarray) -> np.ndarray:
    """Positions (n, 5) of x, y, z [m], b, c [deg] through the whole experiment."""
    path = np.zeros((len(time), 5))
    loaded = time < experiment.loaded
    path[loaded, 0] = sweep(time[loaded])
    for end in experiment.r_test_ends:
        now = (time >= end - R_TEST) & (time < end)
        path[now] = r_test(time[now] - (end - R_TEST), path[now][0])
    return path


def means(values: np.ndarray) -> np.ndarray:
    """Means over the sampling intervals; the last row repeats the one before."""
    per = round(SAMPLING / FINE)
    mean = values[: len(values) // per * per].reshape(-1, per).mean(axis=1)
    return np.append(mean, mean[-1])


def follow(time: np.ndarray, wanted: np.ndarray, delay: np.ndarray | float) -> np.ndarray:
    """What follows `wanted` (n,) with a delay of first order [s], starting there; delay: (n,) or one."""
    keep = np.exp(-SAMPLING / np.broadcast_to(delay, time.shape))
    value = wanted.astype(float).copy()
    for i in range(1, len(time)):
        value[i] = wanted[i] + (value[i - 1] - wanted[i]) * keep[i]
    return value


def air(experiment: Experiment, time: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Air of the shop and behind the enclosure [degC], and its speed at the machine [m/s], (n,) each."""
    room = 22.0 + 0.4 * np.sin(2.0 * np.pi * time / (16 * HOUR)) + 0.1 * np.sin(2.0 * np.pi * time / (1.3 * HOUR))
    is_open = np.zeros(len(time), dtype=bool)
    if experiment.door is not None:
        is_open = (time >= experiment.door[0]) & (time < experiment.door[1])
    room = room - DOOR_FALL * follow(time, is_open, np.where(is_open, DOOR_OPENS, DOOR_CLOSES))
    speed = STILL_AIR + (DRAUGHT - STILL_AIR) * follow(time, is_open, DRAUGHT_DELAY)
    warmed = ENCLOSURE_RISE * follow(time, (time > 0) & (time < experiment.loaded), ENCLOSURE_WARMS)
    return room, follow(time, room, ENCLOSURE_DELAY) + warmed, speed


def log_of(experiment: Experiment) -> list[Column]:
    """The columns of the log."""
    fine = np.arange(0.0, DURATION + FINE / 2, FINE)
    path = positions(experiment, fine)
    ends = experiment.r_test_ends
    testing = np.any([(fine >= end - R_TEST) & (fine < end) for end in ends], axis=0)
    orienting = np.any([(fine >= end - R_TEST) & (fine < end - R_TEST + SAMPLING) for end in ends], axis=0)
    speed = np.abs(np.diff(path[:, :3], axis=0, append=path[-1:, :3])) / FINE
    sweeping = (fine < experiment.loaded) & ~testing
    speed[sweeping, 0] = SPEED  # reversals are short
    speed = np.minimum(speed, SPEED)  # an R-test begins wherever the sweep stood
    rest, moving, share = np.array([0.8, 9.0, 0.6]), np.array([9.0, 1.5, 4.0]), speed / SPEED
    current = np.sqrt(rest**2 + share * moving**2)  # A; y: the weight of the headstock
    time = np.arange(0.0, DURATION + SAMPLING / 2, SAMPLING)
    rng = np.random.default_rng(0)
    noise = 0.03 * rng.standard_normal((len(time), 3))
    spindle = means(100.0 * orienting), means(2.0 * testing)
    return columns_of(time, path, speed, current, noise, spindle, air(experiment, time))


def columns_of(
    time: np.ndarray,
    path: np.ndarray,
    speed: np.ndarray,
    current: np.ndarray,
    noise: np.ndarray,
    spindle: tuple[np.ndarray, np.ndarray],
    shop: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> list[Column]:
    """The columns of a log: header, values at time (n,) s, decimals.

    path (m, 5), speed (m, 3) [m/s] and current (m, 3) [A] at the resolution FINE; noise (n, 3) [A]; spindle: its speed
    [1/min] and current [A], (n,) each; shop: its air and that behind the enclosure [degC] and wind [m/s], (n,) each.
    """
    room, enclosure, wind = shop
    logged = path[:: round(SAMPLING / FINE)]
    columns = [("time [s]", time, 0)]
    columns += [(f"{a}_position [mm]", 1e3 * logged[:, k], 1) for k, a in enumerate("xyz")]
    columns += [(f"{a}_position [deg]", logged[:, k], 1) for k, a in ((3, "b"), (4, "c"))]
    columns += [(f"{a}_speed [m/min]", 60.0 * means(speed[:, k]), 2) for k, a in enumerate("xyz")]
    columns += [(f"{a}_motor_speed [1/min]", 60.0 / LEAD * means(speed[:, k]), 0) for k, a in enumerate("xyz")]
    columns += [(f"{a}_current [A]", np.sqrt(means(current[:, k] ** 2)) + noise[:, k], 2) for k, a in enumerate("xyz")]
    return [
        *columns,
        ("spindle_speed [1/min]", spindle[0], 0),
        ("spindle_current [A]", spindle[1], 2),
        ("ambient [degC]", room, 2),
        ("enclosure [degC]", enclosure, 2),
        ("draught [m/s]", wind, 2),
    ]


def table(columns: list[Column]) -> str:
    """The text of loads.csv."""
    rows = np.column_stack([values for _, values, _ in columns]).tolist()
    lines = [",".join(header for header, _, _ in columns)]
    lines += [",".join(f"{round(v, c[2]) + 0.0:.10g}" for v, c in zip(row, columns, strict=True)) for row in rows]
    return "\n".join(lines) + "\n"


def main() -> None:
    for experiment in EXPERIMENTS:
        target = Path(__file__).parent / experiment.name / "loads.csv"
        target.write_text(table(log_of(experiment)), encoding="utf-8")
        print(target)


if __name__ == "__main__":
    main()

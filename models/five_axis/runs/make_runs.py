"""Write the load logs of the runs beside this file: `python make_runs.py`. Needs numpy only.

Experiment A of paper 000 (section 4): the X axis goes back and forth at constant speed for 4 h, then the machine rests
for 8 h. A dynamic R-test of 5 min, with moves of all axes, comes at the start, every hour under load and every two
hours afterwards. The Y axis carries the headstock, so its motor takes current all the time. The paper prints no
numbers for speed and currents: those here are plausible for a machine of this size, and synthetic.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

HOUR = 3600.0
DURATION, LOADED = 12 * HOUR, 4 * HOUR
SAMPLING = 10.0  # s; speeds and currents are means over the interval that a row starts
FINE = 0.05  # s, resolution of the motion itself

# Ten seconds see a motion of four seconds by its phase only. Stepping the phase by the golden ratio spreads the logged
# positions evenly over the stroke, as the dwell times of the axis are.
PERIOD = SAMPLING / (2.0 + (np.sqrt(5.0) - 1.0) / 2.0)  # 3.82 s
SPEED = 0.4  # m/s
SWEEP = SPEED * PERIOD / 2.0  # 0.764 m

R_TEST, POSES, FEED = 300.0, 60, 0.4  # s, number of ball positions, m/s
R_TEST_ENDS = (R_TEST, *(h * HOUR for h in (1, 2, 3, 4, 6, 8, 10, 12)))


def sweep(time: np.ndarray) -> np.ndarray:
    """Back and forth at constant speed, from the middle of the stroke. time (n,) s -> position (n,) m."""
    phase = np.mod(time / PERIOD + 0.25, 1.0)
    return SWEEP * (np.minimum(2.0 * phase, 2.0 - 2.0 * phase) - 0.5)


def r_test_poses() -> np.ndarray:
    """Poses (POSES + 1, 5) x, y, z [m], b, c [deg], spread by Weyl sequences; the last is the rest position."""
    k = np.arange(1, POSES + 1)[:, None]
    spread = np.mod(k * np.sqrt([2.0, 3.0, 5.0]), 1.0) - 0.5
    turn = np.linspace(0.0, 2.0 * np.pi, POSES)[:, None]
    angles = np.hstack([90.0 * np.sin(turn), 180.0 * np.sin(2.0 * turn)])
    return np.vstack([np.hstack([0.7 * spread, angles]), np.zeros(5)])


def positions(time: np.ndarray) -> np.ndarray:
    """Positions (n, 5) of x, y, z [m], b, c [deg] through the whole experiment."""
    path = np.zeros((len(time), 5))
    loaded = time < LOADED
    path[loaded, 0] = sweep(time[loaded])
    poses = r_test_poses()
    for end in R_TEST_ENDS:
        begin = end - R_TEST
        now = (time >= begin) & (time < end)
        here = path[now][0]
        knots, places = [begin], [here]
        for k, pose in enumerate(poses):
            leave = begin + k * R_TEST / len(poses)
            duration = max(np.abs(pose[:3] - here[:3]).max() / FEED, 2.0)  # the rotary axes need their time, too
            knots += [leave, leave + duration]
            places += [here, pose]
            here = pose
        path[now] = np.column_stack([np.interp(time[now], knots, c) for c in np.array(places).T])
    return path


def means(values: np.ndarray) -> np.ndarray:
    """Means over the sampling intervals; the last row repeats the one before."""
    per = round(SAMPLING / FINE)
    mean = values[: len(values) // per * per].reshape(-1, per).mean(axis=1)
    return np.append(mean, mean[-1])


def experiment_a() -> tuple[list[str], np.ndarray, list[int]]:
    """Headers, rows and decimals of the log."""
    fine = np.arange(0.0, DURATION + FINE / 2, FINE)
    path = positions(fine)
    r_test = np.any([(fine >= end - R_TEST) & (fine < end) for end in R_TEST_ENDS], axis=0)
    orienting = np.any([(fine >= end - R_TEST) & (fine < end - R_TEST + SAMPLING) for end in R_TEST_ENDS], axis=0)
    speed = np.abs(np.diff(path[:, :3], axis=0, append=path[-1:, :3])) / FINE
    sweeping = (fine < LOADED) & ~r_test
    speed[sweeping, 0] = SPEED  # reversals are short
    speed = np.minimum(speed, SPEED)  # an R-test begins wherever the sweep stood
    rest, moving, share = np.array([0.8, 9.0, 0.6]), np.array([9.0, 1.5, 4.0]), speed / SPEED
    current = np.sqrt(rest**2 + share * moving**2)  # A; y: the weight of the headstock
    time = np.arange(0.0, DURATION + SAMPLING / 2, SAMPLING)
    rng = np.random.default_rng(0)
    noise = 0.03 * rng.standard_normal((len(time), 3))
    ambient = 22.0 + 0.4 * np.sin(2.0 * np.pi * time / (16 * HOUR)) + 0.1 * np.sin(2.0 * np.pi * time / (1.3 * HOUR))
    logged = path[:: round(SAMPLING / FINE)]
    columns = [("time [s]", time, 0)]
    columns += [(f"{a}_position [mm]", 1e3 * logged[:, k], 1) for k, a in enumerate("xyz")]
    columns += [(f"{a}_position [deg]", logged[:, k], 1) for k, a in ((3, "b"), (4, "c"))]
    columns += [(f"{a}_speed [m/min]", 60.0 * means(speed[:, k]), 2) for k, a in enumerate("xyz")]
    columns += [(f"{a}_current [A]", np.sqrt(means(current[:, k] ** 2)) + noise[:, k], 2) for k, a in enumerate("xyz")]
    columns += [
        ("spindle_speed [1/min]", means(100.0 * orienting), 0),
        ("spindle_current [A]", means(2.0 * r_test), 2),
        ("ambient [degC]", ambient, 2),
    ]
    return [c[0] for c in columns], np.column_stack([c[1] for c in columns]), [c[2] for c in columns]


def main() -> None:
    headers, rows, decimals = experiment_a()
    lines = [",".join(headers)]
    lines += [
        ",".join(f"{round(v, d) + 0.0:.10g}" for v, d in zip(row, decimals, strict=True)) for row in rows.tolist()
    ]
    target = Path(__file__).parent / "experiment_a" / "loads.csv"
    target.write_text("\n".join(lines) + "\n", encoding="utf-8")
    print(f"{target}: {len(rows)} rows")


if __name__ == "__main__":
    main()

"""Write the load log of the run beside this file: `python make_runs.py`. Needs numpy only.

Eight hours of mixed load after the test of paper 001 (section 16.3.6: current, speed, position and ambient temperature
of one ball screw). The paper prints no values: speeds, strokes and currents are plausible for a servo axis of this
size, and synthetic. Phases of an hour or less alternate between long and short strokes, at both ends and in the middle
of the screw, positioning with pauses, and rest.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

HOUR, MINUTE = 3600.0, 60.0
DURATION = 8 * HOUR
SAMPLING = 5.0  # s; speeds and currents are means over the interval that a row starts
FINE = 0.05  # s, resolution of the motion itself
LEAD = 0.020  # m

# A sample every five seconds sees a faster stroke by its phase only. Strokes per sampling interval that end in the
# golden ratio spread the logged positions evenly over the stroke, as the dwell times of the axis are.
GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0

# hours, middle and length of the stroke [m], whole strokes per sampling interval, share of the time moving, current [A]
PHASES = (
    (0.75, 0.00, 0.60, 1, 1.0, 5.0),
    (0.50, -0.20, 0.20, 2, 0.8, 6.0),
    (0.25, -0.20, 0.00, 0, 0.0, 0.0),
    (1.00, 0.22, 0.22, 3, 0.9, 5.5),
    (0.50, 0.00, 0.66, 1, 0.6, 7.0),
    (0.75, 0.30, 0.00, 0, 0.0, 0.0),
    (1.00, -0.10, 0.40, 0, 1.0, 4.0),
    (0.75, -0.28, 0.10, 5, 0.9, 6.5),
    (0.50, 0.10, 0.44, 1, 0.7, 6.0),
    (0.50, 0.00, 0.60, 1, 1.0, 5.0),
    (1.50, -0.30, 0.00, 0, 0.0, 0.0),
)
REST = 1.0  # A, standing still
CYCLE = 90.0  # s of motion and pause together


def phase_of(time: np.ndarray) -> np.ndarray:
    """Index of the phase that each time (n,) [s] belongs to."""
    ends = HOUR * np.cumsum([p[0] for p in PHASES])
    return np.minimum(np.searchsorted(ends, time, side="right"), len(PHASES) - 1)


def motion(time: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position [m], speed [m/s] and current [A] (n,) at times (n,) [s]."""
    phase = phase_of(time)
    _, middle, stroke, whole, share, current = np.array(PHASES).T[:, phase]
    speed = 2.0 * stroke * (whole + GOLDEN) / SAMPLING  # a stroke is one way and back
    moving = (np.mod(time, CYCLE) < share * CYCLE) & (speed > 0)
    travelled = np.cumsum(np.where(moving, speed, 0.0)) * FINE  # m, along the path back and forth
    turn = np.mod(travelled / np.maximum(2.0 * stroke, 1e-9) + 0.25, 1.0)
    place = middle + stroke * (np.minimum(2.0 * turn, 2.0 - 2.0 * turn) - 0.5)
    step = np.clip(place - np.concatenate([[0.0], place[:-1]]), -0.5 * FINE, 0.5 * FINE)
    # between phases the axis travels to the new place at half a metre per second
    jumps = np.flatnonzero(np.abs(np.diff(place)) > 0.6 * FINE) + 1
    for jump in jumps:
        here, there = place[jump - 1], place[jump]
        n = int(np.ceil(abs(there - here) / (0.5 * FINE)))
        place[jump : jump + n] = here + (there - here) * (np.arange(n) + 1) / n
        step[jump : jump + n] = (there - here) / n
    actual = np.where(moving, speed, np.abs(step) / FINE)
    return place, actual, np.where(actual > 0.0, np.where(moving, current, 4.0), REST)


def means(values: np.ndarray) -> np.ndarray:
    """Means over the sampling intervals; the last row repeats the one before."""
    per = round(SAMPLING / FINE)
    mean = values[: len(values) // per * per].reshape(-1, per).mean(axis=1)
    return np.append(mean, mean[-1])


def mixed_load() -> tuple[list[str], np.ndarray, list[int]]:
    """Headers, rows and decimals of the log."""
    fine = np.arange(0.0, DURATION + FINE / 2, FINE)
    place, speed, current = motion(fine)
    time = np.arange(0.0, DURATION + SAMPLING / 2, SAMPLING)
    noise = 0.02 * np.random.default_rng(0).standard_normal(len(time))
    ambient = 20.0 + 1.5 * np.sin(2.0 * np.pi * time / (14 * HOUR)) + 0.2 * np.sin(2.0 * np.pi * time / (0.9 * HOUR))
    speeds = means(speed)
    columns = [
        ("time [s]", time, 0),
        ("x_position [mm]", 1e3 * place[:: round(SAMPLING / FINE)], 1),
        ("x_speed [m/min]", 60.0 * speeds, 3),
        ("screw_speed [1/min]", 60.0 * speeds / LEAD, 1),
        ("x_current [A]", np.maximum(np.sqrt(means(current**2)) + noise, 0.0), 2),
        ("ambient [degC]", ambient, 2),
    ]
    return [c[0] for c in columns], np.column_stack([c[1] for c in columns]), [c[2] for c in columns]


def main() -> None:
    headers, rows, decimals = mixed_load()
    lines = [",".join(headers)]
    lines += [
        ",".join(f"{round(v, d) + 0.0:.10g}" for v, d in zip(row, decimals, strict=True)) for row in rows.tolist()
    ]
    target = Path(__file__).parent / "mixed_load" / "loads.csv"
    target.write_text("\n".join(lines) + "\n", encoding="utf-8")
    print(f"{target}: {len(rows)} rows")


if __name__ == "__main__":
    main()

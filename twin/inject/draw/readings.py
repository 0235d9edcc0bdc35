"""Hidden faults of what is read: sensors, load signals, clocks, and the displacement of the tool.

Functions take the experiment, a generator and the factor of the nominal size. Noise comes on top of a faulty sensor's
reading, except where the reading stands still.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from twin.inject.draw.histories import one_of
from twin.inject.draw.parts import Part, with_column, with_sensor, with_tcp
from twin.inject.experiment import HOUR, RUNS, START, STEP, STEPS, Experiment
from twin.inject.five_axis import SCALES
from twin.inject.hidden import Hidden
from twin.inject.truth.behaviour import Behaviour, Clean
from twin.logs.run import Run
from twin.machine.effects.effect import Window
from twin.physics.play import play

COMPONENTS = ("dx", "dy", "dz")
DAY = 86400.0


def sensor(experiment: Experiment, rng: np.random.Generator, factor: float) -> Part:
    """Offset 1 K, drift 1.2 K a day (from every start), lag 40 min, half detached, stuck, or two swapped."""
    kind = one_of(rng, ("offset", "drift", "lag", "detached", "stuck", "swapped"))
    return fault(experiment, rng, kind, factor)


def fault(experiment: Experiment, rng: np.random.Generator, kind: str, factor: float) -> Part:
    """A sensor with a fault of one kind, of either sign where there are two."""
    sensors = [f"sensors.{n}" for n, s in experiment.machine.sensors.items() if s.part is not None]
    place = one_of(rng, sensors)
    name, sign = place.partition(".")[2], (-1.0, 1.0)[rng.integers(2)]
    if kind == "swapped":
        return _swapped(name, one_of(rng, [s for s in sensors if s != place]).partition(".")[2])
    if kind == "stuck":
        return _stuck(rng, name)
    size, unit = {
        "offset": (sign * factor, "K"), "drift": (sign * 1.2 * factor / DAY, "K/s"), "lag": (2400.0 * factor, "s"),
        "detached": (min(0.5 * factor, 1.0), "1"),
    }[kind]  # fmt: skip

    def readings(_: int, run: Run, clean: Clean) -> Run:
        assert run.temperatures is not None
        T = np.asarray(run.temperatures.columns[name])
        if kind == "offset":
            return with_sensor(run, name, T + size)
        if kind == "drift":
            return with_sensor(run, name, T + size * clean.time)
        if kind == "detached":
            return with_sensor(run, name, (1.0 - size) * T + size * np.asarray(run.temperatures.columns["air_column"]))
        late, keep = T.copy(), math.exp(-STEP / size)
        for k in range(1, len(T)):
            late[k] = keep * late[k - 1] + (1.0 - keep) * T[k]
        return with_sensor(run, name, late)

    return Part((Hidden("sensor", place, kind, size, unit),), readings=readings)


def _swapped(name: str, other: str) -> Part:
    def logs(_: int, run: Run) -> Run:
        assert run.temperatures is not None
        columns = run.temperatures.columns
        return with_sensor(with_sensor(run, name, columns[other]), other, columns[name])

    hidden = Hidden("sensor", f"sensors.{name}", "swapped", 1.0, "1", settings={"other": f"sensors.{other}"})
    return Part((hidden,), logs=logs)


def _stuck(rng: np.random.Generator, name: str) -> Part:
    r, start = int(rng.integers(2)), STEP * round(rng.uniform(2.0, 6.0) * HOUR / STEP)
    windows = tuple(Window(RUNS[k], start if k == r else 0.0, STEP * STEPS) for k in range(r, 3))

    def logs(k: int, run: Run) -> Run:
        assert run.temperatures is not None
        T = np.array(run.temperatures.columns[name])
        if k >= r:
            first = round(start / STEP) if k == r else 0
            T[first:] = T[first]
        return with_sensor(run, name, T)

    hidden = Hidden("sensor", f"sensors.{name}", "stuck", STEP * STEPS - start, "s", windows)
    return Part((hidden,), logs=logs)


def signal(experiment: Experiment, rng: np.random.Generator, factor: float) -> Part:
    """A current logged sqrt(2) times or half as large, a speed twice as large, or a run's measurements 6 min late.

    The log is that of every trial, and the machine had other loads: what a diagnosis makes of loads alone serves all.
    """
    if rng.random() < 0.25:
        return _clock(rng, factor)
    name = one_of(
        rng, ("x_current", "y_current", "z_current", "spindle_current", "spindle_speed", "x_speed", "z_speed")
    )
    logged = 2.0 if name.endswith("speed") else (math.sqrt(2.0), 0.5)[rng.integers(2)]

    def really(_: int, log: Run) -> Run:
        return with_column(log, name, np.asarray(log.loads.columns[name]) / logged)

    # the size is what the logged values want, as a declaration corrected has it
    hidden = Hidden("signal", f"signals.{name}", "factor", 1.0 / logged, "1", signal=name)
    return Part((hidden,), Behaviour(really=really, laws=True))


def _clock(rng: np.random.Generator, factor: float) -> Part:
    r, late = int(rng.integers(2)), 360.0 * factor

    def readings(k: int, run: Run, _: Clean) -> Run:
        if k != r:
            return run
        assert run.temperatures is not None
        time = run.temperatures.time
        shifted = {n: np.interp(time - late, time, v) for n, v in run.temperatures.columns.items()}
        return replace(run, temperatures=replace(run.temperatures, columns=shifted))

    hidden = Hidden("signal", f"runs.{RUNS[r]}", "clock", late, "s")
    return Part((hidden,), Behaviour(late={r: late}), readings=readings)


def _displaced(hidden: Hidden, more: Callable[[int, Run, Clean], np.ndarray], heats: tuple[str, ...] = ()) -> Part:
    def readings(r: int, run: Run, clean: Clean) -> Run:
        return with_tcp(run, more(r, run, clean))

    return Part((hidden,), Behaviour(heats=heats), readings=readings)


def _along(rows: np.ndarray, component: int) -> np.ndarray:
    """(m, 3) with rows (m,) in one component."""
    result = np.zeros((len(rows), 3))
    result[:, component] = rows
    return result


def scale_expansion(experiment: Experiment, rng: np.random.Generator, factor: float) -> Part:
    """An encoder scale grows by 8 um/(m K) and reads too little; fixed at position zero, as warm as a face."""
    axis = one_of(rng, SCALES)
    place, growth = one_of(rng, SCALES[axis]), 8e-6 * factor
    c = "xyz".index(axis)

    def more(_: int, __: Run, clean: Clean) -> np.ndarray:
        step = np.searchsorted(clean.time, clean.tcp_time)
        return _along(-growth * (clean.shown[place][step] - START) * clean.positions[:, c], c)

    hidden = Hidden(
        "scale_expansion", f"axes.{axis}", "always", growth, "1/K", settings={"surface": place, "fixed_at": 0.0}
    )
    return _displaced(hidden, more, (place,))


def slip(experiment: Experiment, rng: np.random.Generator, factor: float) -> Part:
    """6 um of play on a component: two anchors that stick side by side, one of a wider play than the other."""
    name, width = one_of(rng, COMPONENTS), 6e-6 * factor
    c = COMPONENTS.index(name)

    def more(_: int, __: Run, clean: Clean) -> np.ndarray:
        moved = clean.moved[:, c]
        lag = np.mean([play(moved, share * width) - moved for share in (0.6, 1.4)], axis=0)
        return _along(lag[np.searchsorted(clean.time, clean.tcp_time)], c)

    return _displaced(Hidden("slip", f"tcp.{name}", "always", width, "m"), more)


def measurement(experiment: Experiment, rng: np.random.Generator, factor: float) -> Part:
    """The device drifts by 8 um in 12 h, from every start, or stands askew by 20 um/m."""
    name, sign = one_of(rng, COMPONENTS), (-1.0, 1.0)[rng.integers(2)]
    c = COMPONENTS.index(name)
    if rng.random() < 0.5:
        rate = sign * 8e-6 * factor / (12.0 * HOUR)
        hidden = Hidden("measurement", f"tcp.{name}", "drift", rate, "m/s")
        return _displaced(hidden, lambda _r, _run, clean: _along(rate * clean.tcp_time, c))
    axis = one_of(rng, "xyz")
    slope = sign * 20e-6 * factor
    hidden = Hidden("measurement", f"tcp.{name}", "frame", slope, "1", settings={"axis": axis})
    return _displaced(hidden, lambda _r, _run, clean: _along(slope * clean.positions[:, "xyz".index(axis)], c))


def not_thermal(experiment: Experiment, rng: np.random.Generator, factor: float) -> Part:
    """A step of 10 um at some time and ever after, or 0.6 um per ampere of an axis."""
    name, sign = one_of(rng, COMPONENTS), (-1.0, 1.0)[rng.integers(2)]
    c = COMPONENTS.index(name)
    if rng.random() < 0.5:
        r, start, size = int(rng.integers(2)), STEP * round(rng.uniform(2.0, 10.0) * HOUR / STEP), sign * 1e-5 * factor
        windows = tuple(Window(RUNS[k], start if k == r else 0.0, STEP * STEPS) for k in range(r, 3))

        def step(k: int, _: Run, clean: Clean) -> np.ndarray:
            after = np.full(len(clean.tcp_time), k > r) | ((clean.tcp_time >= start) & (k == r))
            return _along(size * after.astype(float), c)

        return _displaced(Hidden("not_thermal", f"tcp.{name}", "step", size, "m", windows), step)
    current, slope = one_of(rng, ("x_current", "y_current", "z_current")), sign * 0.6e-6 * factor

    def load(_: int, run: Run, clean: Clean) -> np.ndarray:
        row = np.clip(np.searchsorted(run.loads.time, clean.tcp_time, side="right") - 1, 0, None)
        return _along(slope * np.abs(np.asarray(run.loads.columns[current])[row]), c)

    return _displaced(Hidden("not_thermal", f"tcp.{name}", "load", slope, "m/A", signal=current), load)

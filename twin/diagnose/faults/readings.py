"""Elementary causes that act on what is read, not on the machine: columns (m,) over the measured numbers.

gain      parameter    one prior standard deviation of a declared parameter in ln or its unit
offset    sensor       1 K;   shift  the same, by blocks;   drift  1 K/day;   lag  1 s;   detached  all of it
swapped   a<>b         all of it
elsewhere a>place      all of it
clock     run          1 s later than stated, to first order; exactly by `late`
scale     axis<part    1 m/m/K of an encoder scale as warm as a part, from the middle of the stroke
expansion part         100 % more
slip      dx           1 m of play, seen at WIDTH; at other widths by `play`
probed    dx           the same, of the measuring device
step      dx           1 m from a measurement on
load      dx:signal    1 m per unit of a signal
probe     dx           1 m/s of drift;   frame dx:axis  1 m/m;   heated dx  1 m from first to last row of a set

In runs with `tcp_reference = "first"` all TCP rows lose what a cause does to the first one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from twin.diagnose.faults.elements import Key
from twin.diagnose.faults.sensor_readings import Add, numbers, rate_of, sensor_columns
from twin.diagnose.model.bank import Nominal
from twin.diagnose.model.study import COMPONENTS, Planned, Study
from twin.physics.play import play as follower
from twin.rom.apply import member_mean
from twin.rom.parameter import OF_LAWS

WIDTH, NARROW = 4e-6, 0.5e-6  # m
SET_GAP = 600.0  # s: rows closer than that belong to one measurement


def readings_of(
    study: Study, nominal: Sequence[Nominal], outputs: Sequence[np.ndarray], J: Sequence[np.ndarray], swaps: bool = True
) -> tuple[np.ndarray, dict[Key, int]]:
    """(m, n) columns of all fitted runs, and where each is; outputs, J: nominal ones per fitted run.

    swaps: with a column for every pair of sensors, whose number grows with the square of theirs.
    """
    columns: list[np.ndarray] = []
    index: dict[Key, int] = {}

    def add(key: Key, parts: Sequence[np.ndarray]) -> None:
        index[key] = len(columns)
        columns.append(np.concatenate(parts).astype(np.float32))

    plans = [study.runs[k] for k in study.fitted]
    scale = study.scale
    for i, p in enumerate(study.probed.parameters):
        if p.kind not in OF_LAWS:
            add(("gain", p.path, "always"), [jac[:, i] / scale[i] for jac in J])
    sensor_columns(study, plans, nominal, outputs, add, swaps)
    if any(len(plan.measured.tcp) for plan in plans):
        _tcp(study, plans, nominal, add)
    for r, plan in enumerate(plans):
        parts = [numbers(p) for p in plans]
        T, _ = plan.split(outputs[r])
        z, step = nominal[r].states, np.asarray(plan.rows.step)
        w_rate = np.einsum("kcr,kr->kc", np.asarray(plan.rows.row), (z[step + 1] - z[step]) * nominal[r].rate)
        parts[r] = -numbers(plan, rate_of(T, plan.measured.bin_time), w_rate)
        add(("clock", plan.run.name, "always"), parts)
    return np.stack(columns, axis=1), index


def _only(c: int, values: np.ndarray) -> np.ndarray:
    """(k, 3) of the TCP where only a component moves, by values (k,)."""
    w = np.zeros((len(values), 3))
    w[:, c] = values
    return w


def _tcp(study: Study, plans: Sequence[Planned], nominal: Sequence[Nominal], add: Add) -> None:
    (body,) = study.probed.base.bodies
    probed = study.probed
    times = [plan.measured.tcp_time - plan.run.drive.time[0] for plan in plans]

    def column(of: Sequence[np.ndarray]) -> list[np.ndarray]:
        return [numbers(plan, w=w) for plan, w in zip(plans, of, strict=True)]

    def component(c: int, values: Sequence[np.ndarray]) -> list[np.ndarray]:
        return column([_only(c, v) for v in values])

    z = [_state(own.states, np.asarray(p.rows.step) + np.asarray(p.rows.share))
         for p, own in zip(plans, nominal, strict=True)]  # fmt: skip
    positions = [plan.measured.position for plan in plans]
    axes = [(i, a) for i, a in enumerate(probed.base.load_model.axes)
            if any(np.ptp(p[:, i]) > 1e-6 for p in positions if len(p))]  # fmt: skip
    for m, member in enumerate(body.members):
        row = member_mean(body, m)
        warm = [x @ row for x in z]
        for i, axis in axes:
            along = np.asarray(axis.direction)
            made = [-(t * p[:, i])[:, None] * along for t, p in zip(warm, positions, strict=True)]
            add(("scale", f"axes.{axis.name}<{member}", "always"), column(made))
        if {f"tcp.expansion.{member}.{c}" for c in "xyz"} <= {p.path for p in probed.parameters}:
            continue  # of a lumped machine: each of these numbers is calibrated by itself
        if body.G_members is not None and np.any(body.G_members[m]):
            G = body.G_members[m]
            rows = [np.tensordot(plan.measured.pose, G, 1) for plan in plans]
            grown = [np.einsum("kcr,kr->kc", g, x) for g, x in zip(rows, z, strict=True)]
            add(("expansion", member, "always"), column(grown))
    for c, name in enumerate(COMPONENTS):
        for kind, lags in LAGS.items():
            of = [lags(plan, own.states, c) for plan, own in zip(plans, nominal, strict=True)]
            add((kind, name, "always"), component(c, of))
        for r, t in enumerate(times):
            for start in _sets(t)[1:]:
                values = [np.zeros(len(x)) if k < r else np.ones(len(x)) for k, x in enumerate(times)]
                values[r] = (t >= start - 1e-6).astype(float)
                add(("step", name, f"{r}:{start:.0f}"), component(c, values))
        add(("probe", name, "always"), component(c, times))
        add(("heated", name, "always"), component(c, [_within_set(t) for t in times]))
        for i, axis in axes:
            add(("frame", f"{name}:{axis.name}", "always"), component(c, [p[:, i] for p in positions]))
        for signal in probed.base.load_model.signals:
            if signal.unit not in ("A", "W", "N", "1"):
                continue
            values = [_at(plan, signal.name, t) for plan, t in zip(plans, times, strict=True)]
            if max((float(np.ptp(v)) for v in values if len(v)), default=0.0) > 0.0:
                add(("load", f"{name}:{signal.name}", "always"), component(c, values))


def play(study: Study, states: Callable[[int], np.ndarray], kind: str, name: str, width: float) -> np.ndarray:
    """(m,) what a play of `width` [m] in a component of the TCP makes it read in the fitted runs, per metre of play.

    states: (n + 1, r) of run k; kind: of LAGS.
    """
    c, wide, runs = COMPONENTS.index(name), max(width, NARROW), [(k, study.runs[k]) for k in study.fitted]
    return np.concatenate([numbers(plan, w=_only(c, LAGS[kind](plan, states(k), c, wide))) for k, plan in runs])


def late(study: Study, states: Mapping[int, np.ndarray], seconds: float) -> np.ndarray:
    """(m,) what the fitted runs read more where a clock is late by `seconds` [s], per second.

    states: (n + 1, r) of the runs, by their number, that this clock has stamped.
    """
    (body,) = study.probed.base.bodies
    by = seconds if abs(seconds) > 1.0 else 1.0
    parts = []
    for k in study.fitted:
        plan = study.runs[k]
        T, w = None, None
        if k in states:
            z, steps = states[k], by / plan.run.step
            read = z @ body.C.T[:, plan.measured.column]
            T = plan.measured.mean_of @ (_state(read, np.arange(len(z)) - steps) - read)
            at = np.asarray(plan.rows.step) + np.asarray(plan.rows.share)
            w = np.einsum("kcr,kr->kc", np.asarray(plan.rows.row), _state(z, at - steps) - _state(z, at))
        parts.append(numbers(plan, T, w) / by)
    return np.concatenate(parts)


def _state(states: np.ndarray, at: np.ndarray) -> np.ndarray:
    """(k, r) states (n + 1, r) between steps; the first one before the start."""
    at = np.clip(at, 0.0, len(states) - 1.0)
    step = np.minimum(at.astype(int), len(states) - 2)
    share = (at - step)[:, None]
    return np.asarray(states[step] + share * (states[step + 1] - states[step]))


def _at(plan: Planned, signal: str, time: np.ndarray) -> np.ndarray:
    values = plan.run.signals.get(signal)
    if values is None:
        return np.zeros(len(time))
    step = np.clip((time / plan.run.step).astype(int), 0, len(values) - 1)
    return np.asarray(values[step])


def _sets(time: np.ndarray) -> np.ndarray:
    """First times of the measurements: rows that follow each other closely are one."""
    if not len(time):
        return np.zeros(0)
    return np.asarray(time[np.concatenate([[True], np.diff(time) > SET_GAP])])


def _within_set(time: np.ndarray) -> np.ndarray:
    """0 for the first row of a measurement, 1 for its last."""
    number = np.searchsorted(_sets(time), time, side="right") - 1
    _, first, count = np.unique(number, return_index=True, return_counts=True)
    return np.asarray((np.arange(len(time)) - first[number]) / np.maximum(count[number] - 1, 1))


def _play(plan: Planned, states: np.ndarray, c: int, width: float = WIDTH) -> np.ndarray:
    """Where a play lags the thermal displacement of a component in the machine, per width: -1/2 .. 1/2."""
    if not len(plan.measured.tcp):
        return np.zeros(0)
    w = states @ np.asarray(plan.rows.row)[:, c].mean(axis=0)
    return ((follower(w, width) - w) / width)[np.asarray(plan.rows.step)]


def _probed(plan: Planned, states: np.ndarray, c: int, width: float = WIDTH) -> np.ndarray:
    """The same of a play in the measuring device, which is moved only by the mean of every measurement."""
    time = plan.measured.tcp_time
    if not len(time):
        return np.zeros(0)
    rows = np.einsum("kr,kr->k", np.asarray(plan.rows.row)[:, c], states[np.asarray(plan.rows.step)])
    number = np.searchsorted(_sets(time), time, side="right") - 1
    w = np.bincount(number, rows) / np.bincount(number)
    return ((follower(w, width) - w) / width)[number]


LAGS = {"slip": _play, "probed": _probed}

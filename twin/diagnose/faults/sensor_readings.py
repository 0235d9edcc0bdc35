"""What sensors read otherwise: columns (m,) of their faults over the measured numbers, as `readings` lists them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from scipy.signal import lfilter

from twin.diagnose.faults.elements import Key, blocks_of
from twin.diagnose.model.bank import Nominal
from twin.diagnose.model.study import Planned, Study
from twin.rom.apply import member_field

Add = Callable[[Key, Sequence[np.ndarray]], None]  # a column in parts, one per fitted run

DAY = 86400.0  # s


def numbers(plan: Planned, T: np.ndarray | None = None, w: np.ndarray | None = None) -> np.ndarray:
    """(size,) all that a run measures, of sensors T (b, s) and TCP rows w (k, 3), zero by default.

    The TCP is counted from its first row where the run says so, as `Study.read` does.
    """
    T = np.zeros(plan.shapes[0]) if T is None else T
    w = np.zeros(plan.shapes[1]) if w is None else w
    return np.concatenate([T.ravel(), (w - w[0] if plan.measured.from_first and len(w) else w).ravel()])


def rate_of(T: np.ndarray, time: np.ndarray) -> np.ndarray:
    """dT/dt [K/s] of bin means (b, ...)."""
    return np.asarray(np.gradient(T, time, axis=0)) if len(T) > 1 else np.zeros_like(T)


def sensor_columns(
    study: Study, plans: Sequence[Planned], nominal: Sequence[Nominal], outputs: Sequence[np.ndarray], add: Add,
    swaps: bool,
) -> None:  # fmt: skip
    """Add those of every sensor of the fitted runs; swaps: those of pairs, too."""
    names = tuple(dict.fromkeys(s for plan in plans for s in plan.measured.sensors))
    surround = study.probed.base.load_model.surroundings

    def column(of: Sequence[tuple[str, Sequence[np.ndarray]]]) -> list[np.ndarray]:
        parts = []
        for r, plan in enumerate(plans):
            T = np.zeros(plan.shapes[0])
            for name, values in of:
                if name in plan.measured.sensors:
                    T[:, plan.measured.sensors.index(name)] = values[r]
            parts.append(numbers(plan, T))
        return parts

    read = {
        name: [
            plan.split(y)[0][:, plan.measured.sensors.index(name)] if name in plan.measured.sensors
            else np.zeros(plan.shapes[0][0])
            for plan, y in zip(plans, outputs, strict=True)
        ]
        for name in names
    }  # fmt: skip
    time = [plan.measured.bin_time - plan.run.drive.time[0] for plan in plans]
    air = []
    for plan in plans:
        weight = plan.measured.mean_of[:, 1:]
        air.append(weight @ plan.run.drive.environment[:, surround] / np.maximum(weight.sum(axis=1), 1e-9))
    for name in names:
        add(("offset", name, "always"), column([(name, [np.ones(len(t)) for t in time])]))
        add(("drift", name, "always"), column([(name, [t / DAY for t in time])]))
        for history, values in _drifts(name, plans, time):
            add(("drift", name, history), column([(name, values)]))
        add(("lag", name, "always"), column([(name, [-rate_of(T, t) for T, t in zip(read[name], time, strict=True)])]))
        add(("detached", name, "always"), column([(name, [a - T for a, T in zip(air, read[name], strict=True)])]))
        for b, (i, begin, end) in enumerate(blocks_of(study)):
            edges = plans[i].run.drive.time[[begin, end]] - plans[i].run.drive.time[0]
            inside = (time[i] >= edges[0]) & (time[i] < edges[1])
            of_block = [inside.astype(float) if r == i else np.zeros(len(t)) for r, t in enumerate(time)]
            add(("shift", name, f"{b}"), column([(name, of_block)]))
    for a, first in enumerate(names if swaps else ()):
        for second in names[a + 1 :]:
            change = [y - x for x, y in zip(read[first], read[second], strict=True)]
            add(("swapped", f"{first}<>{second}", "always"), column([(first, change), (second, [-c for c in change])]))
    _elsewhere(study, plans, nominal, add)


def _elsewhere(study: Study, plans: Sequence[Planned], nominal: Sequence[Nominal], add: Add) -> None:
    """Every sensor as warm as every place of another part or node than its own."""
    (body,), base = study.probed.base.bodies, study.probed.base
    warm = np.stack([member_field(body, m) for m in range(len(body.members))], axis=1)
    own = dict(zip(base.sensors, np.abs(body.C @ warm).argmax(axis=1).tolist(), strict=True))
    # not of sensors that are planned: their names hold a colon, as none of a description does
    for name in dict.fromkeys(s for plan in plans for s in plan.measured.sensors if s in own and ":" not in s):
        for place in study.probed.places:
            if body.members[own[name]] not in place.members:
                change = elsewhere(study, lambda k: nominal[k].states, name, place.name)
                add(("elsewhere", f"{name}>{place.name}", "always"), [change[rows] for rows in study.rows])


def elsewhere(study: Study, states: Callable[[int], np.ndarray], sensor: str, place: str) -> np.ndarray:
    """(m,) what the fitted runs read more where a sensor is as warm as a place is in the mean.

    states: (n + 1, r) of run k.
    """
    (body,) = study.probed.base.bodies
    mean, parts = study.probed.B[[p.name for p in study.probed.places].index(place)], []
    for k in study.fitted:
        plan = study.runs[k]
        T = np.zeros(plan.shapes[0])
        if sensor in plan.measured.sensors:
            i = plan.measured.sensors.index(sensor)
            T[:, i] = plan.measured.mean_of @ (states(k) @ (mean - body.C[plan.measured.column[i]]))
        parts.append(numbers(plan, T))
    return np.concatenate(parts)


def _drifts(name: str, plans: Sequence[Planned], time: Sequence[np.ndarray]) -> list[tuple[str, list[np.ndarray]]]:
    """Drifts of a sensor by 1 K/day in one of several runs that read it, over at its end, or with what has come
    together in all that follow."""
    found = list[tuple[str, list[np.ndarray]]]()
    reading = [r for r, plan in enumerate(plans) if name in plan.measured.sensors and len(time[r])]
    for r in reading if reading[1:] else ():
        plan = plans[r]
        within = [t / DAY if k == r else np.zeros(len(t)) for k, t in enumerate(time)]
        found.append((f"drift in {plan.run.name}", within))
        if r < reading[-1]:
            stays = [own + within[r][-1] * (k > r) for k, own in enumerate(within)]
            found.append((f"drift in {plan.run.name} that stays", stays))
    return found


def lagged(study: Study, states: Callable[[int], np.ndarray], sensor: str, seconds: float) -> np.ndarray:
    """(m,) what the fitted runs read more where a sensor follows with a time constant of `seconds` [s], per second.

    states: (n + 1, r) of run k. A run begins with the sensor as warm as what it sits on.
    """
    (body,) = study.probed.base.bodies
    parts = []
    for k in study.fitted:
        plan = study.runs[k]
        T = np.zeros(plan.shapes[0])
        if sensor in plan.measured.sensors:
            i = plan.measured.sensors.index(sensor)
            read = states(k) @ body.C[plan.measured.column[i]]
            keep = math.exp(-plan.run.step / seconds)
            followed, _ = lfilter([1.0 - keep], [1.0, -keep], read, zi=[keep * read[0]])
            T[:, i] = plan.measured.mean_of @ (followed - read)
        parts.append(numbers(plan, T) / seconds)
    return np.concatenate(parts)

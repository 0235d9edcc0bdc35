"""What an extension is worth on a run that was not looked at: delivered, recalibrated and extended model beside it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from twin.calibrate.fit.measured import Measured
from twin.diagnose.faults.elements import Key
from twin.diagnose.faults.readings import readings_of
from twin.diagnose.faults.table import fault_of
from twin.diagnose.model.study import COMPONENTS
from twin.diagnose.result.diagnosis import Gain
from twin.diagnose.search.accepted import acting, in_place, with_shifts
from twin.diagnose.search.look import Search
from twin.diagnose.search.policy import SearchPolicy


@dataclass(frozen=True)
class Predicted:
    """Of one run, (size,) each."""

    delivered: np.ndarray
    recalibrated: np.ndarray
    extended: np.ndarray


def predicted(found: Search, k: int) -> Predicted:
    """What the three models say of run k of the study."""
    detector, study = found.detector, found.detector.study
    delivered = study.outputs(k, np.zeros(len(found.x)))
    recalibrated = study.outputs(k, found.x0)
    if not found.accepted:
        return Predicted(delivered, recalibrated, study.outputs(k, found.x))
    there = with_shifts(study, found.accepted, found.x)
    extended = study.outputs(k, there, *acting(detector, found.accepted, k))
    return Predicted(delivered, recalibrated, extended + _read(found, k))


def _read(found: Search, k: int) -> np.ndarray:
    """(size,) what causes that act on readings, and go on, add in run k."""
    study = found.detector.study
    wanted = [a for a in found.accepted if fault_of(a.hypothesis).lasts]
    result = np.zeros(study.runs[k].size)
    if not wanted:
        return result
    one = replace(study, runs=(study.runs[k],), fitted=(0,))
    there = with_shifts(study, found.accepted, found.x)
    z = study.states(k, there, *acting(found.detector, found.accepted, k))
    columns, index = np.zeros((0, 0)), dict[Key, int]()
    if not all(fault_of(a.hypothesis).stepped for a in wanted):
        nominal = replace(found.detector.nominal[k], states=z)
        y = study.outputs(k, np.zeros(len(found.x)))
        columns, index = readings_of(one, [nominal], [y], [np.zeros((len(y), len(found.x)))], swaps=False)
    for a in wanted:
        fault, h = fault_of(a.hypothesis), a.hypothesis
        known = {p: columns[:, c] for (kind, p, when), c in index.items() if (kind, when) == (fault.kind, "always")}
        result += fault.read_in(one, z, h.name, float(a.amplitude[0]), known)
    return result


@dataclass(frozen=True)
class Channel:
    """What three models leave of a channel of a sealed run."""

    run: str
    name: str  # a sensor, or "dx", "dy", "dz"
    unit: str  # K or m
    time: np.ndarray  # (n,) s
    errors: Sequence[np.ndarray]  # (n,) each: of the delivered, the recalibrated, the extended model
    moved: bool  # whether the causes move it noticeably
    noise: float = np.nan  # in unit


def channels_of(found: Search, k: int, sealed: Measured, sigma: tuple[np.ndarray, np.ndarray]) -> tuple[Channel, ...]:
    """Of the sealed run k, whose measurements are opened here. sigma: noise of sensors (s,) and TCP (3,).

    A channel is moved that causes move, and that the extended model predicts otherwise than the recalibrated one: an
    expansion is not judged by temperatures that a calibration beside it has shifted. Causes that do not act in this run
    are judged by these alone: with a false one calibration goes astray, and predicts the run worse.
    """
    study, policy = found.detector.study, found.detector.policy
    planned = study.runs[k]
    models = [planned.split(v) for v in vars(predicted(found, k)).values()]
    bare = planned.split(study.outputs(k, found.x if found.accepted else found.x0))  # without its causes
    readings = sealed.temperature, sealed.temperature, in_place(sealed.temperature, sealed.sensors, found.accepted)
    inside = [a for a in found.accepted if a.units or fault_of(a.hypothesis).parameter]
    absent = bool(inside) and all(a.units and not any(unit.shapes[k].any() for unit in a.units) for a in inside)

    def channel(
        name: str, unit: str, time: np.ndarray, errors: list[np.ndarray], alone: np.ndarray, noise: float
    ) -> Channel:
        changes = [errors[2] - errors[1], *([] if absent else [errors[2] - alone])]
        moved = _least_rms(changes) > policy.noticed * noise
        return Channel(sealed.name, name, unit, time, errors, moved, noise)

    result = []
    for i, name in enumerate(sealed.sensors):
        errors = [read[:, i] - T[:, i] for read, (T, _) in zip(readings, models, strict=True)]
        alone = readings[1][:, i] - bare[0][:, i]
        result.append(channel(name, "K", sealed.bin_time, errors, alone, sigma[0][i]))
    for c in range(3 if len(sealed.tcp) else 0):
        errors = [sealed.tcp[:, c] - w[:, c] for _, w in models]
        alone = sealed.tcp[:, c] - bare[1][:, c]
        result.append(channel(COMPONENTS[c], "m", sealed.tcp_time, errors, alone, sigma[1][c]))
    return tuple(result)


def gains(channels: Sequence[Channel], seed: int, policy: SearchPolicy) -> tuple[Gain, ...]:
    """Per channel."""
    rng = np.random.default_rng(seed)
    return tuple(gain_of(c, rng, policy) for c in channels)


def likelihood_ratio(channels: Sequence[Channel], seed: int, policy: SearchPolicy) -> tuple[float, float]:
    """95 % interval, by a block bootstrap, of the logarithm of the likelihood ratio of the extended model and the
    recalibrated one, of all channels that are moved: half of what it takes from their squared errors, in variances of
    noise. A block holds all channels of a run for some time: their errors are not independent. (0, 0) of none moved.

    Channels are not counted: one that loses an error of a kelvin outweighs four that gain a twentieth of one.
    """
    blocks: dict[tuple[str, int], float] = {}
    for c in channels:
        less = 0.5 * (c.errors[1] ** 2 - c.errors[2] ** 2) / c.noise**2
        for i in np.flatnonzero(np.isfinite(less)) if c.moved else ():
            key = c.run, int(c.time[i] // policy.block)
            blocks[key] = blocks.get(key, 0.0) + float(less[i])
    if not blocks:
        return 0.0, 0.0
    values, rng = np.array(list(blocks.values())), np.random.default_rng(seed)
    draws = values[rng.integers(len(values), size=(policy.draws, len(values)))].sum(axis=1)
    low, high = np.quantile(draws, [0.025, 0.975])
    return float(low), float(high)


def _least_rms(changes: Sequence[np.ndarray]) -> float:
    """The least rms of changes of a channel (n,), where it was measured."""
    measured = [change[np.isfinite(change)] for change in changes]
    return min(float(np.sqrt(np.mean(change**2))) if len(change) else 0.0 for change in measured)


def gain_of(channel: Channel, rng: np.random.Generator, policy: SearchPolicy) -> Gain:
    """Of what three models leave of a channel."""
    run, name, unit, errors = channel.run, channel.name, channel.unit, channel.errors
    good = np.all(np.isfinite(errors), axis=0)
    if not good.any():
        return Gain(run, name, unit, np.nan, np.nan, np.nan, (np.nan, np.nan), False)
    time, own = channel.time[good], [e[good] for e in errors]
    rms = [float(np.sqrt(np.mean(e**2))) for e in own]
    block = ((time - time[0]) // policy.block).astype(int)
    members = [np.flatnonzero(block == b) for b in np.unique(block)]
    draws = []
    for _ in range(policy.draws):
        chosen = np.concatenate([members[b] for b in rng.integers(len(members), size=len(members))])
        left = [np.sqrt(np.mean(e[chosen] ** 2)) for e in own]
        draws.append((left[1] - left[2], left[0] - left[2]))
    (low, low_delivered), (high, high_delivered) = np.quantile(draws, [0.025, 0.975], axis=0).tolist()
    return Gain(run, name, unit, rms[0], rms[1], rms[2], (low, high), channel.moved, (low_delivered, high_delivered))

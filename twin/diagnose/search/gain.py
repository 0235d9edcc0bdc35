"""What an extension is worth on a run that was not looked at: delivered, recalibrated and extended model beside it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from twin.calibrate.fit.measured import Measured
from twin.diagnose.faults.readings import readings_of
from twin.diagnose.faults.table import fault_of
from twin.diagnose.model.study import COMPONENTS
from twin.diagnose.result.diagnosis import Gain
from twin.diagnose.search.accepted import in_place, states_with, stepped, with_shifts
from twin.diagnose.search.look import Search


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
    extended = stepped(detector, found.accepted, k, with_shifts(study, found.accepted, found.x))
    return Predicted(delivered, recalibrated, extended + _read(found, k))


def _read(found: Search, k: int) -> np.ndarray:
    """(size,) what causes that act on the reading of the TCP add in run k."""
    study = found.detector.study
    wanted = [a for a in found.accepted if fault_of(a.hypothesis).lasts]
    result = np.zeros(study.runs[k].size)
    if not wanted:
        return result
    one = replace(study, runs=(study.runs[k],), fitted=(0,))
    z = states_with(found.detector, found.accepted, k, with_shifts(study, found.accepted, found.x))
    nominal = replace(found.detector.nominal[k], states=z)
    y = study.outputs(k, np.zeros(len(found.x)))
    columns, index = readings_of(one, [nominal], [y], [np.zeros((len(y), len(found.x)))])
    for a in wanted:
        fault, h = fault_of(a.hypothesis), a.hypothesis
        known = {p: columns[:, c] for (kind, p, when), c in index.items() if (kind, when) == (fault.kind, "always")}
        result += fault.read_in(one, [nominal], h.name, float(a.amplitude[0]), known)
    return result


def gains(
    found: Search, k: int, sealed: Measured, seed: int, floors: tuple[np.ndarray, np.ndarray]
) -> tuple[Gain, ...]:
    """Per channel of the sealed run k; its measurements are opened here. floors: noise of sensors (s,) and TCP (3,).

    A channel is affected that causes move, and that the extended model predicts otherwise than the recalibrated one: an
    expansion is not judged by temperatures that a calibration beside it has shifted.
    """
    study, policy = found.detector.study, found.detector.policy
    planned = study.runs[k]
    models = [planned.split(v) for v in vars(predicted(found, k)).values()]
    bare = planned.split(study.outputs(k, found.x if found.accepted else found.x0))  # without its causes
    rng = np.random.default_rng(seed)
    readings = sealed.temperature, sealed.temperature, in_place(sealed.temperature, sealed.sensors, found.accepted)
    result = []
    for i, name in enumerate(sealed.sensors):
        errors = [read[:, i] - T[:, i] for read, (T, _) in zip(readings, models, strict=True)]
        alone = readings[1][:, i] - bare[0][:, i]
        affected = _least_rms([errors[2] - alone, errors[2] - errors[1]]) > policy.noticed * floors[0][i]
        result.append(gain_of(sealed.name, name, "K", errors, sealed.bin_time, affected, rng, policy.block))
    for c in range(3 if len(sealed.tcp) else 0):
        errors = [sealed.tcp[:, c] - w[:, c] for _, w in models]
        alone = sealed.tcp[:, c] - bare[1][:, c]
        affected = _least_rms([errors[2] - alone, errors[2] - errors[1]]) > policy.noticed * floors[1][c]
        result.append(gain_of(sealed.name, COMPONENTS[c], "m", errors, sealed.tcp_time, affected, rng, policy.block))
    return tuple(result)


def _least_rms(changes: Sequence[np.ndarray]) -> float:
    """The least rms of changes of a channel (n,), where it was measured."""
    measured = [change[np.isfinite(change)] for change in changes]
    return min(float(np.sqrt(np.mean(change**2))) if len(change) else 0.0 for change in measured)


def gain_of(
    run: str,
    name: str,
    unit: str,
    errors: list[np.ndarray],
    time: np.ndarray,
    affected: bool,
    rng: np.random.Generator,
    length: float,
) -> Gain:
    """Of what three models leave of a channel (n,) at times (n,); length [s] of the blocks of the bootstrap."""
    good = np.all(np.isfinite(errors), axis=0)
    if not good.any():
        return Gain(run, name, unit, np.nan, np.nan, np.nan, (np.nan, np.nan), False)
    own = [e[good] for e in errors]
    rms = [float(np.sqrt(np.mean(e**2))) for e in own]
    block = ((time[good] - time[good][0]) // length).astype(int)
    members = [np.flatnonzero(block == b) for b in np.unique(block)]
    draws = []
    for _ in range(400):
        chosen = np.concatenate([members[b] for b in rng.integers(len(members), size=len(members))])
        draws.append(np.sqrt(np.mean(own[1][chosen] ** 2)) - np.sqrt(np.mean(own[2][chosen] ** 2)))
    low, high = np.quantile(draws, [0.025, 0.975])
    return Gain(run, name, unit, rms[0], rms[1], rms[2], (float(low), float(high)), affected)

"""The machine's model as a witness beside all other channels: what these refute and it explains is no fault.

Few channels say little of one that is far from all of them: the temperature of a column that heats differently in each
run looks like that of a sensor that drifts, and so does the air's, which falls while the machine warms up. The loads
are inputs of the model. A finding is kept where the model, calibrated to the readings as they are, leaves as much as a
faulty sensor must explain; of a sensor in the air, where other temperatures of the machine say that the air was another
one. Of readings that were taken out no response is known: what the model predicts there must be nearer to the readings
less the fault than to the readings. Two channels are swapped where the model leaves less of them exchanged.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from twin.calibrate.channels.finding import Finding
from twin.calibrate.channels.judge import Judgement, set_aside, share
from twin.calibrate.fit.measured import Measured, measured
from twin.diagnose.evidence.fitter import Fitted, Fitter
from twin.diagnose.evidence.whiten import Projector, measured_of
from twin.diagnose.faults.channels_check import FAMILY, channels_at_fault, judged_channels, warmer_air
from twin.diagnose.model.study import Study, with_measured
from twin.diagnose.result.diagnosis import Cause
from twin.diagnose.search.accepted import readings_columns
from twin.diagnose.search.any_heat import entering
from twin.diagnose.search.detector import Detector, emptied
from twin.diagnose.search.exact import misfit_of_each
from twin.diagnose.search.look import look
from twin.logs.run import Run
from twin.rom.drive import measured_air


def upheld(detector: Detector, plans: Sequence[Measured], runs: Sequence[Run], judgement: Judgement) -> Judgement:
    """What is left of a judgement. Detector and plans: of the runs with all findings set aside, `runs` being the fitted
    ones as they were measured; who made them makes them anew where something of it is not left."""
    told = judgement.findings
    return replace(judgement, findings=tuple(f for f in told if _stands(detector, plans, runs, told, f)))


@dataclass(frozen=True)
class Measurements:
    """Of runs that a detector was made for, without the readings of channels at fault."""

    detector: Detector  # where these have gaps
    plans: list[Measured]  # of all runs
    y: np.ndarray  # (m,) what the fitted runs measured
    faults: list[Cause]
    judgement: Judgement


def other_measurements(detector: Detector, runs: Sequence[Run]) -> Measurements:
    """Other measurements of the runs that a detector was made for, sealed ones last. For campaigns: `twin diagnose`
    makes a detector of its own."""
    fitted = runs[: len(detector.study.fitted)]
    told = judged_channels(fitted, detector.study.probed.base)
    own = measurements(detector, runs, told)
    kept = upheld(own.detector, own.plans, fitted, told)
    return own if len(kept.findings) == len(told.findings) else measurements(detector, runs, kept)


def measurements(detector: Detector, runs: Sequence[Run], judgement: Judgement) -> Measurements:
    """The same by a judgement of the channels of the fitted runs."""
    study, n = detector.study, len(detector.study.fitted)
    names, sensors = [p.run.name for p in study.runs[:n]], study.probed.base.sensors
    sound, faults = channels_at_fault(runs[:n], judgement, sensors, names)
    every = zip([*sound, *runs[n:]], study.runs, strict=True)
    plans = [measured(study.probed.base, run, p.run.drive, p.run.name) for run, p in every]
    return Measurements(emptied(detector, plans), plans, measured_of(with_measured(study, plans)), faults, judgement)


def _stands(
    detector: Detector, plans: Sequence[Measured], runs: Sequence[Run], findings: Sequence[Finding], f: Finding
) -> bool:
    others = [g for g in findings if g is not f]
    if len(f.channels) == 2:  # swapped
        exchanged, as_read = (_left(detector, plans, set_aside(runs, own)) for own in (findings, others))
        return exchanged < as_read
    threshold = detector.thresholds.get(FAMILY)
    if threshold is None or not f.sized or not np.isfinite(f.statistic):
        return True
    base = detector.study.probed.base
    air = dict(base.ambient_sensors).get(f.channels[0])
    if air is not None:
        return _air_stands(detector, plans, runs, f, air, threshold)
    fitter = _with_readings(detector, plans, set_aside(runs, others))
    D = fitter.whiten(_column(fitter.study, f))
    if not D.any():
        return f.channels[0] not in base.sensors or _nearer_corrected(detector, plans, runs, f)
    fitted = fitter(measured_of(fitter.study))
    seen = fitted.projector(D)
    return float(seen @ fitter.whiten(fitted.residual)) ** 2 > threshold * float(seen @ D)


def _left(detector: Detector, plans: Sequence[Measured], runs: Sequence[Run]) -> float:
    """The misfit of the readings of the fitted runs to the calibrated model."""
    fitter = _with_readings(detector, plans, runs)
    fitted = fitter(measured_of(fitter.study))
    return float(misfit_of_each(replace(detector, fitter=fitter), fitted).sum())


def _nearer_corrected(detector: Detector, plans: Sequence[Measured], runs: Sequence[Run], f: Finding) -> bool:
    """`nearer_corrected` of readings that were taken out, for which the detector has no responses, by what the model
    predicts from the others."""
    study = detector.study
    y, name = measured_of(with_measured(study, plans)), f.channels[0]
    outputs, off = study.all_outputs(detector.fitter(y).x), list[tuple[int, np.ndarray, np.ndarray]]()
    for number, (planned, T, _) in enumerate(study.split(outputs)):
        m = planned.measured
        raw = measured(study.probed.base, runs[number], planned.run.drive, m.name)
        if name in raw.sensors and name in m.sensors and raw.temperature.shape[0] == len(T):
            beyond = raw.temperature[:, raw.sensors.index(name)] - T[:, m.sensors.index(name)]
            off.append((number, m.bin_time, beyond))
    return nearer_corrected(off, f)


def nearer_corrected(off: Sequence[tuple[int, np.ndarray, np.ndarray]], f: Finding) -> bool:
    """Whether readings less a fault are nearer to what is predicted there than the readings are; off: of fitted runs,
    by their number, times (b,) s and the readings (b,) K less what is predicted, NaN where there are none."""
    difference = np.concatenate([np.zeros(0), *(beyond for *_, beyond in off)])
    column = np.concatenate([np.zeros(0), *(_of_run(time, f, number) for number, time, _ in off)])
    known = np.isfinite(difference)
    if not column[known].any():
        return True
    A = column[known, None] if np.ptp(column[known]) == 0.0 else np.column_stack([column, np.ones(len(column))])[known]
    too_much = float(np.linalg.lstsq(A, difference[known], rcond=None)[0][0])
    return abs(too_much - f.size) < abs(too_much)


def _air_stands(
    detector: Detector, plans: Sequence[Measured], runs: Sequence[Run], f: Finding, e: int, threshold: float
) -> bool:
    """Of a sensor in the air that drives the model: whether other temperatures say that the air was another one
    than was measured, and nearer to what was measured less the fault."""
    study, blocks = detector.study, detector.elements.histories.blocks
    load = study.probed.base.load_model
    name = load.environments[e].name
    columns = warmer_air(detector.elements, name)
    if not load.environments[e].signal or not len(columns):
        return True
    means, off, of_fault = np.zeros(len(blocks)), list[np.ndarray](), list[np.ndarray]()
    for number, k in enumerate(study.fitted):
        drive, table = study.runs[k].run.drive, runs[number].temperatures
        middle = (drive.time[:-1] + drive.time[1:]) / 2
        of_run = f.size * _of_run(middle, f, number)
        for b, (i, first, end) in enumerate(blocks):
            means[b] = of_run[first:end].mean() if i == number else means[b]
        if table is not None and f.channels[0] in table.columns:
            values = table.columns[f.channels[0]]
            known = np.isfinite(values)
            off.append(np.interp(middle, table.time[known], values[known]) - measured_air(load, drive)[:, e])
            of_fault.append(of_run)
    warmer = detector.columns.raw[:, columns].astype(float) @ means
    if not warmer.any():
        return True
    y = measured_of(with_measured(study, plans))
    fitted = detector.fitter(y)
    colder, information, threshold = _told(detector, y, fitted, columns, warmer, threshold)
    difference, column = np.concatenate(off), np.concatenate(of_fault)
    taken_off = float(column @ difference) / float(column @ column)  # of the fault, before the model was driven by it
    total = taken_off + colder
    return abs(total - 1.0) < abs(total) and total**2 * information > threshold


def _told(
    detector: Detector, y: np.ndarray, fitted: Fitted, columns: np.ndarray, warmer: np.ndarray, threshold: float
) -> tuple[float, float, float]:
    """By how many times the white column warmer (m,) the air was colder, the information on it, and the statistic that
    it needs: beside the cause that explains the most, or heat of any history, where that is more than other air does,
    as what either leaves looks like other air, too. columns: of that air."""
    white, policy = detector.whiten(fitted.residual), detector.policy
    seen = fitted.projector(warmer)
    g, information = float(seen @ white), float(seen @ warmer)
    sight, ranked, step = look(detector, fitted)
    causes = (h for h in ranked if not np.isin(h.combination()[0], columns).any())
    leader, explained = next(causes, None), g**2 / max(information, 1e-30)
    heat = entering(detector, y, fitted, sight, step.parts)
    evidence = sum(own.evidence for own in heat)
    if evidence > max(explained + policy.rival, 0.0 if leader is None else leader.statistic):
        seen = Projector.of(*fitted.projector.blocks, *(own.told.responses for own in heat))(warmer)
        g, information = float(seen @ white), float(seen @ warmer)
        threshold = max(threshold, policy.misfit * evidence)
    elif leader is not None and leader.statistic > explained + max(policy.rival, policy.misfit * explained):
        D = readings_columns(detector, leader)
        PD = fitted.projector(D)
        beside = warmer - D @ np.linalg.lstsq(D.T @ PD, PD.T @ warmer, rcond=None)[0]
        seen = fitted.projector(beside)
        g, information = float(seen @ white), float(seen @ beside)
        threshold = max(threshold, policy.misfit * leader.statistic)
    return -g / max(information, 1e-30), information, threshold


def _of_run(time: np.ndarray, f: Finding, number: int) -> np.ndarray:
    """(n,) of the size of a finding, what its channel reads too much at times [s] of a fitted run."""
    return share(time, f, number == f.runs[0]) if number in f.runs else np.zeros(len(time))


def _with_readings(detector: Detector, plans: Sequence[Measured], runs: Sequence[Run]) -> Fitter:
    """The fitter with the readings of the fitted runs, where the plans have any."""
    study, told = detector.study, [p.measured for p in detector.study.runs]
    for k, run in zip(study.fitted, runs, strict=True):
        unused = [s for s in study.probed.base.sensors if s not in plans[k].sensors]
        own = measured(study.probed.base, run, study.runs[k].run.drive, plans[k].name, exclude=unused)
        if own.temperature.shape == plans[k].temperature.shape:
            known = np.isfinite(plans[k].temperature)
            told[k] = replace(plans[k], temperature=np.where(known, own.temperature, np.nan))
    study = with_measured(study, told)
    return replace(detector.fitter, study=study, whiten=replace(detector.whiten, study=study))


def _column(study: Study, f: Finding) -> np.ndarray:
    """(m,) K that one of a finding's size adds to the outputs of the fitted runs."""
    column = study.joined(lambda _: (0.0, 0.0))
    for number, (planned, T, _) in enumerate(study.split(column)):
        m = planned.measured
        if f.channels[0] in m.sensors:
            T[:, m.sensors.index(f.channels[0])] = _of_run(m.bin_time, f, number)
    return column

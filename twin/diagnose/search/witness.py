"""The machine's model as a witness beside all other channels: what these refute and it explains is no fault.

Few channels say little of one that is far from all of them: a sensor on a column that heats differently in each run
looks like one that drifts. The model knows the loads. A finding stands where the model, calibrated to the readings as
they are, leaves as much as a faulty sensor must explain.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from twin.calibrate.channels.finding import Finding
from twin.calibrate.channels.judge import Judgement, judge, set_aside, share
from twin.calibrate.fit.measured import Measured, measured
from twin.diagnose.evidence.fitter import Fitter
from twin.diagnose.evidence.whiten import measured_of
from twin.diagnose.faults.channels_check import FAMILY, channels_at_fault
from twin.diagnose.model.study import Study, with_measured
from twin.diagnose.result.diagnosis import Cause
from twin.diagnose.search.detector import Detector, emptied
from twin.logs.run import Run


def upheld(
    detector: Detector, plans: Sequence[Measured], runs: Sequence[Run], judgement: Judgement
) -> tuple[Detector, list[Measured], Judgement]:
    """What is left of a judgement, and detector and plans with the readings of what is not.

    plans: of the fitted runs with all findings set aside, then of sealed ones. runs: the fitted ones as they were
    measured. Only what was corrected is asked about: for readings that were taken out the detector has no responses.
    """
    stands = tuple(f for f in judgement.findings if _stands(detector, plans, runs, judgement.findings, f))
    if len(stands) == len(judgement.findings):
        return detector, list(plans), judgement
    fitter, left = _with_readings(detector, plans, set_aside(runs, stands))
    return replace(detector, study=fitter.study, fitter=fitter), left, replace(judgement, findings=stands)


def other_measurements(
    detector: Detector, runs: Sequence[Run]
) -> tuple[Detector, list[Measured], np.ndarray, list[Cause]]:
    """A detector for other measurements of the runs that it was made for, sealed ones last: with their plans, what the
    fitted ones measured (m,), and the channels at fault. For campaigns: `twin diagnose` makes a detector of its own."""
    study, n = detector.study, len(detector.study.fitted)
    names, sensors, judgement = [p.run.name for p in study.runs[:n]], study.probed.base.sensors, judge(runs[:n])
    sound = [*channels_at_fault(runs[:n], judgement, sensors, names)[0], *runs[n:]]
    plans = [measured(study.probed.base, r, p.run.drive, p.run.name) for r, p in zip(sound, study.runs, strict=True)]
    own, plans, judgement = upheld(emptied(detector, plans), plans, runs[:n], judgement)
    faults = channels_at_fault(runs[:n], judgement, sensors, names)[1]
    return own, plans, measured_of(with_measured(study, plans)), faults


def _stands(
    detector: Detector, plans: Sequence[Measured], runs: Sequence[Run], findings: Sequence[Finding], f: Finding
) -> bool:
    threshold = detector.thresholds.get(FAMILY)
    if threshold is None or not f.sized or not np.isfinite(f.statistic):
        return True
    fitter, _ = _with_readings(detector, plans, set_aside(runs, [g for g in findings if g is not f]))
    D = fitter.whiten(_column(fitter.study, f))
    if not D.any():  # no sensor of the machine, or its readings were taken out
        return True
    fitted = fitter(measured_of(fitter.study))
    seen = fitted.projector(D)
    return float(seen @ fitter.whiten(fitted.residual)) ** 2 > threshold * float(seen @ D)


def _with_readings(detector: Detector, plans: Sequence[Measured], runs: Sequence[Run]) -> tuple[Fitter, list[Measured]]:
    """The fitter and plans with the readings of the fitted runs, where the plans have any; sealed ones stay."""
    study, left = detector.study, list(plans)
    for k, run in zip(study.fitted, runs, strict=True):
        unused = [s for s in study.probed.base.sensors if s not in plans[k].sensors]
        own = measured(study.probed.base, run, study.runs[k].run.drive, plans[k].name, exclude=unused)
        if own.temperature.shape == plans[k].temperature.shape:
            known = np.isfinite(plans[k].temperature)
            left[k] = replace(plans[k], temperature=np.where(known, own.temperature, np.nan))
    told = [left[k] if k in study.fitted else p.measured for k, p in enumerate(study.runs)]
    study = with_measured(study, told)
    return replace(detector.fitter, study=study, whiten=replace(detector.whiten, study=study)), left


def _column(study: Study, f: Finding) -> np.ndarray:
    """(m,) K that one of a finding's size adds to the outputs of the fitted runs."""
    parts = []
    for number, k in enumerate(study.fitted):
        m = study.runs[k].measured
        reads, tcp = np.zeros(m.temperature.shape), np.zeros(m.tcp.shape)
        if number in f.runs and f.channels[0] in m.sensors:
            reads[:, m.sensors.index(f.channels[0])] = share(m.bin_time, f, number == f.runs[0])
        parts += [reads.ravel(), tcp.ravel()]
    return np.concatenate(parts)

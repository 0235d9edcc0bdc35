"""Changes of a size that is known, judged from the description and not from where a fit has ended.

A current of twice what the log says is four times the heat of a motor, and calibration finds a gain of four. Beside
that fit the right factor explains nothing more. Nor does heat that enters at another face, all of it, when calibration
has bent joints and capacities around it. So each of them is given a fit of its own, which begins at the description,
and counts by how much less misfit it leaves than calibration without it.

To first order that says which factors are worth a try, and not what they explain: with four times the heat a film or a
joint near the motor counts four times as much. Those few are fitted with the model that has the corrected signal.
Nor does it say what a bearing does that warms another face, and is as warm as that: such are told by the model with
the heat there, whose parameters are fitted to first order. (`twin.diagnose.search.contest` fits them exactly.) And of
two sensors with each other's name calibration makes two losses that are off, beside which putting them back is wrong.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.evidence.fitter import Fitted, bounds
from twin.diagnose.faults.acted import slots_with, units_of
from twin.diagnose.faults.fault import Fault
from twin.diagnose.faults.table import fault_of
from twin.diagnose.model.integration import loads_for
from twin.diagnose.model.study import Planned, Study
from twin.diagnose.search.accepted import Accepted, exchanged, parameter_of
from twin.diagnose.search.contest import misfit
from twin.diagnose.search.detector import Detector
from twin.rom.drive import Drive, evaluate


def declared_candidates(detector: Detector, y: np.ndarray, fitted: Fitted) -> list[Hypothesis]:
    """Exact factors of signals that leave less misfit than the fit without a cause does, to first order."""
    before, found = misfit(detector, fitted), []
    for h, D in _promising(detector, y, lambda fault: fault.corrects)[: detector.policy.closely]:
        statistic = before - _fitted_with(detector, y, D)
        if statistic > 0.0:
            found.append(replace(h, statistic=statistic))
    return found


def misplaced_candidates(detector: Detector, y: np.ndarray, fitted: Fitted) -> list[Hypothesis]:
    """Likewise of sources all of whose heat is elsewhere, with what they do there beside the described machine."""
    study, before, found = detector.study, misfit(detector, fitted), []
    for h, _ in _promising(detector, y, lambda fault: fault.elsewhere)[: detector.policy.closely]:
        units, x = units_of(study, h), np.zeros(len(fitted.x))
        there = [study.outputs(k, x, slots_with(study, detector.elements, units, k), h.amplitude) for k in study.fitted]
        change = detector.whiten(np.concatenate(there) - detector.fitter.surrogate.y0)
        statistic = before - _fitted_with(detector, y, change)
        if statistic > 0.0:
            found.append(replace(h, statistic=statistic))
    return found


def swapped_candidates(detector: Detector, y: np.ndarray, fitted: Fitted) -> list[Hypothesis]:
    """Two channels with each other's name that leave less misfit with their readings put back, to first order: what
    calibration has made of them, such as two losses that are off by factors, is not beside it then."""
    study, before, found = detector.study, misfit(detector, fitted), []
    for h, _ in _promising(detector, y, lambda fault: fault.exchanges)[: detector.policy.closely]:
        back = exchanged(study, y, [Accepted(h, (), np.ones(1), np.eye(1), 0.0, 0.0, ())])
        statistic = before - _fitted_with(detector, back, np.zeros(len(y)))
        if statistic > 0.0:
            found.append(replace(h, statistic=statistic))
    return found


def declared_exactly(detector: Detector, y: np.ndarray, fitted: Fitted) -> list[Hypothesis]:
    """Likewise with the model that has the corrected signal, and also those that explain nothing: the best factor of
    each of the SIGNALS most promising; where that explains half of what a signal must, CLOSELY of them."""
    before, found = misfit(detector, fitted), list[Hypothesis]()
    factors = dict[str, list[Hypothesis]]()
    for h, _ in _promising(detector, y, lambda fault: fault.corrects):
        factors.setdefault(fault_of(h).factor(h.name)[0], []).append(h)
    for name, own in list(factors.items())[: detector.policy.signals]:
        for h in own[: detector.policy.closely]:
            corrected = with_signal(detector.study, fault_of(h).bare(name), fault_of(h).factor(h.name)[1])
            least = 0.5 * detector.thresholds[h.family]
            statistic = before - _fitted_by(detector, y, corrected, before - least)
            found.append(replace(h, statistic=max(statistic, 0.0)))
            if statistic < least:
                break
    return found


def with_signal(study: Study, signal: str, factor: float) -> Study:
    """The fitted runs as if the logged values of a signal were larger by a factor."""
    runs = [_corrected(study, p, signal, factor) if k in study.fitted else p for k, p in enumerate(study.runs)]
    return replace(study, runs=tuple(runs))


def _corrected(study: Study, planned: Planned, signal: str, factor: float) -> Planned:
    base, run = study.probed.base, planned.run
    if signal not in run.signals:
        return planned
    signals = {n: values * (factor if n == signal else 1.0) for n, values in run.signals.items()}
    more, less = (_evaluated(study, run.drive, values) for values in (signals, run.signals))
    drive = _sum(run.drive, more, less, list(base.load_model.contact_sources))
    return replace(planned, run=replace(run, drive=drive, signals=signals, loads=loads_for(base, drive)))


def _evaluated(study: Study, drive: Drive, signals: dict[str, np.ndarray]) -> Drive:
    """From means over the steps of a drive, which know nothing of what happens within them."""
    dt = float(drive.time[1] - drive.time[0])
    return evaluate(study.probed.base.load_model, drive.time[:-1], signals, dt, drive.n_steps)


def _sum(drive: Drive, more: Drive, less: Drive, moving: list[int]) -> Drive:
    """What laws of sources and films say in a drive, and by how much more they say it in another than in a third.

    moving: sources at contacts, whose heat goes where the pads of the first drive are.
    """
    power = drive.power + more.power - less.power
    ratio = (power / np.where(drive.power != 0.0, drive.power, 1.0))[:, moving]
    return replace(
        drive,
        power=power,
        contact_heat=drive.contact_heat * ratio[:, :, None],
        theta=drive.theta + more.theta - less.theta,
        films=replace(drive.films, value=drive.films.value + more.films.value - less.films.value),
        losses=replace(drive.losses, value=drive.losses.value + more.losses.value - less.losses.value),
    )


def _promising(detector: Detector, y: np.ndarray, of: Callable[[Fault], bool]) -> list[tuple[Hypothesis, np.ndarray]]:
    """Those of some faults and their white responses (m,), to first order, first those that leave least beside the
    description."""
    found = []
    for batch in detector.columns.batches:
        if not of(fault_of(batch)):
            continue
        D = detector.columns.raw[:, batch.columns[:, 0]].astype(float)
        f, J = detector.fitter.surrogate.at(np.zeros(len(detector.study.probed.parameters)))
        left = detector.whiten(y - f)[:, None] - D
        remains = (left * detector.fitter.projector(J)(left)).sum(axis=0)
        found += [
            (float(remains[i]), Hypothesis(batch, i, batch.histories[0], 0.0, (1.0,), 0.0), D[:, i])
            for i in range(len(batch.places))
        ]
    return [(h, D) for _, h, D in sorted(found, key=lambda made: made[0])]


def _fitted_with(detector: Detector, y: np.ndarray, change: np.ndarray) -> float:
    """The misfit beside a white change (m,) of the outputs, parameters fitted."""
    low, high = bounds(detector.study)
    x, left = np.zeros_like(low), np.inf
    for _ in range(detector.policy.first_order_passes):
        f, J = detector.fitter.surrogate.at(x)
        projector = detector.fitter.projector(J)
        white = detector.whiten(y - f + J @ x) - change
        left = float(white @ projector(white))
        x = np.clip(projector.most_likely(white)[: len(x)], low, high)
    return left


def _fitted_by(detector: Detector, y: np.ndarray, study: Study, enough: float) -> float:
    """The misfit of a study with other loads, parameters fitted. Where it is below `enough`, with exact derivatives."""
    low, high = bounds(study)
    x, hotter, left = np.zeros(len(low)), _gains(detector.study, study), np.inf
    for i in range(detector.policy.exact_passes + 1):
        if i < detector.policy.exact_passes:
            J = detector.fitter.surrogate.at(x + hotter)[1]
        elif left < enough:
            J = np.vstack([study.jacobian(k, x)[:, : len(x)] for k in study.fitted])
        else:
            break
        projector = detector.fitter.projector(J)
        white = detector.whiten(y - np.concatenate([study.outputs(k, x) for k in study.fitted]) + J @ x)
        left = float(white @ projector(white))
        x = np.clip(projector.most_likely(white)[: len(x)], low, high)
    return left


def _gains(described: Study, corrected: Study) -> np.ndarray:
    """(n,) prior standard deviations by which sources of the description would be moved to emit what they do with
    corrected loads: parameters do there nearly what they do here."""
    before, after = _emitted(described), _emitted(corrected)
    result = np.zeros(len(described.probed.parameters))
    for source, was, now in zip(described.probed.base.load_model.sources, before, after, strict=True):
        j = parameter_of(described, f"sources.{source.name}")
        if j is not None and was > 0.0 and now > 0.0:
            result[j] = np.log(now / was) / described.scale[j]
    return result


def _emitted(study: Study) -> np.ndarray:
    """(n_sources,) J of the fitted runs, at the temperatures in the middle of the tables of losses that follow one."""
    total = np.zeros(len(study.probed.base.load_model.sources))
    for k in study.fitted:
        drive = study.runs[k].run.drive
        step = float(drive.time[1] - drive.time[0])
        total += step * drive.power.sum(axis=0)
        following = drive.losses.value[:, :, drive.losses.value.shape[2] // 2].sum(axis=0)
        total[list(drive.losses.index)] += step * following
    return total

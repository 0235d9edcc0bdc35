"""Changes of a size that is known, judged from the description and not from where a fit has ended.

Of a current of twice what the log says, which is four times the heat, calibration makes a gain of four, beside which
the right factor explains nothing more; of heat that enters elsewhere bent joints, of two sensors with each other's name
two losses that are off. So each of them is given a fit of its own, which begins at the description, and counts by how
much less misfit it leaves than calibration without it. To first order that says which are worth a try; as four times
the heat makes films and joints count four times as much, the most promising factors are fitted with the model that has
the corrected signal, and heat elsewhere counts by what it does there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np

from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.evidence.fitter import Fitted, bounds
from twin.diagnose.faults.fault import Fault
from twin.diagnose.faults.table import fault_of
from twin.diagnose.model.probed_loads import loads_for
from twin.diagnose.model.study import Planned, Study
from twin.diagnose.model.surrogate import jacobian_of
from twin.diagnose.search.accepted import as_scored, exchanged, outputs_with, parameter_of
from twin.diagnose.search.detector import Detector
from twin.diagnose.search.exact import misfit
from twin.rom.drive import Drive, evaluate


def declared_candidates(detector: Detector, y: np.ndarray, fitted: Fitted) -> list[Hypothesis]:
    """Exact factors of signals that leave less misfit than the fit without a cause does, to first order."""
    return _better(detector, y, fitted, lambda fault: fault.corrects, lambda _, D: _fitted_with(detector, y, D))


def misplaced_candidates(detector: Detector, y: np.ndarray, fitted: Fitted) -> list[Hypothesis]:
    """The same of sources all of whose heat is elsewhere, with what they do there beside the described machine."""

    def left(h: Hypothesis, _: np.ndarray) -> float:
        there = outputs_with(detector, [as_scored(detector.study, h)], np.zeros(len(fitted.x)))
        return _fitted_with(detector, y, detector.whiten(there - detector.fitter.surrogate.y0))

    return _better(detector, y, fitted, lambda fault: fault.elsewhere, left)


def swapped_candidates(detector: Detector, y: np.ndarray, fitted: Fitted) -> list[Hypothesis]:
    """The same of two channels with each other's name, with their readings put back."""

    def left(h: Hypothesis, _: np.ndarray) -> float:
        back = exchanged(detector.study, y, [as_scored(detector.study, h)])
        return _fitted_with(detector, back, np.zeros(len(y)))

    return _better(detector, y, fitted, lambda fault: fault.exchanges, left)


def _better(
    detector: Detector, y: np.ndarray, fitted: Fitted, of: Callable[[Fault], bool],
    left: Callable[[Hypothesis, np.ndarray], float],
) -> list[Hypothesis]:  # fmt: skip
    """The most promising of some faults with which less misfit is left (of it and its response) than without."""
    before, tried = misfit(detector, fitted), _promising(detector, y, of)[: detector.policy.closely]
    found = [replace(h, statistic=before - left(h, D)) for h, D in tried]
    return [h for h in found if h.statistic > 0.0]


def declared_exactly(detector: Detector, y: np.ndarray, fitted: Fitted) -> list[Hypothesis]:
    """Likewise with the model that has the corrected signal, and also those that explain nothing: the best factor of
    each of the most promising `signals`; where that explains half of what a signal must, `closely` of them.

    Exact derivatives may find what the surrogate of the fit without a cause does not, whatever the factor: twice a
    speed and half of it explained as much. So where a fit without any, by the same derivatives, explains most of it, a
    factor counts from there.
    """
    before, found = misfit(detector, fitted), list[Hypothesis]()

    @cache
    def without() -> float:
        return min(before, _fitted_by(detector, y, detector.study, np.inf))

    factors = dict[str, list[Hypothesis]]()
    for h, _ in _promising(detector, y, lambda fault: fault.corrects):
        factors.setdefault(fault_of(h).factor(h.name)[0], []).append(h)
    for name, own in list(factors.items())[: detector.policy.signals]:
        for h in own[: detector.policy.closely]:
            corrected = with_signal(detector.study, fault_of(h).bare(name), fault_of(h).factor(h.name)[1])
            least = 0.5 * detector.thresholds[h.family]
            statistic = before - _fitted_by(detector, y, corrected, before - least)
            if statistic > least and (other := before - without()) > 0.5 * statistic:
                statistic -= other
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
    was = run.loads  # laws of films stay as they are fitted
    loads = replace(loads_for(base, drive), usual=was.usual, wind=was.wind, wind_exponent=was.wind_exponent)
    return replace(planned, run=replace(run, drive=drive, signals=signals, loads=loads))


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
    f, _, projector = detector.fitter.linear(np.zeros(len(detector.study.probed.parameters)))
    white = detector.whiten(y - f)[:, None]
    found: list[tuple[float, Hypothesis, np.ndarray]] = []
    for batch in (b for b in detector.columns.batches if of(fault_of(b))):
        D = detector.columns.raw[:, batch.columns[:, 0]].astype(float)
        remains = ((white - D) * projector(white - D)).sum(axis=0)
        always = [Hypothesis(batch, i, batch.histories[0], 0.0, (1.0,)) for i in range(len(batch.places))]
        found += zip(remains.tolist(), always, D.T, strict=True)
    return [(h, D) for _, h, D in sorted(found, key=lambda made: made[0])]


def _fitted_with(detector: Detector, y: np.ndarray, change: np.ndarray) -> float:
    """The misfit beside a white change (m,) of the outputs, parameters fitted."""
    low, high = bounds(detector.study)
    x, left = np.zeros_like(low), np.inf
    for _ in range(detector.policy.first_order_passes):
        f, J, projector = detector.fitter.linear(x)
        white = detector.whiten(y - f + J @ x) - change
        left = float(white @ projector(white))
        x = np.clip(projector.most_likely(white)[: len(x)], low, high)
    return left


def _fitted_by(detector: Detector, y: np.ndarray, study: Study, enough: float) -> float:
    """The misfit of a study with other loads, parameters fitted. Where it is below `enough`, with exact derivatives:
    where these end a surrogate of other loads does not, and far from the description it may lead away, so that they
    begin where it has left least."""
    (low, high), policy = bounds(study), detector.policy
    hotter = imitating(detector.study, study)

    def step(x: np.ndarray, J: np.ndarray) -> tuple[np.ndarray, float]:
        projector = detector.fitter.projector(J)
        white = detector.whiten(y - study.all_outputs(x) + J @ x)
        return np.clip(projector.most_likely(white)[: len(x)], low, high), float(white @ projector(white))

    x, begun, least = np.zeros(len(low)), np.zeros(len(low)), np.inf
    for _ in range(policy.exact_passes):
        after, left = step(x, detector.fitter.surrogate.at(x + hotter)[1])
        if left > least + policy.less:
            x = begun
            break
        x, begun, least = after, x, left
    if least >= enough:
        return least
    there, least = np.full_like(x, np.inf), np.inf
    for _ in range(policy.exact_passes):
        if np.abs(x - there).max(initial=0.0) > policy.anew:
            there, J = x, jacobian_of(study, x)
        x, left = step(x, J)
        if left > least - policy.less:
            break
        least = left
    return min(least, left)


def imitating(described: Study, corrected: Study) -> np.ndarray:
    """(n,) prior standard deviations by which described sources would emit what they do with corrected loads."""
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

"""What today's runs and one more would tell: information about columns of causes, row by row of what is measured.

The window model of today's runs does not know the loads of an experiment, so one is made for all of them; sensors that
are not there yet read the mean temperature of their surface or node. Then, as in the detector, but for its modes of
model discrepancy: these are learned from what simulations leave, and to simulate and calibrate hundreds of them for
each experiment would take hours. `plan` assumes that they weaken the next run as they weaken today's.

Of white columns M = [D N] (causes, nuisances) M^T M is a sum over rows, hence over runs and sensors: each sensor that
one might add costs a product of its own rows, and F = D^T Pi D = M_DD - M_DN (1 + M_NN)^-1 M_ND.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg

from twin.calibrate.fit.measured import measured
from twin.calibrate.fit.noise import Channels
from twin.diagnose.evidence.film_laws import with_film_laws
from twin.diagnose.evidence.formal import known_forms
from twin.diagnose.evidence.nulls import Form
from twin.diagnose.evidence.whiten import Whitener
from twin.diagnose.faults.elements import Elements, Histories, Key, elements_of
from twin.diagnose.faults.forms import described_forms, is_nuisance
from twin.diagnose.faults.readings import readings_of
from twin.diagnose.model.bank import Nominal, nominal_run, respond
from twin.diagnose.model.probed_model import ProbedModel, make_probed_model
from twin.diagnose.model.study import Planned, Study, make_study
from twin.diagnose.plan.experiments import SENSOR, Experiment, longest_of
from twin.diagnose.search.detector import Detector, bare_forms
from twin.logs.run import Run
from twin.machine.description import Machine
from twin.progress import Progress, silent
from twin.rom.parameter import OF_LAWS
from twin.run.system import prepare

AT = "sensor at "  # and its place: the name of what adds a sensor


@dataclass(frozen=True)
class Foreseen:
    """One experiment, with one more sensor or none."""

    name: str
    words: str  # what to do
    # (2 u, 2 u): of the asked columns as they act in today's runs, then of each alone in the hours of the new run in
    # which it acts in today's (zero for what does not switch: its first column goes on)
    before: np.ndarray
    after: np.ndarray


@dataclass(frozen=True)
class _Run:
    """A run at the nominal parameters."""

    outputs: np.ndarray  # (size,)
    J: np.ndarray  # (size, n)
    nominal: Nominal


def foreseen(
    detector: Detector, machine: Machine, runs: Sequence[Run], experiments: Sequence[Experiment],
    asked: Sequence[Key], noise: float, progress: Progress = silent,
) -> Iterator[Foreseen]:  # fmt: skip
    """The experiments one after the other, each beside today's runs.

    runs: as the detector's study was fitted to; asked: keys of the detector's columns (u,) whose information is wanted;
    noise [K] of a reading, where no sensor of today tells that of a mean.
    """
    today, form = detector.study, Form()
    n = len(runs)
    described = [p for p in today.probed.parameters if p.kind not in OF_LAWS]
    every = [*runs, *(e.run for e in experiments)]
    probed = make_probed_model(machine, described, every, progress, step=today.runs[0].run.step)
    probed = _with_sensors(probed, list(dict.fromkeys(p for e in experiments for p in e.places)))
    plans = [
        measured(probed.base, run, own.drive, own.name, exclude=_left_out(today, run))
        for run, own in zip(every, probed.runs, strict=True)
    ]
    study = with_film_laws(make_study(probed, plans, range(len(plans))), form)
    known = [_at_nominal(study, k) for k in range(n)]
    channels = [_channels(detector, study.runs[k], k, noise) for k in range(n)]
    of_new = longest_of(runs)
    with progress("experiments", len(experiments)) as advance:
        for e, experiment in enumerate(experiments):
            own = study.runs[n + e]
            both = replace(study, runs=(*study.runs[:n], own), fitted=tuple(range(n + 1)))
            each = [*known, _at_nominal(study, n + e)]
            whiten = Whitener(both, (*channels, _channels(detector, own, of_new, noise)))
            yield from _compared(both, whiten, each, experiment, asked, detector.elements.histories, form)
            advance(experiment.name)


def _left_out(study: Study, run: Run) -> list[str]:
    """Sensors of a run that the study does not read."""
    read = {s for k in study.fitted for s in study.runs[k].measured.sensors}
    columns = run.temperatures.columns if run.temperatures is not None else {}
    return [c for c in columns if c not in read and not c.startswith(SENSOR)]


def _with_sensors(probed: ProbedModel, names: Sequence[str]) -> ProbedModel:
    """With a sensor at each of these places: it reads their mean temperature."""
    (body,) = probed.base.bodies
    rows = probed.B[[next(i for i, p in enumerate(probed.places) if p.name == name) for name in names]]
    sensors = (*probed.base.sensors, *(SENSOR + name for name in names))
    wider = replace(body, C=np.vstack([body.C, rows]), sensors=tuple(range(len(sensors))))
    base = replace(probed.base, bodies=(wider,), sensors=sensors)
    prepared = prepare(base)
    return replace(
        probed, base=base, layout=prepared.layout, system=prepared.system, displaced=np.vstack([probed.displaced, rows])
    )


def _at_nominal(study: Study, k: int) -> _Run:
    n = len(study.probed.parameters)
    return _Run(study.outputs(k, np.zeros(n)), study.jacobian(k, np.zeros(n))[:, :n], nominal_run(study, k))


def _channels(detector: Detector, planned: Planned, k: int, noise: float) -> tuple[Channels, Channels]:
    """Noise of a run's channels: of the detector's run k; of sensors that are not there the median."""

    def usual(values: np.ndarray, none: float) -> float:
        return float(np.median(values)) if len(values) else none

    sensors, tcp = detector.whiten.channels[k]
    own = {s: i for i, s in enumerate(detector.study.runs[k].measured.sensors)}
    sigma, phi = (
        np.array([float(v[own[s]]) if s in own else usual(v, none) for s in planned.measured.sensors])
        for v, none in ((sensors.sigma, noise), (sensors.phi, 0.0))
    )
    return Channels(sigma, phi), tcp


def _compared(
    study: Study, whiten: Whitener, runs: Sequence[_Run], experiment: Experiment, asked: Sequence[Key],
    today: Histories, form: Form,
) -> Iterator[Foreseen]:  # fmt: skip
    nominal = tuple(r.nominal for r in runs)
    elements = elements_of(study, nominal)
    J = np.vstack([r.J for r in runs])
    readings, of_reading = readings_of(study, nominal, [r.outputs for r in runs], [r.J for r in runs], swaps=False)
    wanted = [_columns(elements, of_reading, key, today) for key in asked]
    asked_for = {c for now, new, reading, _ in wanted for c in (now, new) if c is not None and not reading}
    chosen = sorted(asked_for | {c for key, c in elements.index.items() if is_nuisance(key)})
    narrow = _narrowed(elements, chosen)
    place = {c: i for i, c in enumerate(chosen)}
    raw = respond(study, nominal, elements.vectors, narrow.columns)
    described = described_forms(study, narrow, raw, form)
    known = known_forms(study, described, nominal, raw, J, whiten, form)
    D = np.zeros((len(J), 2 * len(wanted)))
    for i, (now, new, reading, factor) in enumerate(wanted):
        if now is not None:
            D[:, i] = factor * (readings[:, now] if reading else raw[:, place[now]])
        if new is not None:
            D[:, len(wanted) + i] = factor * raw[:, place[new]]
    M = np.hstack([whiten(D), whiten(J), *map(whiten, bare_forms(study, readings, of_reading)), known])
    rows = _rows(study)
    of_rows = {name: M[rows == name].T @ M[rows == name] for name in ("today", "", *experiment.places)}
    before, after, u = of_rows["today"], of_rows["today"] + of_rows[""], D.shape[1]
    told = _information(before, u)
    if not experiment.places:
        yield Foreseen(experiment.name, experiment.words, told, _information(after, u))
    for name in experiment.places:
        words = f"{experiment.words}, with a temperature sensor at {name}"
        yield Foreseen(f"{AT}{name}", words, told, _information(after + of_rows[name], u))


def _columns(
    elements: Elements, of_reading: dict[Key, int], key: Key, today: Histories
) -> tuple[int | None, int | None, bool, float]:
    """Of a key of today: its column, the one of the same hour of the new run, whether they are readings, and the factor
    that makes them what they are today (histories are 1 at the largest value of their signal, which may be another)."""
    kind, name, history = key
    if key not in elements.index:
        return of_reading.get(key), None, True, 1.0
    factor = 1.0
    if history in today.unit and history in elements.histories.unit:
        _, exponent, was = today.unit[history]
        _, _, now = elements.histories.unit[history]
        factor = (now / was) ** exponent
    new, start = None, begins(elements.histories, history)
    if start is not None:
        blocks = elements.histories.blocks
        same = next((b for b, (i, first, _) in enumerate(blocks) if i == blocks[-1][0] and first == start), None)
        new = None if same is None else elements.index[kind, name, f"block {same}"]
    return elements.index[key], new, False, factor


def begins(histories: Histories, history: str) -> int | None:
    """The first step, in its run, of a history that is a block; None of others."""
    return histories.blocks[int(history.removeprefix("block "))][1] if history.startswith("block ") else None


def _narrowed(elements: Elements, chosen: Sequence[int]) -> Elements:
    """With these columns alone."""
    place = {c: i for i, c in enumerate(chosen)}
    blocks = {
        key: np.array([place[c] for c in own]) for key, own in elements.block_of.items() if all(c in place for c in own)
    }
    return replace(
        elements, columns=tuple(elements.columns[c] for c in chosen), block_of=blocks,
        index={key: place[c] for key, c in elements.index.items() if c in place},
    )  # fmt: skip


def _rows(study: Study) -> np.ndarray:
    """(m,) what every number is of: "today", "" of the new run, or the place of a sensor that is not there yet."""
    parts = []
    for k in study.fitted:
        planned = study.runs[k]
        (bins, _), (tcp, _) = planned.shapes
        last = k == study.fitted[-1]
        of_sensor = [s.removeprefix(SENSOR) if s.startswith(SENSOR) else "" for s in planned.measured.sensors]
        names = of_sensor if last else ["today"] * len(of_sensor)
        parts += [np.tile(np.array(names, dtype=object), bins), np.full(3 * tcp, "" if last else "today", dtype=object)]
    return np.concatenate(parts)


def _information(gram: np.ndarray, u: int) -> np.ndarray:
    """(u, u): D^T Pi D from M^T M of M = [D N]."""
    factor = scipy.linalg.cho_factor(np.eye(len(gram) - u) + gram[u:, u:], lower=True)
    return np.asarray(gram[:u, :u] - gram[:u, u:] @ scipy.linalg.cho_solve(factor, gram[u:, :u]))

"""`twin diagnose`: from an artefact and measured runs to a verdict, an extended description and the gain."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from twin import __version__
from twin.build.cache import arrays_hash, cached, machine_hash
from twin.calibrate.channels.judge import Judgement
from twin.calibrate.channels.table import channel_rows, with_findings
from twin.calibrate.fit.measured import Measured, measured
from twin.calibrate.fit.problem import run_names
from twin.calibrate.fit.traces import traces_of_run
from twin.diagnose.evidence.discretisation import Difference, differences
from twin.diagnose.evidence.film_laws import with_film_laws
from twin.diagnose.evidence.nulls import Form
from twin.diagnose.evidence.whiten import measured_of
from twin.diagnose.faults.catalogue import VERSION
from twin.diagnose.faults.channels_check import channels_at_fault, judged_channels, warm_place_note
from twin.diagnose.faults.coarse_model import too_coarse
from twin.diagnose.faults.fault import Family
from twin.diagnose.faults.table import FAMILIES
from twin.diagnose.model.probed_model import ProbedModel, ProbedRun, drive_arrays, make_probed_model
from twin.diagnose.model.study import make_study
from twin.diagnose.model.surrogate import Surrogate
from twin.diagnose.model.time_step import time_step
from twin.diagnose.plan.plan import make_plan
from twin.diagnose.plan.suspicion import known_family, named, pairs_of, suspicions_in, worst_of_machine
from twin.diagnose.report.scene import scene_of
from twin.diagnose.result.diagnosis import Cause, Diagnosis, Series, Unknown
from twin.diagnose.result.place import Scene
from twin.diagnose.search.by_calibration import CALIBRATED, not_named
from twin.diagnose.search.detector import FORM, NULLS, Detector, instruments_of, make_detector, stored
from twin.diagnose.search.dispersion import raised, searched, wrong_temperatures
from twin.diagnose.search.excused import excused
from twin.diagnose.search.gain import predicted
from twin.diagnose.search.limits import limits_of
from twin.diagnose.search.look import Search
from twin.diagnose.search.missing import missing_members
from twin.diagnose.search.policy import POLICY, SearchPolicy
from twin.diagnose.search.poor import poor_note
from twin.diagnose.search.rivals import rival_of
from twin.diagnose.search.sealed_alone import sealed_alone
from twin.diagnose.search.standing import beside_sensors, standing
from twin.diagnose.search.support import support_of
from twin.diagnose.search.verdict import pulls_of, unknown_of, verdict_of
from twin.diagnose.search.witness import upheld
from twin.errors import ArtefactError, LogError
from twin.logs.run import Run
from twin.logs.trace import Trace
from twin.machine.description import Machine
from twin.machine.load import load_machine
from twin.machine.parameters import parameters
from twin.progress import Progress, silent
from twin.rom.artefact import Artefact

LEAST = 24  # means of a sensor over 5 min, and TCP rows


@dataclass(frozen=True)
class Settings:
    """How a diagnosis is made."""

    temperature_sigma: float = 0.1  # K, of one reading
    tcp_sigma: float = 1e-6  # m, where tcp.csv has no sigma
    exclude: tuple[str, ...] = ()  # sensors
    families: tuple[Family, ...] = FAMILIES
    form: int = FORM  # synthetic measurements for model discrepancy
    nulls: int = NULLS  # and for thresholds
    seed: int = 1
    policy: SearchPolicy = POLICY
    plan: str | None = None  # a suspicion to plan the next experiment for; "": what the verdict leaves open


@dataclass(frozen=True)
class Result:
    diagnosis: Diagnosis
    search: Search
    causes: tuple[Cause, ...]  # that belong into the description
    families: tuple[Family, ...] = FAMILIES
    description: str = ""  # with members that it lacked, where there are any


def machine_of(artefact: Artefact, path: Path, machine: Path | None = None) -> Machine:
    """The description inside an artefact, with the meshes of where it was built.

    Raises ArtefactError where the meshes are gone, or others than they were (as `twin verify` does; a calibrated
    artefact has a description of its own, with which its hash cannot be compared).
    """
    origin = Path(machine or artefact.provenance.get("machine", ""))
    if not origin.exists():
        raise ArtefactError(f"its machine description is not at {origin}", str(path), "name it with --machine")
    described = load_machine(origin, artefact.description)
    calibrated = "calibrated_from" in artefact.provenance
    if not calibrated and machine_hash(described) != artefact.provenance.get("machine_hash"):
        raise ArtefactError(
            f"{origin} is not the machine this artefact was built from (description or meshes differ)",
            str(path),
            "build again, or name the right description with --machine",
        )
    return described


def prepare(
    machine: Machine, runs: Sequence[Run], sealed: Sequence[Run], settings: Settings, progress: Progress = silent
) -> tuple[Detector, list[Measured]]:
    """The detector, from the cache where it is there, and the plan of every run; sealed runs enter it by their loads
    only.

    Raises LogError for runs that hold nothing to compare, or too little.
    """
    known = parameters(machine)
    every = [_read(run, settings.exclude) for run in (*runs, *sealed)]
    probed = make_probed_model(machine, known, every, progress)
    if (step := time_step(machine, probed, every)) != probed.runs[0].step:
        probed = make_probed_model(machine, known, every, progress, step=step)
    plans = [measured(probed.base, run, p.drive, p.name) for run, p in zip(every, probed.runs, strict=True)]
    closed = [*plans[: len(runs)], *(_closed(m) for m in plans[len(runs) :])]
    form = Form()
    study = with_film_laws(make_study(probed, closed, range(len(runs))), form)
    if sum(m.n_temperature + len(m.tcp) for m in plans[: len(runs)]) < LEAST:
        raise LogError(
            "too few measurements to diagnose", str(runs[0].folder),
            f"two hours of one sensor of the machine, or {LEAST} TCP rows",
        )  # fmt: skip
    instruments = instruments_of(study, settings.temperature_sigma, settings.tcp_sigma)
    parts = []
    for planned in study.runs:
        m, drive, signals, begins = planned.measured, planned.run.drive, planned.run.signals, planned.run.begins
        parts += [m.mean_of, m.column, np.nan_to_num(m.count), m.tcp_step, m.tcp_share, m.pose, planned.z0,
                  np.array([begins.apart, *(begins.field.spread if begins.field else ())]),
                  np.array(planned.run.unlogged, dtype=int),
                  np.zeros(0) if m.tcp_sigma is None else m.tcp_sigma, *drive_arrays(drive),
                  *(signals[name] for name in sorted(signals))]  # fmt: skip
    # the window's coordinates: made anew on other cores they may be others, and z0 is zero at the reference temperature
    parts += [probed.B, *(body.C for body in probed.base.bodies)]
    asked = tuple((p.run.name, p.measured.from_first, tuple(sorted(p.run.signals))) for p in study.runs)
    names = tuple((f.name, f.number, f.file) for f in settings.families)
    tolerance = tuple((p.path, p.nominal, p.sigma) for p in known)
    counts = settings.form, settings.nulls

    def differ(surrogate: Surrogate) -> tuple[Difference, ...]:
        return differences(machine, study, surrogate, known, every, closed, progress)

    fitted, loads = tuple(study.fitted), arrays_hash(parts)
    inputs = (machine_hash(machine), asked, fitted, loads, instruments, names, tolerance, counts)
    families, policy = settings.families, settings.policy
    detector = cached(
        "detector", make_detector.__module__, inputs,
        lambda: stored(make_detector(study, families, instruments, policy, form, counts, progress, differ)),
    )  # fmt: skip
    return detector.of(study, policy), plans


def _read(run: Run, exclude: Sequence[str]) -> Run:
    """A run without excluded sensors, which say nothing of where it begins either."""
    if run.temperatures is None or not set(exclude) & set(run.temperatures.columns):
        return run
    columns = {name: values for name, values in run.temperatures.columns.items() if name not in exclude}
    return replace(run, temperatures=replace(run.temperatures, columns=columns))


def _closed(m: Measured) -> Measured:
    """The plan of a sealed run without its numbers."""
    return replace(m, temperature=np.full_like(m.temperature, np.nan), tcp=np.full_like(m.tcp, np.nan))


def diagnose(
    artefact: Artefact, machine: Machine, runs: Sequence[Run], sealed: Sequence[Run] = (),
    settings: Settings = Settings(), progress: Progress = silent,
) -> Result:  # fmt: skip
    """The diagnosis of measured runs. Sealed runs are opened last: they measure the gain, and may withdraw a cause.

    Raises LogError and TwinError for runs and descriptions that cannot be used.
    """
    names = run_names([*runs, *sealed])
    fitted = names[: len(runs)]
    sensors = [s for s in artefact.model.sensors if s not in settings.exclude]
    logged = {n for run in runs if run.temperatures is not None for n in run.temperatures.columns}
    judgement = judged_channels(runs, artefact.model, logged - set(settings.exclude))
    if settings.plan:
        known_family(settings.plan, settings.families)  # now, not after minutes

    def sound(judgement: Judgement) -> tuple[list[Run], list[Cause], Detector, list[Measured]]:
        usable, faults = channels_at_fault(runs, judgement, sensors, fitted)
        return usable, faults, *prepare(machine, usable, sealed, settings, progress)

    usable, faults, detector, plans = sound(judgement)
    told, judgement = judgement, upheld(detector, plans, runs, judgement)
    if len(judgement.findings) < len(told.findings):
        usable, faults, detector, plans = sound(judgement)
    asked = named(settings.plan, detector) if settings.plan else []
    y = measured_of(detector.study)
    found, dispersion = searched(detector, y)
    told, judgement = judgement, excused(found, runs, judgement)
    if len(judgement.findings) < len(told.findings):
        usable, faults, detector, plans = sound(judgement)
        y = measured_of(detector.study)
        found, dispersion = searched(detector, y)
    study = detector.study
    detector = raised(detector, dispersion)  # what was searched with in the end
    poor = dispersion.share > settings.policy.dispersed
    found, opened = standing(found, y, settings.families, faults, plans[len(runs) :], settings.seed)
    verdict, beside = verdict_of(found, settings.families)  # of what was seen before any search nothing is counted
    shown = beside_sensors(found, y, settings.families) if verdict == "unknown" else found
    groups = {f.name: f.group for f in settings.families}
    notes = [f"{m.name}: {text}" for m in plans for text in m.skipped]
    notes += [f"{planned.run.name}: {text}" for planned in study.runs for text in _left_open(planned.run)]
    if coarse := too_coarse(artefact.model, study, settings.temperature_sigma, settings.tcp_sigma):
        notes.append(coarse.note)
    verdict, causes, extension = opened.verdict, opened.causes, opened.extension
    warm = [f for f in judgement.warm if not causes or f.channels[0] not in sensors]  # of sensors a search has told
    notes += [warm_place_note(f, sensors) for f in warm]
    notes += [
        f"recalibrate with twin calibrate: {c.parameter}" for c in causes if c.history == CALIBRATED and not c.rivals
    ]
    notes += [text for text in (opened.less, opened.size, not_named(found, causes)) if text]
    if opened.note:  # what is shown is then the calibration beside faulty channels, as of any unknown
        notes.insert(0, opened.note)
        shown, beside = beside_sensors(found, y, settings.families), ()
        verdict = "too_poor" if poor else verdict
    if dispersion.least(settings.policy):
        notes.insert(0, poor_note(shown, plans, usable, settings.temperature_sigma, dispersion))
    gains, described = opened.gains, ""
    only_read = bool(causes) and all(groups.get(c.family) == "reading" for c in causes)
    refused = verdict in ("nothing", "out_of_tolerance") and dispersion.heat  # since the model leaves more than that
    if verdict in ("unknown", "too_poor") or refused or only_read:  # a probe that seems to drift may be on a body
        missing = missing_members(artefact, shown, plans, usable, sealed, settings.seed, progress)
        if missing is not None and wrong_temperatures(found):
            notes.insert(1, f"what would help first: {missing.note}")
        elif missing is not None:
            kept = () if only_read or refused else causes
            verdict, causes, described = "named", (*kept, *missing.causes), missing.description
            gains = (*(g for g in gains if g.unit == "K"), *missing.gains)
            notes.insert(0, missing.note)
    series, traces = _compared(shown, plans, [*runs, *sealed], judgement)
    notes += sealed_alone(series, settings.policy)
    pulls = pulls_of(shown)
    first = found.steps[0]
    of_nulls = {"unknown", *(b.family for b in detector.columns.batches)}  # asked of synthetic measurements
    heat = unknown_of(found) if verdict == "unknown" else None
    planned = None
    if settings.plan is not None:
        pairs = pairs_of(found) if verdict == "ambiguous" and not asked else []
        chosen = asked or suspicions_in([h for pair in pairs for h in pair], detector)
        chosen = chosen or worst_of_machine(detector, settings.families)
        planned = make_plan(detector, machine, usable, chosen, pairs, settings.temperature_sigma, progress)
    diagnosis = Diagnosis(
        machine=machine.machine.name,
        verdict=verdict,
        causes=causes,
        pulls=pulls,
        detection_limits=limits_of(detector),
        unknown=heat,
        gain=gains,
        ranked=tuple(rival_of(h, float(first.cosine[0, i])) for i, h in enumerate(first.ranked)),
        cosine=first.cosine,
        nulls={name: values for name, values in detector.nulls.items() if name in of_nulls},
        thresholds=detector.thresholds,
        observed=first.observed,
        whiteness=_whiteness(series),
        series=series,
        notes=tuple(notes),
        seed=settings.seed,
        catalogue=VERSION,
        provenance={
            "twin": __version__,
            "machine_hash": machine_hash(machine),
            "runs": fitted,
            "sealed": names[len(runs) :],
            "nulls": settings.nulls,
            "window_states": study.probed.base.n,
            "window_error_K": study.probed.reduction[0],
            "window_error_m": study.probed.reduction[1],
        },
        support=support_of(found) if beside and heat is None else None,
        scene=_scene(machine, study.probed, beside or causes, heat),
        plan=planned,
        traces=traces,
        channels=tuple(channel_rows(traces, judgement, fitted)),
    )
    return Result(diagnosis, found, extension, settings.families, described)


def _left_open(run: ProbedRun) -> Iterator[str]:
    """What a run does not say of itself."""
    begins, dt = run.begins, run.step
    if begins.field is not None:
        yield (
            f"it does not state its initial temperature: parts begin where their sensors read first, in the median at "
            f"{begins.temperature:.1f} degC, others where their neighbours and the air would have them, within "
            f"{begins.apart:.2g} K (standard deviation)"
        )
    elif not begins.stated and begins.apart > 0.0:
        yield (
            f"it does not state its initial temperature, and begins at the median of what its sensors read first, "
            f"{begins.temperature:.1f} degC, every part within {begins.apart:.2g} K (standard deviation)"
        )
    if lost := sum(end - first for first, end in run.unlogged):
        yield f"{dt * lost / 3600.0:.2g} h without load data; the heat of the sources is left free there"


def _scene(machine: Machine, probed: ProbedModel, causes: Sequence[Cause], unknown: Unknown | None) -> Scene | None:
    """Where the first cause is, or the heat that nothing explains."""
    if unknown is not None:
        return scene_of(machine, probed, unknown.surface)
    if not causes:
        return None
    settings = causes[0].settings
    return scene_of(machine, probed, causes[0].place, str(settings.get("surface", settings.get("mounted", ""))))


def _lag_1(residual: np.ndarray) -> float:
    """Correlation of a residual (b,) with itself one bin later; NaN of fewer than 4 pairs of bins."""
    there = np.isfinite(residual[1:]) & np.isfinite(residual[:-1])
    a, b = residual[1:][there], residual[:-1][there]
    return float(a @ b / max(float(np.sqrt((a @ a) * (b @ b))), 1e-30)) if len(a) > 3 else np.nan


def _whiteness(series: Sequence[Series]) -> tuple[tuple[str, float, float], ...]:
    """Lag-1 correlation of every channel's residual, recalibrated and extended, in the mean of all fitted runs."""
    found: dict[str, list[tuple[float, float]]] = {}
    for s in (s for s in series if not s.sealed):
        for name, before, after in zip(s.sensors, s.recalibrated.T, s.extended.T, strict=True):
            both = _lag_1(before), _lag_1(after)
            if np.isfinite(both).all():
                found.setdefault(name, []).append(both)
    return tuple((name, *np.mean(both, axis=0).tolist()) for name, both in found.items())


def _compared(
    found: Search, plans: Sequence[Measured], runs: Sequence[Run], judgement: Judgement
) -> tuple[tuple[Series, ...], tuple[Trace, ...]]:
    """The residuals of every run, and every channel beside the extended model: the recalibrated one where there is no
    extension."""
    study = found.detector.study
    series, traces = [], list[Trace]()
    for k, (planned, m, measured_run) in enumerate(zip(study.runs, plans, runs, strict=True)):
        (T0, w0), (T1, w1), (T2, w2) = (planned.split(v) for v in vars(predicted(found, k)).values())
        traces += traces_of_run(m, measured_run, T2, w2)
        run = planned.run
        start, dt = run.drive.time[0], run.drive.time[1] - run.drive.time[0]
        step = np.clip(((m.bin_time - start) / dt).astype(int), 0, run.drive.n_steps - 1)
        series.append(
            Series(
                m.name, m.bin_time - start, m.sensors, m.temperature - T0, m.temperature - T1, m.temperature - T2,
                m.tcp_time - start, m.tcp - w0, m.tcp - w1, m.tcp - w2,
                {s: v[step] for s, v in run.signals.items()}, k not in study.fitted,
            )
        )  # fmt: skip
    return tuple(series), with_findings(traces, judgement, [plans[k].name for k in study.fitted])

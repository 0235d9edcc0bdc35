"""`twin diagnose`: from an artefact and measured runs to a verdict, an extended description and the gain."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from twin import __version__
from twin.build.cache import cached, machine_hash
from twin.calibrate.measured import Measured, measured
from twin.calibrate.problem import run_names
from twin.calibrate.training import states_at
from twin.diagnose.bench import Bench, make_bench
from twin.diagnose.catalogue import FAMILIES, VERSION, Family
from twin.diagnose.channels_check import stuck_sensors
from twin.diagnose.diagnosis import Cause, Diagnosis, Series, Verdict
from twin.diagnose.gain import gains, predicted
from twin.diagnose.nulls import Form
from twin.diagnose.search import search
from twin.diagnose.search_look import Search
from twin.diagnose.study import Study, make_study
from twin.diagnose.verdict import CALIBRATED, limits_of, pulls_of, rival_of, unknown_of, verdict_of
from twin.diagnose.whiten import measured_of
from twin.diagnose.yardstick import FORM, NULLS, Yardstick, instruments_of, make_yardstick
from twin.errors import ArtefactError, LogError
from twin.logs.run import Run
from twin.machine.description import Machine
from twin.machine.load import load_machine
from twin.machine.parameters import parameters
from twin.progress import Progress, silent
from twin.rom.artefact import Artefact

LEAST = 24  # means of a sensor over 5 min, and TCP rows
COARSE = 1.0  # of a sensor's or the probe's noise: the artefact may differ by this (rms) from the rich model


@dataclass(frozen=True)
class Settings:
    """How a diagnosis is made."""

    temperature_sigma: float = 0.1  # K, of one reading
    tcp_sigma: float = 1e-6  # m, where tcp.csv has no sigma
    exclude: tuple[str, ...] = ()  # sensors
    families: tuple[Family, ...] = FAMILIES
    form: int = FORM  # synthetic measurements for errors of form
    nulls: int = NULLS  # and for thresholds
    seed: int = 1


@dataclass(frozen=True)
class Result:
    diagnosis: Diagnosis
    search: Search
    causes: tuple[Cause, ...]  # that belong into the description


def machine_of(artefact: Artefact, path: Path, machine: Path | None = None) -> Machine:
    """The description inside an artefact, with the meshes of where it was built.

    Raises ArtefactError where the meshes are gone.
    """
    origin = Path(machine or artefact.provenance.get("machine", ""))
    if not origin.exists():
        raise ArtefactError(f"its machine description is not at {origin}", str(path), "name it with --machine")
    return load_machine(origin, artefact.description)


def prepare(
    artefact: Artefact, machine: Machine, runs: Sequence[Run], sealed: Sequence[Run], settings: Settings,
    progress: Progress = silent,
) -> tuple[Bench, Study, Yardstick, list[Measured]]:  # fmt: skip
    """Bench, study and yardstick, the dear parts from the cache; sealed runs enter by their loads only.

    Raises LogError for runs that hold nothing to compare, or too little.
    """
    known = parameters(machine)
    every = [*runs, *sealed]
    bench = make_bench(machine, known, every, progress)
    plans = [measured(bench.base, run, own.drive, own.name, exclude=settings.exclude)
             for run, own in zip(every, bench.runs, strict=True)]  # fmt: skip
    closed = [*plans[: len(runs)], *(_closed(m) for m in plans[len(runs) :])]
    study = make_study(bench, closed, range(len(runs)))
    if sum(m.n_temperature + len(m.tcp) for m in plans[: len(runs)]) < LEAST:
        raise LogError(
            "too few measurements to diagnose", str(runs[0].folder),
            f"two hours of one sensor of the machine, or {LEAST} TCP rows",
        )  # fmt: skip
    instruments = instruments_of(study, settings.temperature_sigma, settings.tcp_sigma)
    key = hashlib.sha256()
    for planned in study.runs:
        m = planned.measured
        for part in (m.mean_of, m.column, np.nan_to_num(m.count), m.tcp_step, m.tcp_share, m.pose, planned.z0,
                     np.zeros(0) if m.tcp_sigma is None else m.tcp_sigma, planned.run.drive.power,
                     planned.run.drive.environment, planned.run.drive.theta):  # fmt: skip
            key.update(np.ascontiguousarray(part).tobytes())
    names = tuple((f.name, f.number) for f in settings.families)
    tolerance = tuple((p.path, p.nominal, p.sigma) for p in known)
    yard = cached(
        "yardstick",
        (machine_hash(machine), key.hexdigest(), instruments, names, tolerance, settings.form, settings.nulls, _code()),
        lambda: make_yardstick(
            study, settings.families, instruments, Form(), (settings.form, settings.nulls), progress
        ),
    )
    fitter = replace(yard.fitter, study=study, whiten=replace(yard.whiten, study=study))
    return bench, study, replace(yard, study=study, fitter=fitter), plans


def _closed(m: Measured) -> Measured:
    """The plan of a sealed run without its numbers."""
    return replace(m, temperature=np.full_like(m.temperature, np.nan), tcp=np.full_like(m.tcp, np.nan))


AFTER = (  # modules that only use a yardstick
    "accepted", "acted", "channels", "contest", "damage", "diagnose", "diagnosis", "edges", "edit", "extension", "gain",
    "growth", "hide", "hotter", "refit", "report", "search", "settled", "site", "sizes", "verdict",
)  # fmt: skip


def _code() -> str:
    """Hash of the code that makes yardsticks."""
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*.py")):
        if not path.name.startswith(AFTER):
            digest.update(path.read_bytes())
    return digest.hexdigest()


def diagnose(
    artefact: Artefact,
    machine: Machine,
    runs: Sequence[Run],
    sealed: Sequence[Run] = (),
    settings: Settings = Settings(),
    progress: Progress = silent,
    told: Callable[[str], None] = lambda _: None,
) -> Result:
    """The diagnosis of measured runs. Sealed runs are opened after everything else is decided.

    Raises LogError and TwinError for runs and descriptions that cannot be used.
    """
    names = run_names([*runs, *sealed])
    usable, faults = stuck_sensors(runs, artefact.model.sensors, names[: len(runs)])
    _, study, yard, plans = prepare(artefact, machine, usable, sealed, settings, progress)
    found = search(yard, measured_of(study))
    verdict, causes = verdict_of(found, settings.families)
    shown = found
    if verdict == "unknown" and not causes:  # what is told and judged then is the calibration, not what was tried
        shown = replace(found, accepted=(), x=found.x0)
    notes = [f"{m.name}: {text}" for m in plans for text in m.skipped]
    coarse = _coarse(artefact, study, settings)
    if coarse is not None:
        causes, verdict = (coarse, *causes), "named"
    notes += [f"recalibrate with twin calibrate: {c.parameter}" for c in causes if c.history == CALIBRATED]
    if faults:
        causes = (*faults, *causes)
        verdict = "sensor" if verdict == "nothing" else verdict
    groups = {f.name: f.group for f in settings.families}
    extension = (
        tuple(c for c in causes if groups.get(c.family) == "machine" and c.history != CALIBRATED)
        if verdict in ("named", "out_of_tolerance", "ambiguous", "signal")
        else ()
    )
    extension += tuple(c for c in causes if c.family == "signal" and c.place.startswith("signals."))
    opened = plans[len(runs) :]
    table = tuple(
        g for k, m in enumerate(opened, start=len(runs))
        for g in gains(shown, k, m, settings.seed, _floors(yard, m))
    )  # fmt: skip
    worse = sum(g.ci95[1] < 0.0 for g in table)
    if extension and worse > sum(g.ci95[0] > 0.0 for g in table):
        notes.append(
            f"not written into the description: on the sealed run the extension makes {worse} of {len(table)} channels "
            "worse beyond chance, so the names explain the runs that were looked at and not the machine"
        )
        extension = ()
    first = found.steps[0]
    diagnosis = Diagnosis(
        machine=machine.machine.name,
        verdict=verdict,
        summary=_summary(verdict, causes, shown),
        causes=causes,
        pulls=pulls_of(shown),
        limits=limits_of(yard),
        unknown=unknown_of(found) if verdict == "unknown" else None,
        gain=table,
        ranked=tuple(rival_of(h, float(first.cosine[0, i])) for i, h in enumerate(first.ranked)),
        cosine=first.cosine,
        nulls=yard.nulls,
        thresholds=yard.thresholds,
        observed=first.observed,
        whiteness=_whiteness(shown, plans),
        series=_series(shown, plans, len(runs)),
        notes=tuple(notes),
        seed=settings.seed,
        catalogue=VERSION,
        provenance={
            "twin": __version__,
            "machine_hash": machine_hash(machine),
            "runs": names[: len(runs)],
            "sealed": names[len(runs) :],
            "nulls": settings.nulls,
            "window_states": study.bench.base.n,
            "window_error_K": study.bench.reduction[0],
            "window_error_m": study.bench.reduction[1],
        },
    )
    return Result(diagnosis, found, extension)


def _floors(yard: Yardstick, m: Measured) -> tuple[np.ndarray, np.ndarray]:
    """Noise of a sealed run's sensors (s,) and TCP components (3,): as in the first fitted run."""
    sensors, tcp = yard.whiten.channels[0]
    own = yard.study.runs[0].measured.sensors
    known = dict(zip(own, sensors.sigma, strict=True))
    return np.array([known.get(s, float(np.median(sensors.sigma)) if len(own) else 0.1) for s in m.sensors]), tcp.sigma


def _coarse(artefact: Artefact, study: Study, settings: Settings) -> Cause | None:
    """Family 16: the artefact's own runtime against the bench on these loads, both nominal."""
    model = artefact.model
    worst = 0.0
    if model.n == study.bench.base.n and study.bench.reduction == (0.0, 0.0):
        return None  # a lumped machine with all its states: what is left are the bench's own time steps
    for k in study.fitted:
        planned = study.runs[k]
        if tuple(model.sensors) != tuple(study.bench.base.sensors):
            return None
        one = np.concatenate([b.one for b in model.bodies])
        start = (planned.run.start - model.reference_temperature) * one
        states = states_at(model, (), {}, planned.run.drive, start, 4)
        T = np.full((len(states), len(model.sensors)), model.reference_temperature)
        first = 0
        m = planned.measured
        w = np.zeros((len(m.tcp), 3))
        for body in model.bodies:
            own = states[:, first : first + body.n]
            T[:, list(body.sensors)] += own @ body.C.T
            at = own[m.tcp_step] + m.tcp_share[:, None] * (own[m.tcp_step + 1] - own[m.tcp_step])
            w += np.einsum("kp,pcn,kn->kc", m.pose, body.G, at)
            first += body.n
        w = w - w[0] if m.from_first else w
        here, tcp = planned.split(study.outputs(k, np.zeros(len(study.bench.parameters))))
        error = np.sqrt(np.mean((m.mean_of @ T[:, m.column] - here) ** 2, axis=0)).max(initial=0.0)
        moved = np.sqrt(np.mean((w - tcp) ** 2, axis=0)).max(initial=0.0) if len(w) else 0.0
        worst = max(worst, float(error) / settings.temperature_sigma, float(moved) / settings.tcp_sigma)
    if worst <= COARSE:
        return None
    return Cause(
        "coarse_model", "artefact", "", worst, (worst, worst), "1", worst, COARSE,
        history=f"differs from the rich model by {worst:.1f} times the noise of a reading",
    )  # fmt: skip


def _summary(verdict: Verdict, causes: Sequence[Cause], found: Search) -> tuple[str, ...]:
    from twin.diagnose.report_text import cause_words

    lines = [cause_words(c) for c in causes]
    if verdict == "nothing":
        lines.append("no significant misfit")
    strong = [p.path for p in pulls_of(found) if abs(p.pull) > 3.0]
    if strong:
        lines.append(f"far from their nominal values: {', '.join(strong[:5])}")
    return tuple(lines)


def _whiteness(found: Search, plans: Sequence[Measured]) -> tuple[tuple[str, float, float], ...]:
    """Lag-1 correlation of every channel's residual, recalibrated and extended, over all fitted runs."""
    study = found.yardstick.study
    before: dict[str, list[float]] = {}
    after: dict[str, list[float]] = {}
    for k in study.fitted:
        models = predicted(found, k)
        for table, flat in ((before, models.recalibrated), (after, models.extended)):
            T, _ = study.runs[k].split(flat)
            error = plans[k].temperature - T
            for i, name in enumerate(plans[k].sensors):
                r = error[:, i]
                pair = np.isfinite(r[1:]) & np.isfinite(r[:-1])
                if pair.sum() > 3:
                    a, b = r[1:][pair], r[:-1][pair]
                    table.setdefault(name, []).append(float(a @ b / max(float(np.sqrt((a @ a) * (b @ b))), 1e-30)))
    return tuple((name, float(np.mean(before[name])), float(np.mean(after[name]))) for name in before)


def _series(found: Search, plans: Sequence[Measured], fitted: int) -> tuple[Series, ...]:
    study = found.yardstick.study
    result = []
    for k, (planned, m) in enumerate(zip(study.runs, plans, strict=True)):
        models = [planned.split(v) for v in vars(predicted(found, k)).values()]
        run = planned.run
        start, dt = run.drive.time[0], run.drive.time[1] - run.drive.time[0]
        step = np.clip(((m.bin_time - start) / dt).astype(int), 0, run.drive.n_steps - 1)
        result.append(
            Series(
                run=m.name, time=m.bin_time - start, sensors=m.sensors,
                delivered=m.temperature - models[0][0], recalibrated=m.temperature - models[1][0],
                extended=m.temperature - models[2][0], tcp_time=m.tcp_time - start,
                tcp_delivered=m.tcp - models[0][1], tcp_recalibrated=m.tcp - models[1][1],
                tcp_extended=m.tcp - models[2][1], loads={s: v[step] for s, v in run.signals.items()},
                sealed=k >= fitted, measured=m.temperature, tcp_measured=m.tcp,
            )
        )  # fmt: skip
    return tuple(result)

"""Calibration: a window model, a fit on it, and the check that the artefact's own runtime agrees at what was found.

Where it does not, the trajectories at the fitted values join the window model's basis and the fit goes on from there.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from twin.calibrate.fit.evaluated import floors
from twin.calibrate.fit.fit import Fit, Iteration, Stop, fit
from twin.calibrate.fit.options import Options
from twin.calibrate.fit.problem import FitRun, Problem, problem
from twin.calibrate.fit.training import fields_of, states_at
from twin.errors import TwinError
from twin.logs.run import Run
from twin.progress import Progress, silent
from twin.rom.artefact import Artefact
from twin.rom.parameter import Parameter
from twin.rom.tcp import by_body, tcp_at

AGREE = 0.5  # of an instrument's standard deviation: the window model may differ by this (rms) from the runtime
ROUNDS = 3


@dataclass(frozen=True)
class Agreement:
    """Window model against the artefact's runtime at the fitted values, at all measured places and times."""

    temperature: float  # K, largest rms of a sensor
    displacement: float  # m, largest rms of a component
    enough: bool


@dataclass(frozen=True)
class Calibration:
    fit: Fit
    agreement: Agreement
    rounds: int
    seconds: float


def chosen(
    artefact: Artefact, only: Sequence[str] = (), hold: Sequence[str] = (), tcp: bool = True
) -> tuple[Parameter, ...]:
    """The artefact's parameters that match a pattern of `only` (all by default) and none of `hold`.

    tcp: whether TCP deviations were measured; without them expansions are left out, for nothing tells about them.
    Raises TwinError for patterns that match nothing, and where nothing is left.
    """
    from fnmatch import fnmatchcase

    known = [p.path for p in artefact.parameters]
    for option, patterns in (("--only", only), ("--hold", hold)):
        for pattern in patterns:
            if not any(fnmatchcase(path, pattern) for path in known):
                from twin.nearest import did_you_mean

                raise TwinError(f"'{pattern}' matches no parameter", option, did_you_mean(pattern, known, "parameters"))
    result = tuple(
        p
        for p in artefact.parameters
        if (not only or any(fnmatchcase(p.path, pattern) for pattern in only))
        and not any(fnmatchcase(p.path, pattern) for pattern in hold)
        and (tcp or p.kind != "expansion")
    )
    if not result:
        what = "no parameter is left to fit" if known else "the artefact has no parameters: it is of an older program"
        raise TwinError(what, "--only, --hold", "widen --only" if known else "build it again with `twin build`")
    return result


def calibrate(
    artefact: Artefact,
    runs: Sequence[Run],
    parameters: Sequence[Parameter],
    options: Options = Options(),
    stop: Stop = Stop(),
    report: Callable[[Iteration], None] = lambda _: None,
    progress: Progress = silent,
) -> Calibration:
    """Fit parameters to runs. Iterations and seconds of `stop` count over all rounds; the first window model is made
    in any case.

    Raises LogError for runs that hold nothing to compare, TwinError for parameters that the artefact lacks.
    """
    began = time.perf_counter()
    also: list[dict[str, float]] = []
    earlier: tuple[np.ndarray, ...] = ()
    history: list[Iteration] = []
    start = noise = None
    for k in range(ROUNDS):
        made = problem(artefact, runs, parameters, options, also, earlier, progress)
        left = Stop(stop.iterations - len(history), stop.seconds - (time.perf_counter() - began))
        found = fit(made, left, start, report, known=noise)
        agreement = _agreement(artefact, made, found.x, parameters)
        history += found.history
        if agreement.enough or found.stopped != "minimum" or k == ROUNDS - 1:
            break
        start = found.x
        also.append(made.values(found.x))
        earlier, noise = made.snapshots, found.noise
    found = replace(found, history=tuple(history))
    return Calibration(found, agreement, k + 1, time.perf_counter() - began)


def start_of(artefact: Artefact, made: Problem, run: FitRun, x: np.ndarray) -> np.ndarray:
    """The state (N,) in artefact coordinates in which a run starts at x, corrections of its start included."""
    one = np.concatenate([b.one for b in artefact.model.bodies])
    state = (run.start - artefact.model.reference_temperature) * one
    own = [(s, x[len(made.parameters) + i]) for i, s in enumerate(made.starts) if made.runs[s.run] is run]
    for s, c in own:
        state = state + s.sigma * c * (fields_of(artefact.model, [s])[:, 0] if s.member else one)
    return np.asarray(state)


def _agreement(artefact: Artefact, made: Problem, x: np.ndarray, parameters: Sequence[Parameter]) -> Agreement:
    model, worst_T, worst_w, enough = artefact.model, 0.0, 0.0, True
    for run in made.runs:
        start = start_of(artefact, made, run, x)
        full = states_at(model, parameters, made.values(x), run.drive, start, made.options.substeps)
        error = full - made.states(run, x) @ made.basis.T
        m = run.measured
        T = np.zeros((len(error), len(model.sensors)))
        for body, own in zip(model.bodies, by_body(model, error), strict=True):
            T[:, list(body.sensors)] += own @ body.C.T
        after = np.minimum(m.tcp_step + 1, len(error) - 1)
        at = error[m.tcp_step] + m.tcp_share[:, None] * (error[after] - error[m.tcp_step])
        rows = tcp_at(model, by_body(model, at), m.position)
        of_sensor = np.sqrt(np.mean(T[:, m.column] ** 2, axis=0))
        of_tcp = np.sqrt(np.mean(rows**2, axis=0)) if len(rows) else np.zeros(3)
        sensor, tcp = floors(made, run)
        worst_T, worst_w = max(worst_T, of_sensor.max(initial=0.0)), max(worst_w, of_tcp.max(initial=0.0))
        enough &= bool(np.all(of_sensor <= AGREE * np.maximum(sensor, 0.01)) and np.all(of_tcp <= AGREE * tcp))
    return Agreement(float(worst_T), float(worst_w), enough)


def windows(run: Run, length: float, every: float) -> list[Run]:
    """A run cut into sliding windows [s], each ending where the next measurements of a live machine would begin.

    Loads before a window are kept: the model has to warm up from the run's start, only the measurements are windowed.
    """
    begin, end = float(run.loads.time[0]), float(run.loads.time[-1])
    result = []
    for stop in np.arange(begin + every, end + every / 2, every):
        low, high = stop - length, min(stop, end)
        table, tcp, loads = run.temperatures, run.tcp, run.loads
        past = loads.time <= high
        kept = replace(loads, time=loads.time[past], columns={k: v[past] for k, v in loads.columns.items()})
        if table is not None:
            now = (table.time > low) & (table.time <= high)
            table = replace(table, time=table.time[now], columns={k: v[now] for k, v in table.columns.items()})
        if tcp is not None:
            now = (tcp.time > low) & (tcp.time <= high)
            sigma = None if tcp.sigma is None else tcp.sigma[now]
            tcp = replace(tcp, time=tcp.time[now], position=tcp.position[now], displacement=tcp.displacement[now],
                          sigma=sigma, angle={k: v[now] for k, v in tcp.angle.items()})  # fmt: skip
        result.append(replace(run, loads=kept, temperatures=table, tcp=tcp, segments=()))
    return result

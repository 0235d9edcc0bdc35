"""A model's parameters fitted to measured runs."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from twin.errors import LogError, TwinError
from twin.face.inputs import Quantity, listed, name_of, positive, runs_of
from twin.face.model import Model, read
from twin.progress import Progress, reporter

if TYPE_CHECKING:
    from twin.calibrate.channels.judge import Judgement
    from twin.calibrate.fit.fit import Iteration, Stop
    from twin.calibrate.fit.options import Options
    from twin.logs.run import Run
    from twin.logs.trace import Trace
    from twin.rom.artefact import Artefact
    from twin.rom.parameter import Parameter

Runs = Sequence["Run | str | Path"]


@dataclass(frozen=True)
class CalibrateOptions:
    """How runs are compared, and when the fit stops."""

    iterations: int = 100
    budget: Quantity = "10 min"  # stop after this time
    noise: Quantity = "0.1 K"  # standard deviation of one temperature sample
    tcp_noise: Quantity = "1 um"  # of a TCP deviation, where tcp.csv has no sigma
    initial: Quantity = "0.3 K"  # initial-temperature uncertainty where a run states none
    form: float = 0.03  # share by which the model's response to each source may be wrong
    exclude: Sequence[str] = ()  # sensors to leave out
    window: Quantity | None = None  # fit on sliding windows of this length, through one run
    every: Quantity = "1 h"  # with a window: time between fits

    def fit(self) -> Options:
        """How runs are stepped and compared, in SI."""
        from twin.calibrate.fit.options import Options

        if not math.isfinite(self.form):
            raise TwinError(f"{self.form} is out of range", "--form", "give a share, for example --form 0.03")
        return Options(
            temperature_sigma=positive("noise", self.noise, "K"),
            tcp_sigma=positive("tcp_noise", self.tcp_noise, "m"),
            initial_sigma=positive("initial", self.initial, "K", zero=True),
            form_tolerance=self.form,
            exclude=tuple(self.exclude),
        )

    def stop(self) -> Stop:
        """When the fit ends."""
        from twin.calibrate.fit.fit import Stop

        return Stop(self.iterations, positive("budget", self.budget, "s"))


@dataclass(frozen=True)
class Window:
    """What became of one sliding window."""

    hours: float  # its end
    facts: Mapping[str, Any] | None = None  # None where it holds nothing to compare,
    problem: str = ""  # and why


@dataclass(frozen=True)
class Calibration:
    """Fitted values with intervals, and the model that has them."""

    start: Model  # before the fit
    runs: tuple[str, ...]  # that it was fitted to
    fitted: tuple[Parameter, ...] = field(repr=False)
    facts: dict[str, Any] = field(repr=False)  # what the report beside the artefact holds
    traces: tuple[Trace, ...] = field(repr=False, default=())  # every channel, measured and computed with these values

    @property
    def parameters(self) -> dict[str, float]:
        """The fitted values by path, SI."""
        return {row["path"]: row["value"] for row in self.facts["parameters"]}

    @property
    def sigma(self) -> dict[str, float]:
        """Their standard deviations, SI."""
        return {row["path"]: row["sigma"] for row in self.facts["parameters"]}

    @property
    def stopped(self) -> str:
        """Why the fit ended: "minimum", "iterations", "time" or "interrupted"."""
        return str(self.facts["stopped"])

    @cached_property
    def model(self) -> Model:
        """The model with the fitted values, in memory. Its certificate is still that of the values before."""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "model.h5"
            self._write(path)
            return Model(read(path).artefact)

    def save(self, path: str | Path, machine: str | Path | None = None) -> Model:
        """Write the artefact, its report beside it as JSON, a picture of every channel as PNG (where matplotlib is
        installed), and the edited description to `machine`.

        Raises TwinError where a file cannot be written, or would replace the artefact that the fit started from.
        """
        from twin.atomic import atomic_path
        from twin.calibrate.fit.product import write_report

        refuse_targets(path, machine, self.start.source)
        text = self._write(Path(path))
        write_report(Path(path).with_suffix(".json"), self.facts)
        with suppress(ModuleNotFoundError):  # the edge draws nothing
            from twin.pictures.channels import write_channels

            write_channels(Path(path).with_suffix(".png"), self.traces)
        if machine is not None:
            with atomic_path(Path(machine)) as temporary:
                temporary.write_text(text, encoding="utf-8")
        return read(path)

    def _write(self, path: Path) -> str:
        from twin.calibrate.fit.product import write_calibrated

        command = " ".join(["twin calibrate", self.start.source, *self.runs, "-o", str(path)])
        return write_calibrated(self.start.artefact, path, self.facts, self.fitted, command)


def refuse_targets(path: str | Path, machine: str | Path | None, source: str | Path) -> None:
    """Raises TwinError where an artefact, its report or a description cannot be written, or would replace `source`."""
    from twin.atomic import check_file
    from twin.run.results import refuse_run_folder

    target = Path(path)
    if target.suffix != ".h5":
        raise TwinError("an artefact's name ends with .h5", f"-o {path}", "for example -o out/calibrated.h5")
    if machine is not None:
        if Path(machine).suffix != ".toml":
            raise TwinError("a description's name ends with .toml", f"--machine {machine}", "name another file")
        import twin.machine.edit  # noqa: F401  needs the workstation's packages: say so now, not after the fit
    for written in (target, *map(target.with_suffix, (".json", ".png")), *([Path(machine)] if machine else [])):
        check_file(written)
        refuse_run_folder(written.parent)
        if source and written.exists() and Path(source).exists() and written.samefile(source):
            raise TwinError("would replace the artefact it starts from", str(written), "name another file with -o")


def calibrate(
    model: Model | str | Path,
    runs: Runs | Run | str | Path,
    only: Sequence[str] = (),
    hold: Sequence[str] = (),
    options: CalibrateOptions | None = None,
    progress: Progress | bool | None = None,
    on_iteration: Callable[[Iteration], None] = lambda _: None,
    on_window: Callable[[Window], None] = lambda _: None,
) -> Calibration:
    """Fit the parameters of a model to the temperatures and TCP deviations measured in runs.

    Temperatures are first tested against each other, over all runs: what they refute is not used, and reported in
    `channels` of the report; a leap that the model makes, too, is none. only, hold: parameters to fit and to
    leave as they are, each a path or a pattern such as "sources.*".
    Bounded least squares with priors; an interrupt keeps the best values so far. on_iteration, on_window: told of each
    as it comes. Raises LogError for runs that hold nothing to compare, TwinError for parameters and sensors that there
    are not.

    >>> import twin
    >>> model = twin.build("tests/machines/spindle", options=twin.BuildOptions(held_out=4))
    >>> machine = twin.load("tests/machines/spindle").edited({"sources.motor.gain": 1.2}, "out/warmer.toml")
    >>> truth = twin.simulate(machine, "tests/machines/spindle/runs/warm_up", "out/truth")
    >>> found = twin.calibrate(model, truth, only=["sources.motor.gain"])
    >>> f"{found.parameters['sources.motor.gain']:.1f}"
    '1.2'
    >>> found.save("out/calibrated.h5")
    Model(source='out/calibrated.h5')
    """
    import twin.run.jax_setup  # noqa: F401  isort: skip  first: it prepares JAX before NumPy is loaded

    from twin.calibrate.channels.explained import judge_beside
    from twin.calibrate.channels.filled import filled
    from twin.calibrate.channels.judge import KNOWN, set_aside
    from twin.calibrate.fit.calibration import chosen

    options = options or CalibrateOptions()
    given = listed(runs)
    places = {Path(r).resolve() if isinstance(r, str | Path) else id(r) for r in given}
    if len(places) < len(given):
        raise TwinError("a run is given twice", "RUNS", "give each once: a run is no more evidence when read again")
    settings = options.fit()
    loaded = read(model)
    known = loaded.artefact.model.sensors
    unknown = sorted(set(options.exclude) - set(known))
    if unknown:
        raise TwinError(f"no sensor '{unknown[0]}'", "--exclude", f"sensors are: {', '.join(known)}")
    whole = runs_of(given)
    judgement = judge_beside(loaded.artefact, whole)
    read_runs = set_aside(whole, judgement.findings)
    if judgement.findings:
        read_runs = filled(whole, read_runs, KNOWN)
    steps = [read_runs] if options.window is None else [[run] for run in _windows(read_runs, options)]
    parameters = chosen(loaded.artefact, only, hold, any(run.tcp is not None for run in read_runs))
    fitter = _Fitter(loaded.artefact, parameters, settings, options, reporter(progress), on_iteration, judgement)
    found = fitter.through(steps, whole, on_window)
    if found is None:
        remedy = "give a run with temperatures.csv or tcp.csv"
        raise TwinError("nothing was measured in any window", name_of(given[0]), remedy)
    return Calibration(loaded, tuple(map(name_of, given)), parameters, *found)


def _windows(runs: Sequence[Run], options: CalibrateOptions) -> list[Run]:
    """The only run, cut into sliding windows."""
    from twin.calibrate.fit.calibration import windows

    assert options.window is not None
    if len(runs) != 1:
        raise TwinError("sliding windows go through one run", "--window", "give one RUN")
    length, between = positive("window", options.window, "s"), positive("every", options.every, "s")
    span = float(runs[0].loads.time[-1] - runs[0].loads.time[0])
    if between > span:
        what = f"the run covers {span / 3600:.2f} h only"
        raise TwinError(what, f"--every {options.every}", "give a shorter time")
    return windows(runs[0], length, between)


@dataclass(frozen=True)
class _Fitter:
    artefact: Artefact
    parameters: tuple[Parameter, ...]
    settings: Options
    options: CalibrateOptions
    progress: Progress
    on_iteration: Callable[[Iteration], None]
    judgement: Judgement

    def through(
        self, steps: Sequence[Sequence[Run]], whole: Sequence[Run], on_window: Callable[[Window], None]
    ) -> tuple[dict[str, Any], tuple[Trace, ...]] | None:
        """The report and channels of the last step that holds something to compare; None where none does.

        whole: the runs as logged.
        """
        from twin.calibrate.fit.calibration import calibrate
        from twin.calibrate.fit.product import told
        from twin.calibrate.fit.traces import traces_of

        stop, found = self.options.stop(), None
        for k, these in enumerate(steps):
            hours = float(these[0].loads.time[-1]) / 3600
            try:
                result = calibrate(
                    self.artefact, these, self.parameters, self.settings, stop, self.on_iteration, self.progress
                )
            except LogError as e:  # a window may hold nothing to compare; a run may not
                if self.options.window is None:
                    raise
                on_window(Window(hours, problem=e.problems[0].what))
                continue
            traces = traces_of(result.fit, whole, self.judgement)
            facts = told(result, these, k == len(steps) - 1, self.judgement, traces)
            found = facts, traces
            if self.options.window is not None:
                on_window(Window(hours, facts))
            if result.fit.stopped == "interrupted":
                break
        return found

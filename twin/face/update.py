"""A run in which sparse TCP measurements correct the model online."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from twin.errors import TwinError
from twin.face.inputs import Quantity, listed, name_of, positive, run_of, runs_of
from twin.progress import Progress, reporter

if TYPE_CHECKING:
    from twin.calibrate.update.methods import Options
    from twin.calibrate.update.plan import Plan
    from twin.calibrate.update.program import Live, Program, Updated
    from twin.face.model import Model
    from twin.logs.run import Run

Method = Literal["state", "gain", "paper"]


@dataclass(frozen=True)
class UpdateOptions:
    """How a run is updated."""

    method: Method = "state"  # docs/update.md
    interval: Quantity | None = None  # use a TCP measurement this often; the others are only predicted
    tolerance: Quantity | None = None  # or let a scheduler ask, so that the standard deviation stays below this
    slew: Quantity = "5 um"  # most by which the correction moves in a minute
    tcp_noise: Quantity = "1 um"  # of TCP measurements without a sigma
    noise: Quantity = "0.1 K"  # of a temperature reading
    dt: Quantity = "60 s"

    def plan(self) -> Plan:
        """Which rows of tcp.csv are used. Raises TwinError for options that exclude each other."""
        from twin.calibrate.update.plan import Plan
        from twin.calibrate.update.schedule import Schedule

        if self.interval is not None and self.tolerance is not None:
            raise TwinError("give one of --interval and --tolerance", "--tolerance", "leave one of them away")
        if self.tolerance is not None and self.method == "paper":
            raise TwinError("the method of the paper predicts no uncertainty", "--tolerance", "choose another --method")
        return Plan(
            None if self.interval is None else positive("interval", self.interval, "s"),
            None if self.tolerance is None else Schedule(positive("tolerance", self.tolerance, "m")),
        )

    def settings(self) -> Options:
        """In SI."""
        from twin.calibrate.update.methods import Options

        return Options(
            method=self.method,
            dt=positive("dt", self.dt, "s"),
            slew=positive("slew", self.slew, "m") / 60.0,
            tcp_noise=positive("tcp_noise", self.tcp_noise, "m"),
            sensor_noise=positive("noise", self.noise, "delta_degC"),
        )


@dataclass(frozen=True)
class Update:
    """An updated run: every TCP measurement was predicted before it was used."""

    facts: Mapping[str, Any] = field(repr=False)  # what summary.json holds
    numbers: Updated = field(repr=False)  # as plain arrays
    live: Live[Any] = field(repr=False)  # the state at the end, to go on from
    program: Program[Any] = field(repr=False)
    noise: float = field(repr=False)  # m, of TCP measurements without a sigma

    @property
    def used(self) -> int:
        """TCP measurements that were used."""
        return int(self.facts["used"])

    def rms(self, by: str = "update", part: str = "after_first") -> float:
        """m: length of measured minus predicted TCP error, by "update", "base" or "hold_last"; of rows after the first
        that was used, or of "all"."""
        return float(self.facts["before_assimilating"][part][by]["vector"]["rms"])

    def save(self, folder: str | Path) -> None:
        """Write update.h5, tcp.csv, summary.json and the state. Raises TwinError for run folders."""
        from twin.calibrate.update.files import write_update
        from twin.calibrate.update.live import write_live

        write_update(Path(folder), self.numbers, self.facts, self.noise)
        write_live(Path(folder), self.program, self.live)


def update(
    model: Model | str | Path,
    run: Run | str | Path,
    options: UpdateOptions | None = None,
    earlier: Sequence[Run | str | Path] = (),
    output: str | Path | None = None,
    progress: Progress | bool | None = None,
) -> Update:
    """Replay a run as beside the machine: what is measured corrects what follows. The model stays as it is.

    earlier: runs measured before, from which to learn how far the model may be off where no parameter explains it
    (method "state"). output: folder to write.
    Raises LogError for runs without TCP measurements, TwinError for models without a TCP and options that exclude each
    other.

    >>> import twin
    >>> model = twin.build("tests/machines/spindle", options=twin.BuildOptions(held_out=4))
    >>> machine = twin.load("tests/machines/spindle").edited({"sources.motor.gain": 1.3}, "out/warmer.toml")
    >>> options = twin.SimulateOptions(tcp_every="5 min")
    >>> truth = twin.simulate(machine, "tests/machines/spindle/runs/warm_up", options=options)
    >>> found = twin.update(model, truth, twin.UpdateOptions(method="gain", interval="10 min"))
    >>> found.used
    6
    >>> found.rms() < 0.5 * found.rms("base")
    True
    """
    from twin.calibrate.update.methods import learnt, update_run  # isort: skip  first: it prepares JAX

    from twin import __version__
    from twin.atomic import check_folder
    from twin.calibrate.update.files import summary
    from twin.calibrate.update.tune import tune
    from twin.face.model import read
    from twin.face.still import refuse_still
    from twin.run.results import refuse_run_folder

    options = options or UpdateOptions()
    plan, settings, report = options.plan(), options.settings(), reporter(progress)
    noise = settings.tcp_noise
    before = listed(earlier)
    if before and options.method != "state":
        what = f"the method {options.method} has nothing to learn from earlier runs"
        raise TwinError(what, "--earlier", "leave it away")
    if output is not None:
        check_folder(Path(output))
        refuse_run_folder(Path(output))
    loaded = read(model)
    artefact = loaded.artefact
    refuse_still(artefact.model)
    tuned = tune(artefact, runs_of(before), settings, progress=report) if before else None
    settings = settings if tuned is None else tuned.options
    measured = run_of(run)
    updated, live, program = update_run(artefact, measured, settings, plan, report)
    facts: dict[str, Any] = {
        "machine": loaded.name,
        "artefact": loaded.source,
        "model_sha256": artefact.digest,
        "run": name_of(run),
        "pose_axes": list(artefact.model.pose_axes),
        "unknown_sensors": _unknown_sensors(loaded, measured),
        "rows_left_out": (0 if measured.tcp is None else len(measured.tcp.time))
        - len(updated.row_time)
        - (updated.reference is not None),
        "twin": __version__,
    }
    if tuned is not None:
        facts["discrepancy"] = {"factor": tuned.factor, "log_likelihood": [list(t) for t in tuned.log_likelihood]}
    if options.method == "state":
        facts["parameters"] = learnt(artefact, live)
    found = Update({**facts, **summary(updated, noise)}, updated, live, program, noise)
    if output is not None:
        found.save(output)
    return found


def _unknown_sensors(model: Model, run: Run) -> list[str]:
    """Columns of the run's temperatures that are no sensors of the machine."""
    columns = run.temperatures.columns if run.temperatures is not None else ()
    return sorted(set(columns) - set(model.sensors))

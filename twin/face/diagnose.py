"""What a model gets wrong about measured runs, and what it gains to know."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from twin.errors import TwinError
from twin.face.inputs import Quantity, listed, positive, run_of
from twin.progress import Progress, reporter

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from twin.diagnose.faults.catalogue import Family
    from twin.diagnose.pipeline import Result, Settings
    from twin.diagnose.result.diagnosis import Cause
    from twin.diagnose.result.diagnosis import Diagnosis as Findings
    from twin.face.machine import Machine
    from twin.face.model import Model
    from twin.logs.run import Run
    from twin.machine.description import Machine as Description

Runs = Sequence["Run | str | Path"]


@dataclass(frozen=True)
class DiagnoseOptions:
    """How a diagnosis is made."""

    noise: Quantity = "0.1 K"  # standard deviation of one temperature reading
    tcp_noise: Quantity = "1 um"  # standard deviation of a TCP row, where tcp.csv has no sigma
    exclude: Sequence[str] = ()  # sensors to leave out
    nulls: int = 100  # fault-free simulations that thresholds come from
    catalogue: str | Path | None = None  # Python file with entries of your own (FAMILIES)
    seed: int = 1  # of the bootstrap
    plan: str | None = (
        None  # a suspicion, "FAMILY PLACE", to plan the next experiment for; "": what the verdict does not separate
    )

    def families(self) -> tuple[Family, ...]:
        """The catalogue, with entries of one's own."""
        from twin.diagnose.faults.catalogue import FAMILIES, with_own

        return with_own(Path(self.catalogue)) if self.catalogue else FAMILIES

    def settings(self) -> Settings:
        """In SI."""
        from twin.diagnose.pipeline import Settings

        return Settings(
            positive("noise", self.noise, "K"),
            positive("tcp_noise", self.tcp_noise, "m"),
            tuple(self.exclude),
            self.families(),
            nulls=self.nulls,
            seed=self.seed,
            plan=self.plan,
        )


@dataclass(frozen=True)
class Diagnosis:
    """A verdict, its causes with their evidence, and the gain on sealed runs."""

    model: Model  # that was diagnosed
    runs: tuple[Run, ...] = field(repr=False)  # sealed ones last
    machine: Description = field(repr=False)
    result: Result = field(repr=False)

    @property
    def findings(self) -> Findings:
        """Everything that a report shows (docs/diagnosis_report.md)."""
        return self.result.diagnosis

    @property
    def verdict(self) -> str:
        """ "named", "ambiguous", "unknown", "out_of_tolerance", "sensor", "signal", "nothing" or "too_poor"."""
        return self.findings.verdict

    @property
    def causes(self) -> tuple[Cause, ...]:
        """What is missing or wrong in the description, and channels at fault."""
        return self.findings.causes

    def __str__(self) -> str:
        from twin.diagnose.report.page import summary_lines

        return "\n".join(summary_lines(self.findings))

    def draw(self, sensor: str, run: str = "") -> Figure:
        """Measured minus simulated at a sensor over a run, by default the last one: as delivered, recalibrated, and
        extended by the causes. Raises TwinError for a sensor or a run that there is not."""
        import matplotlib

        from twin.nearest import did_you_mean
        from twin.pictures.style import RC, figure

        runs = {series.run: series for series in self.findings.series}
        run = run or list(runs)[-1]
        if run not in runs:
            raise TwinError(f"no run '{run}'", "run", did_you_mean(run, runs, "runs"))
        series = runs[run]
        if sensor not in series.sensors:
            raise TwinError(f"no sensor '{sensor}'", "sensor", did_you_mean(sensor, series.sensors, "sensors"))
        column = series.sensors.index(sensor)
        with matplotlib.rc_context(RC):
            drawn = figure(8.0, 3.0)
            axes = drawn.subplots()
            for label in ("delivered", "recalibrated", "extended"):
                axes.plot(series.time / 3600.0, getattr(series, label)[:, column], label=label)
            axes.axhline(0.0, color="0.6", linewidth=0.8)
            axes.set(xlabel=f"hours of {run}", ylabel="K", title=f"{sensor}: measured minus simulated")
            axes.legend(frameon=False)
        return drawn

    def report(self, folder: str | Path, build: bool = True, progress: Progress | bool | None = None) -> Report:
        """Write index.html and report.json, and, where a cause belongs into the description, machine.toml with the
        cause added and extended.h5 built from it. Files of an earlier diagnosis in the folder are replaced.

        Raises TwinError where the folder holds what is read, or files of others.
        """
        from twin.diagnose.extend import build_extension, write_extension

        target = Path(folder)
        _refuse(target, self.model, self.machine, self.runs)
        findings, said = write_extension(self.result, self.model.artefact, self.machine, self.runs, target)
        report = Report(target, findings, tuple(said))
        if report.files and build:
            build_extension(target, reporter(progress))
        return report


@dataclass(frozen=True)
class Report:
    """What a diagnosis left in a folder."""

    folder: Path
    findings: Findings = field(repr=False)  # with the parameters that its causes have in the new description
    said: tuple[str, ...]  # what was done, in words

    @property
    def files(self) -> list[str]:
        """Beside index.html and report.json."""
        return list(self.findings.provenance["files"])

    @property
    def machine(self) -> Machine:
        """The extended machine. Raises DescriptionError where there is none."""
        from twin.diagnose.extend import DESCRIPTION
        from twin.face.machine import load

        return load(self.folder / DESCRIPTION)

    @property
    def model(self) -> Model:
        """The extended model. Raises ArtefactError where there is none."""
        from twin.diagnose.extend import ARTEFACT
        from twin.face.model import read

        return read(self.folder / ARTEFACT)

    def __str__(self) -> str:
        from twin.diagnose.report.page import summary_lines
        from twin.diagnose.report.plan import plan_lines

        planned = plan_lines(self.findings.plan) if self.findings.plan else []
        return "\n".join([*summary_lines(self.findings), *planned, *self.said])


def diagnose(
    model: Model | str | Path,
    runs: Runs | Run | str | Path,
    sealed: Runs = (),
    machine: Machine | str | Path | None = None,
    options: DiagnoseOptions | None = None,
    report: str | Path | None = None,
    progress: Progress | bool | None = None,
) -> Diagnosis:
    """Find why a model differs from measured runs, name the cause, and measure the gain.

    sealed: validation runs, never fitted to and opened last: they measure the gain, and may withdraw a cause. machine:
    the description with its meshes, where it has moved since the build. report: folder that `Diagnosis.report` will
    write to; it is checked before hours are spent.
    Raises LogError and TwinError for runs and descriptions that cannot be used.

    >>> import twin
    >>> model = twin.build("tests/diagnose/four_nodes")
    >>> truth = twin.hide("tests/diagnose/four_nodes", "heat_source", "column", "60 W", "out/hidden")
    >>> options = twin.SimulateOptions(noise="0.1 K", tcp_noise="1 um")
    >>> monday = twin.simulate(truth, "tests/diagnose/four_nodes/runs/monday", "out/monday", options)
    >>> found = twin.diagnose(model, monday, options=twin.DiagnoseOptions(nulls=20))
    >>> found.verdict, found.causes[0].family, found.causes[0].place
    ('named', 'heat_source', 'column')
    """
    import twin.run.jax_setup  # noqa: F401  isort: skip  first: it prepares JAX before NumPy is loaded

    from twin.diagnose.pipeline import diagnose as search
    from twin.diagnose.pipeline import machine_of
    from twin.face.machine import Machine
    from twin.face.model import read

    looked_at = listed(runs)
    every = [*looked_at, *listed(sealed)]
    places = {Path(r).resolve() if isinstance(r, str | Path) else id(r) for r in every}
    if len(places) < len(every):
        raise TwinError("a run is given twice", "RUNS, --sealed", "the gain cannot be measured on a diagnosed run")
    options = options or DiagnoseOptions()
    if report is not None:
        _refuse_folder(Path(report))
    loaded = read(model)
    known = loaded.artefact.model.sensors
    unknown = sorted(set(options.exclude) - set(known))
    if unknown:
        raise TwinError(f"no sensor '{unknown[0]}'", "--exclude", f"sensors are: {', '.join(known)}")
    settings = options.settings()
    origin = machine.path if isinstance(machine, Machine) else machine
    described = machine_of(loaded.artefact, Path(loaded.source), None if origin is None else Path(origin))
    read_runs = tuple(_named(one) for one in every)
    if report is not None:
        _refuse(Path(report), loaded, described, read_runs)
    n = len(looked_at)
    found = search(loaded.artefact, described, read_runs[:n], read_runs[n:], settings, reporter(progress))
    return Diagnosis(loaded, read_runs, described, found)


def explained(family: str, options: DiagnoseOptions | None = None) -> str:
    """An entry of the catalogue in words, or all of them ("all"). Raises TwinError for an unknown one."""
    from twin.diagnose.faults.catalogue import explained as words
    from twin.diagnose.faults.catalogue import family as entry

    families = (options or DiagnoseOptions()).families()
    chosen = families if family == "all" else (entry(family, families),)
    return "\n\n".join(words(one) for one in chosen)


def _named(given: Run | str | Path) -> Run:
    """A run that was read has the absolute path of its folder: "." has a name, too."""
    run = run_of(given)
    return replace(run, folder=run.folder.resolve()) if isinstance(given, str | Path) else run


def _refuse_folder(folder: Path) -> None:
    from twin.atomic import check_folder
    from twin.run.results import refuse_run_folder

    check_folder(folder)
    refuse_run_folder(folder)


def _refuse(folder: Path, model: Model, machine: Description, runs: Sequence[Run]) -> None:
    """Raises TwinError where the folder is no place for a report."""
    from twin.diagnose.extend import refuse_target

    _refuse_folder(folder)
    refuse_target(folder, Path(model.source) if model.source else machine.folder, machine, runs)

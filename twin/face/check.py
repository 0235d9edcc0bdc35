"""Everything that is wrong with a description or a run folder, before hours are spent on it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from twin.errors import LogError, Problem, TwinError
from twin.face.machine import Machine

if TYPE_CHECKING:
    from twin.logs.sampling_rule import Needed
    from twin.machine.description import Machine as Description
    from twin.rom.load_model import Signal


@dataclass(frozen=True)
class Expected:
    """What a machine wants of its runs."""

    machine: str
    signals: tuple[Signal, ...]
    axes: tuple[str, ...]  # linear
    sensors: tuple[str, ...]
    core: Needed | None = None  # the sampling that the axes' limits ask for, where they are known
    strokes: Mapping[str, tuple[float, float]] = field(default_factory=dict)  # m, of the linear axes


@dataclass(frozen=True)
class Findings:
    """What is wrong, and what there is."""

    kind: str  # "machine" or "run"
    path: Path
    problems: tuple[Problem, ...]
    facts: Mapping[str, object]

    @property
    def errors(self) -> int:
        return sum(not p.warning for p in self.problems)

    @property
    def ok(self) -> bool:
        """Whether there are no errors; warnings may be."""
        return self.errors == 0

    def __str__(self) -> str:
        lines = [str(p) for p in self.problems]
        facts = ", ".join(f"{v} {k}" if not isinstance(v, str) else f"{k} {v}" for k, v in self.facts.items())
        warnings = len(self.problems) - self.errors
        verdict = "no problems found"
        if self.problems:
            verdict = f"{_count(self.errors, 'error')}, {_count(warnings, 'warning')}"
        lines.append(f"{self.kind} {self.path}: {verdict}" + (f" ({facts})" if facts else ""))
        return "\n".join(lines)

    def to_json(self) -> dict[str, Any]:
        """The same as JSON values."""
        return {
            "kind": self.kind,
            "path": str(self.path),
            "ok": self.ok,
            "facts": dict(self.facts),
            "problems": [
                {"what": p.what, "where": p.where, "remedy": p.remedy, "warning": p.warning} for p in self.problems
            ],
        }


def check(path: Machine | str | Path, machine: Machine | str | Path | None = None, meshes: bool = True) -> Findings:
    """Find mistakes in a machine.toml, the folder it lies in, or a run folder; all at once, none is raised.

    machine: description or artefact to check a run against; else the machine that its run.toml names, else the
    machine.toml two folders up (models/NAME/runs/RUN). meshes: whether those of a description are read too.
    Raises TwinError where the path is neither.

    >>> import twin
    >>> findings = twin.check("tests/machines/spindle/runs/warm_up")
    >>> findings.ok
    True
    >>> print(findings)
    run tests/machines/spindle/runs/warm_up: no problems found (361 rows, 1.0 hours, 6 columns, machine spindle)
    """
    if isinstance(path, Machine):
        return _check_machine(path.path, meshes)
    path = Path(path)
    if isinstance(machine, Machine):
        machine = machine.path
    if _is_run(path):
        return _check_run(path, None if machine is None else Path(machine))
    return _check_machine(path, meshes)


def _is_run(path: Path) -> bool:
    if not path.exists():
        raise TwinError("no such file or folder", str(path), "give a machine.toml, its folder, or a run folder")
    if path.is_file() or (path / "machine.toml").exists():
        return False
    if any((path / name).exists() for name in ("run.toml", "loads.csv")):
        return True
    raise TwinError(
        "neither a machine nor a run",
        str(path),
        "a machine folder holds machine.toml, a run folder run.toml and loads.csv",
    )


def _check_machine(path: Path, meshes: bool) -> Findings:
    from twin.machine.check import check_machine
    from twin.machine.load import load_machine, located

    try:
        machine = load_machine(path)
    except TwinError as e:
        return Findings("machine", path, e.problems, {})
    facts: dict[str, object] = {"name": machine.machine.name}
    if machine.lumped:
        facts |= {"nodes": len(machine.nodes), "bars": len(machine.bars), "signals": len(machine.signals)}
    else:
        facts |= {"parts": len(machine.parts), "signals": len(machine.signals)}
    problems = check_machine(machine)
    if meshes:
        from twin.build.check_meshes import check_meshes

        report = check_meshes(machine)
        problems += report.problems
        facts["bodies"] = report.bodies
        if machine.lumped:
            facts |= {"states": report.nodes, "kJ/K": round(report.capacity / 1e3, 3)}
        else:
            facts |= {"nodes": report.nodes, "kg": round(report.mass, 1)}
    return Findings("machine", path, tuple(located(path, problems)), facts)


def _check_run(path: Path, machine: Path | None) -> Findings:
    from twin.logs.check import check_run
    from twin.logs.read import parse_run

    try:
        run = parse_run(path)
    except LogError as e:
        return Findings("run", path, e.problems, {})
    time = run.loads.time
    facts: dict[str, object] = {
        "rows": len(time),
        "hours": round(float(time[-1] - time[0]) / 3600, 3),
        "columns": len(run.loads.columns),
    }
    try:
        wanted = expected(path, run.machine, machine)
    except TwinError as e:
        return Findings("run", path, (*e.problems, *check_run(run)), facts)
    if wanted is None:
        what = "no machine is known, so its signals were not looked for"
        remedy = "name it: twin check RUN --machine models/NAME, or --machine A.h5"
        return Findings("run", path, (Problem(what, str(path), remedy, warning=True), *check_run(run)), facts)
    facts["machine"] = wanted.machine
    found = check_run(run, wanted.signals, wanted.axes, wanted.sensors, wanted.core, wanted.strokes)
    return Findings("run", path, tuple(found), facts)


def expected(run: Path, named: str | None, given: Path | None) -> Expected | None:
    """What the machine of a run wants: the given one, else the one that the run names, else the one beside it."""
    if given is not None:
        return _of_artefact(given) if given.suffix == ".h5" else _of_description(given)
    if named is not None:
        return _of_description(run / named)
    beside = run.resolve().parent.parent / "machine.toml"
    if not beside.exists():
        return None
    try:
        return _of_description(beside)
    except ModuleNotFoundError:  # an edge computer reads no descriptions, and was not asked to
        return None


def _of_description(path: Path) -> Expected:
    from twin.machine.kinematics import linear_axes
    from twin.machine.load import load_machine
    from twin.machine.wiring import signal

    machine = load_machine(path)
    signals = tuple(signal(name, entry) for name, entry in machine.signals.items())
    axes = linear_axes(machine)
    strokes = {a: machine.axes[a].stroke for a in axes}
    core = _core_sampling(machine, axes)
    return Expected(machine.machine.name, signals, axes, tuple(machine.sensors), core, strokes)


def _core_sampling(machine: Description, axes: tuple[str, ...]) -> Needed | None:
    """By Table 16.1 of paper 001. Meshes of rails are read only for axes whose speed limit is given."""
    from twin.logs.sampling_rule import AxisLimits, core_sampling

    limits = []
    for name in axes:
        axis, segment = machine.axes[name], None
        if axis.speed is not None and not machine.lumped:
            from twin.build.rail_segments import shortest_segment

            segment = shortest_segment(machine, name)
        limits.append(AxisLimits(name, axis.speed, axis.acceleration, axis.jerk, segment))
    return core_sampling(limits)


def _of_artefact(path: Path) -> Expected:
    from twin.rom.artefact import read_artefact

    model = read_artefact(path).model
    axes = tuple(axis.name for axis in model.load_model.axes)
    sensors = model.all_sensors
    strokes = {axis.name: (axis.low, axis.high) for axis in model.load_model.axes}
    return Expected(model.name, model.load_model.signals, axes, sensors, strokes=strokes)


def _count(n: int, what: str) -> str:
    return f"{n} {what}" + ("" if n == 1 else "s")

"""`twin check`: everything that is wrong with a description or a run folder, before hours are spent on it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import click

from twin.errors import LogError, Problem, TwinError

if TYPE_CHECKING:
    from twin.logs.sampling_rule import Needed
    from twin.machine.description import Machine
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


@dataclass
class Findings:
    """What is printed at the end."""

    kind: str  # "machine" or "run"
    path: Path
    problems: list[Problem] = field(default_factory=list)
    facts: dict[str, object] = field(default_factory=dict)

    @property
    def errors(self) -> int:
        return sum(not p.warning for p in self.problems)


@click.command(epilog="Example: twin check models/five_axis/runs/experiment_a")
@click.argument("path", required=False, type=click.Path(path_type=Path))
@click.option(
    "--machine",
    "machine_path",
    type=click.Path(path_type=Path),
    help="Description or artefact to check a run against.",
)
@click.option("--no-meshes", is_flag=True, help="Check the description only.")
@click.option("--json", "as_json", is_flag=True, help="Print the findings as JSON.")
@click.option("--schema", is_flag=True, help="Print the JSON schema of machine.toml for editors, and end.")
def command(path: Path | None, machine_path: Path | None, no_meshes: bool, as_json: bool, schema: bool) -> int:
    """Find mistakes in PATH: a machine.toml, the folder it lies in, or a run folder.

    All mistakes are shown at once, with file, key and remedy. Exit status 2 if there are errors, 0 if only warnings.
    A run is checked against the signals of --machine, else of the machine that its run.toml names, else of the
    machine.toml two folders up (models/NAME/runs/RUN).
    """
    if schema:
        from twin.machine.load import json_schema

        click.echo(json.dumps(json_schema(), indent=1))
        return 0
    if path is None:
        raise click.UsageError("give the PATH of a machine.toml, its folder, or a run folder")
    findings = _check_run(path, machine_path) if _is_run(path) else _check_machine(path, not no_meshes)
    click.echo(_as_json(findings) if as_json else _as_text(findings))
    return 2 if findings.errors else 0


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
    from twin.machine.load import load_machine

    findings = Findings("machine", path)
    try:
        machine = load_machine(path)
    except TwinError as e:
        findings.problems += e.problems
        return findings
    findings.facts = {"name": machine.machine.name}
    if machine.lumped:
        findings.facts |= {"nodes": len(machine.nodes), "bars": len(machine.bars), "signals": len(machine.signals)}
    else:
        findings.facts |= {"parts": len(machine.parts), "signals": len(machine.signals)}
    findings.problems += check_machine(machine)
    if meshes:
        from twin.build.check_meshes import check_meshes

        report = check_meshes(machine)
        findings.problems += report.problems
        findings.facts["bodies"] = report.bodies
        if machine.lumped:
            findings.facts |= {"states": report.nodes, "kJ/K": round(report.capacity / 1e3, 3)}
        else:
            findings.facts |= {"nodes": report.nodes, "kg": round(report.mass, 1)}
    return findings


def _check_run(path: Path, machine_path: Path | None) -> Findings:
    from twin.logs.check import check_run
    from twin.logs.read import parse_run

    findings = Findings("run", path)
    try:
        run = parse_run(path)
    except LogError as e:
        findings.problems += e.problems
        return findings
    time = run.loads.time
    findings.facts = {
        "rows": len(time),
        "hours": round(float(time[-1] - time[0]) / 3600, 3),
        "columns": len(run.loads.columns),
    }
    try:
        expected = _expected(path, run.machine, machine_path)
    except TwinError as e:
        findings.problems += [*e.problems, *check_run(run)]
        return findings
    if expected is None:
        what = "no machine is known, so its signals were not looked for"
        remedy = "name it: twin check RUN --machine models/NAME, or --machine A.h5"
        findings.problems += [Problem(what, str(path), remedy, warning=True), *check_run(run)]
        return findings
    findings.facts["machine"] = expected.machine
    findings.problems += check_run(
        run, expected.signals, expected.axes, expected.sensors, expected.core, expected.strokes
    )
    return findings


def _expected(run: Path, named: str | None, given: Path | None) -> Expected | None:
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


def _core_sampling(machine: Machine, axes: tuple[str, ...]) -> Needed | None:
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
    sensors = (*model.sensors, *(name for name, _ in model.ambient_sensors))
    strokes = {axis.name: (axis.low, axis.high) for axis in model.load_model.axes}
    return Expected(model.name, model.load_model.signals, axes, sensors, strokes=strokes)


def _as_text(findings: Findings) -> str:
    lines = [str(p) for p in findings.problems]
    facts = ", ".join(f"{v} {k}" if not isinstance(v, str) else f"{k} {v}" for k, v in findings.facts.items())
    warnings = len(findings.problems) - findings.errors
    verdict = (
        f"{_count(findings.errors, 'error')}, {_count(warnings, 'warning')}"
        if findings.problems
        else "no problems found"
    )
    lines.append(f"{findings.kind} {findings.path}: {verdict}" + (f" ({facts})" if facts else ""))
    return "\n".join(lines)


def _count(n: int, what: str) -> str:
    return f"{n} {what}" + ("" if n == 1 else "s")


def _as_json(findings: Findings) -> str:
    return json.dumps(
        {
            "kind": findings.kind,
            "path": str(findings.path),
            "ok": findings.errors == 0,
            "facts": findings.facts,
            "problems": [
                {"what": p.what, "where": p.where, "remedy": p.remedy, "warning": p.warning} for p in findings.problems
            ],
        },
        indent=1,
    )

"""What a diagnosis leaves: its report, the description with causes and refitted values in it, its artefact, its runs.

The folder is always that of its newest report: report.json lists the files beside it, and the next diagnosis removes
these and no others.
"""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from twin.build.product import build_artefact
from twin.calibrate.fit.problem import run_names
from twin.diagnose.pipeline import Result
from twin.diagnose.report.page import write_report
from twin.diagnose.result.diagnosis import Diagnosis, Window
from twin.errors import TwinError
from twin.logs.run import Run
from twin.logs.write import write_run
from twin.machine.copy import with_files
from twin.machine.description import Machine
from twin.machine.edit import edited
from twin.machine.effects.edits import extended_description, loads_with
from twin.progress import Progress, silent
from twin.rom.artefact import Artefact

MOVED = 0.1  # prior standard deviations that a parameter must have moved by to be written
PAGE, REPORT, DESCRIPTION, ARTEFACT = "index.html", "report.json", "machine.toml", "extended.h5"


def refuse_target(target: Path, artefact: Path, machine: Machine, runs: Sequence[Run]) -> None:
    """Raises TwinError where `target` is no place for a diagnosis: it holds what is read, or files of others."""
    folder = target.resolve()
    for path in (artefact, machine.folder, *(run.folder for run in runs)):
        if folder == path.resolve() or folder in path.resolve().parents:
            raise TwinError("holds what is read", str(target), "choose another folder with -o")
    former = former_files(target)
    names = [f"runs/{name}" for name in run_names(runs)]
    names += [DESCRIPTION, ARTEFACT, *(p.name for p in machine.folder.glob("*.py"))]
    meshes = [Path(p.mesh) for p in machine.parts.values() if p.mesh is not None]
    names += [str(m) for m in meshes if not m.is_absolute() and ".." not in m.parts]  # others are not copied
    if former is None:
        names += [PAGE, REPORT]
    for name in names:
        if (target / name).exists() and not any(f"{f}/".startswith(f"{name}/") for f in former or ()):
            raise TwinError(f"holds another {name}", str(target), "choose another folder with -o")


def former_files(target: Path) -> list[str] | None:
    """What stands beside the report of a former diagnosis in a folder, None where there is no such report."""
    try:
        facts = json.loads((target / REPORT).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    provenance = facts.get("provenance") if isinstance(facts, dict) and "verdict" in facts else None
    if not isinstance(provenance, dict):
        return None
    files = provenance.get("files", [DESCRIPTION, ARTEFACT])  # reports did not list them at first
    within = target.resolve()
    return [str(f) for f in files if (target / str(f)).resolve().is_relative_to(within)]


def _remove(target: Path, files: Sequence[str]) -> None:
    """Remove files of `target`, and folders that are empty then."""
    for path in (target / f for f in files):
        if path.is_file():
            path.unlink()
        for folder in list(path.parents)[: len(path.relative_to(target).parts) - 1]:
            with suppress(OSError):  # not empty
                folder.rmdir()


def write_extension(
    result: Result, artefact: Artefact, machine: Machine, runs: Sequence[Run], target: Path
) -> tuple[Diagnosis, list[str]]:
    """Write the report into `target`, and machine.toml and the loads of added switches where there is a cause to add.
    `build_extension` adds extended.h5, which is listed already. What a former diagnosis left there goes.

    Returns the diagnosis with the parameters that its causes have there, and what was done, in words. A cause that the
    description cannot say is told, not raised.
    """
    target.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".diagnosis-", dir=target) as staged:
        new = Path(staged)
        parameters, said = _write_description(result, artefact, machine, runs, new, target)
        files = sorted(p.relative_to(new).as_posix() for p in new.rglob("*") if p.is_file())
        listed = [*files, ARTEFACT] if files else []
        causes = tuple(
            replace(c, parameter=parameters.get((c.family, c.place), c.parameter)) for c in result.diagnosis.causes
        )
        provenance = {**result.diagnosis.provenance, "files": listed}
        diagnosis = replace(result.diagnosis, causes=causes, provenance=provenance)
        former = former_files(target) or []
        write_report(diagnosis, target)
        _remove(target, former)
        for name in files:
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            os.replace(new / name, target / name)
    return diagnosis, said


def build_extension(target: Path, progress: Progress = silent) -> str:
    """Build the artefact of an extended description, and say so."""
    build_artefact(target / DESCRIPTION, target / ARTEFACT, progress=progress)
    return f"extended artefact: {target / ARTEFACT}; check it with twin verify"


def _write_description(
    result: Result, artefact: Artefact, machine: Machine, runs: Sequence[Run], new: Path, target: Path
) -> tuple[dict[tuple[str, str], str], list[str]]:
    """Write the description and what goes with it into the folder `new`, which becomes part of `target`.

    Returns the parameter of each cause (family, place) that is in it, and what was done, in words.
    """
    diagnosis = result.diagnosis
    parameters: dict[tuple[str, str], str] = {}
    if result.description:
        (new / DESCRIPTION).write_text(with_files(result.description, machine, new), encoding="utf-8")
        return parameters, [f"description with the missing members: {target / DESCRIPTION}"]
    if not result.causes:
        told = [n for n in diagnosis.notes if n.startswith(("withdrawn", "not written"))] or ["no extension is written"]
        return parameters, told
    study, entries = result.search.detector.study, {f.name: f for f in result.families}
    said: list[str] = []
    text = artefact.description
    signals: dict[str, Sequence[Window]] = {}
    values = {p.path: p.value for p in diagnosis.pulls if abs(p.pull) > MOVED and not p.freed}  # causes write those
    notes = {p.path: f"calibrated: was {p.nominal:.6g} {p.unit}" for p in diagnosis.pulls if p.path in values}
    text = edited(text, values, notes)
    for cause in result.causes:
        try:
            edit = extended_description(text, [entries[cause.family].edit(cause, study)])
        except TwinError as e:
            said.append(f"not in the description: {cause.family} at {cause.place}: {e.problems[0].what}")
            continue
        text = edit.text
        signals |= edit.signals
        parameters[cause.family, cause.place] = edit.parameters[0]
        said += entries[cause.family].told_of_edit(cause)
    if not parameters:
        return parameters, said
    (new / DESCRIPTION).write_text(with_files(text, machine, new), encoding="utf-8")
    said.append(f"description with the cause: {target / DESCRIPTION}")
    for run, name in zip(runs, run_names(runs), strict=True) if signals else ():
        write_run(new / "runs" / name, replace(loads_with(run, signals, name), machine=None))
        said.append(f"loads with {', '.join(signals)}: {target / 'runs' / name}")
    return parameters, said

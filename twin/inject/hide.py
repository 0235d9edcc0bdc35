"""A machine or a log with something in it that its description does not know, written anew beside the original.

What is hidden in a machine becomes text by `twin.machine.effects`; faults of logs are those of `twin.inject.damage`.
Most have the form that a diagnosis searches, some have not, such as loads logged as means: docs/hiding.md says it
family by family. Beside the copy lies hidden.json: what was hidden.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from twin.atomic import atomic_folder, check_folder
from twin.build.mesh import load_part_mesh
from twin.errors import DescriptionError, LogError, TwinError
from twin.inject.damage.kinds import DAMAGES, damaged, kind_of
from twin.inject.request import FOLLOWING, Request, When, damage_of, effect_of
from twin.logs.read import read_run
from twin.logs.run import Run
from twin.logs.write import write_run
from twin.machine.copy import with_files
from twin.machine.description import Machine
from twin.machine.effects.edits import EDITS, extended_description, loads_with
from twin.machine.effects.effect import Window
from twin.machine.instances import written_out
from twin.machine.load import load_machine
from twin.nearest import did_you_mean

FACTS = "hidden.json"


def hide(
    target: Path | str, family: str, place: str, size: str, out: Path | str, when: When = When(),
    settings: Mapping[str, str] = {}, runs: Sequence[Path | str] = (),
) -> list[str]:  # fmt: skip
    """Write a copy of a machine, or of a run folder, with something hidden in it, and tell what was done.

    target: folder or machine.toml of a machine, or a run folder; it stays as it is. family, place, size: what is
    hidden, where, and how large, with its unit ("10 W"), as docs/hiding.md lists them. out: folder of the copy, written
    whole or not at all. when: kind, signal and times, by default always. settings: what a family needs besides, with
    units ({"temperature": "15 degC"}). runs: run folders that get the switch of a machine's hidden history, copied to
    out/runs.

        hide("models/five_axis", "heat_source", "bed.x_motor", "10 W", "out/hidden", When(start=14400.0))

    Raises TwinError for unknown families, places and signals, units of another dimension, and folders in use.
    """
    asked = Request(family, place, size, when, settings)
    source, copy, logs = Path(target), Path(out), [Path(run) for run in runs]
    _refuse_to_destroy(copy, [source, *logs])
    if family == "coarse_model":
        remedy = "build the artefact itself with few states: twin build MACHINE -o A.h5 --states 20"
        raise TwinError("is a property of an artefact, not of a machine or a log", family, remedy)
    if family not in EDITS:
        raise TwinError(f"unknown family '{family}'", "FAMILY", did_you_mean(family, EDITS, "families"))
    if when.exponent != 1.0 and not (when.signal and family in FOLLOWING):
        remedy = f"leave it out; with --signal it is for {', '.join(FOLLOWING)}"
        raise TwinError("there is nothing that it is the exponent of", "--exponent", remedy)
    is_run = (source / "run.toml").exists()
    if family in DAMAGES:
        if not is_run:
            remedy = "give a run folder; `twin simulate MACHINE RUN` writes one with everything"
            raise LogError(f"'{family}' is a fault of a log, and this is no run folder", str(source), remedy)
        if logs:
            raise TwinError("is for machines", "--run", "give the run folder in place of the machine")
        return _hide_in_log(asked, source, copy)
    if is_run:
        what = f"'{family}' changes a machine, and this is a run folder"
        raise DescriptionError(what, str(source), "give the machine, and the run with --run")
    return _hide_in_machine(asked, source, copy, logs)


def _hide_in_machine(asked: Request, target: Path, out: Path, runs: Sequence[Path]) -> list[str]:
    path = target / "machine.toml" if target.is_dir() else target
    machine = load_machine(path)
    text = written_out(path.read_bytes().decode("utf-8-sig"))
    logs = {folder: read_run(folder) for folder in runs}
    effect = effect_of(asked, machine, list(logs.values()))
    for place in (*effect.place.split("<>"), str(effect.settings.get("surface", ""))):
        _expect_surface(machine, place)
    edit = extended_description(text, [effect], "hidden")
    with atomic_folder(out) as new:
        text = with_files(edit.text, machine, new, "hidden")
        load_machine(path, text)
        (new / "machine.toml").write_text(text, encoding="utf-8", newline="")
        for folder, log in logs.items():
            switched = replace(loads_with(log, edit.signals), machine=log.machine and "../../machine.toml")
            write_run(new / "runs" / folder.resolve().name, switched)
        _write_facts(new, asked, effect.amplitude, effect.unit, effect.windows)
    told = [f"{out}: '{machine.machine.name}' with {asked.family} at {asked.place}, {asked.size}"]
    told += [f"{out / 'runs' / folder.resolve().name}: its loads, with {', '.join(edit.signals)}" for folder in logs]
    if edit.signals and not logs:
        told.append(
            f"without a column {', '.join(edit.signals)} [1] in loads.csv it stays off: --run writes such copies"
        )
    return told


def _hide_in_log(asked: Request, target: Path, out: Path) -> list[str]:
    run = read_run(target)
    kind = kind_of(asked.family, asked.when.kind)
    damage = damage_of(asked, kind, run)
    told = f"twin hide: {asked.family} {asked.when.kind} at {asked.place}, {asked.size}".replace("  ", " ")
    result = damaged(run, damage)
    if all(np.array_equal(a, b, equal_nan=True) for a, b in zip(_numbers(run), _numbers(result), strict=True)):
        remedy = "give another size, or times in which there are rows that it changes"
        raise LogError("the copy would be the same: the fault changes nothing", asked.place, remedy)
    result = replace(
        result, provenance=f"{run.provenance}; {told}" if run.provenance else told, machine=_moved(run, out)
    )
    with atomic_folder(out) as new:
        write_run(new, result)
        _write_facts(new, asked, None if math.isnan(damage.size) else damage.size, kind.unit, ())
    return [f"{out}: {target} where {asked.place} {kind.meaning}: {asked.size}"]


def _numbers(run: Run) -> list[np.ndarray]:
    """All that a fault of a log may change."""
    tcp = () if run.tcp is None else (run.tcp.time, run.tcp.displacement)
    tables = [t for t in (run.loads, run.temperatures) if t is not None]
    found = [np.array([np.nan if run.initial_temperature is None else run.initial_temperature]), *tcp]
    return found + [values for t in tables for values in (t.time, *t.columns.values())]


def _expect_surface(machine: Machine, place: str) -> None:
    """Raise DescriptionError for a "part.surface" that the mesh of the part does not have."""
    part, dot, _ = place.partition(".")
    if part in machine.parts and dot:
        known = [f"{part}.{s}" for s in load_part_mesh(part, machine.parts[part], machine.folder).surfaces]
        if place not in known:
            remedy = did_you_mean(place, known, f"surfaces of '{part}'")
            raise DescriptionError(f"no such surface: '{place}'", place, remedy)


def _moved(run: Run, out: Path) -> str | None:
    """The path of the run's machine as seen from another folder."""
    return run.machine and os.path.relpath((run.folder / run.machine).resolve(), out.resolve())


def _write_facts(new: Path, asked: Request, amplitude: float | None, unit: str, windows: Sequence[Window]) -> None:
    when = asked.when
    facts = {
        "family": asked.family, "place": asked.place, "size": asked.size, "amplitude": amplitude, "unit": unit,
        "history": when.kind, "signal": when.signal, "exponent": when.exponent, "from_s": when.start,
        "to_s": when.end, "settings": dict(asked.settings),
        "windows": [[w.run, w.start, w.end if w.end < math.inf else None, w.level] for w in windows],
    }  # fmt: skip
    (new / FACTS).write_text(json.dumps(facts, indent=1) + "\n", encoding="utf-8")


def _refuse_to_destroy(out: Path, read: Sequence[Path]) -> None:
    """Raises TwinError where `out` is no place for a copy: in use, or what is read."""
    if out.exists() and not out.is_dir():
        raise TwinError("is a file, not a folder", str(out), "choose another folder with -o")
    check_folder(out)
    for path in read:
        if path.resolve() == out.resolve() or out.resolve() in path.resolve().parents:
            raise TwinError("holds what is read", str(out), "choose another folder with -o")
    if out.exists() and any(out.iterdir()) and not (out / FACTS).exists():
        raise TwinError("holds other files", str(out), "choose another folder with -o")

"""What a diagnosis leaves for use: the description with causes and refitted values in it, its artefact, its runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from twin.atomic import atomic_path
from twin.build.product import build_artefact
from twin.diagnose.diagnose import Result
from twin.diagnose.diagnosis import Cause, Diagnosis, Window
from twin.diagnose.edits import extended_description, loads_with
from twin.diagnose.hide import with_files
from twin.diagnose.study import Study
from twin.errors import TwinError
from twin.logs.run import Run
from twin.logs.write import write_run
from twin.machine.description import Machine
from twin.machine.edit import edited
from twin.progress import Progress, silent
from twin.rom.artefact import Artefact

MOVED = 0.1  # prior standard deviations that a parameter must have moved by to be written
RIGID = 300.0  # s: time constant of a capacity that the diagnosis attached rigidly


def write_extension(
    result: Result, artefact: Artefact, machine: Machine, runs: Sequence[Run], target: Path, build: bool = True,
    progress: Progress = silent,
) -> tuple[Diagnosis, list[str]]:  # fmt: skip
    """Write machine.toml, extended.h5 and the loads of added switches into `target` where there is a cause to add.

    Returns the diagnosis with the parameters that its causes have there, and what was done, in words. A cause that the
    description cannot say is told, not raised.
    """
    diagnosis = result.diagnosis
    if not result.causes:
        return diagnosis, [n for n in diagnosis.notes if n.startswith("not written")] or ["no extension is written"]
    study = result.search.yardstick.study
    said: list[str] = []
    text, done = artefact.description, []
    parameters: dict[tuple[str, str], str] = {}
    signals: dict[str, Sequence[Window]] = {}
    values = {p.path: p.value for p in diagnosis.pulls if abs(p.pull) > MOVED}
    notes = {p.path: f"calibrated: was {p.nominal:.6g} {p.unit}" for p in diagnosis.pulls if p.path in values}
    text = edited(text, values, notes)
    for cause in result.causes:
        try:
            edit = extended_description(text, [_as_edited(cause, study)])
        except TwinError as e:
            said.append(f"not in the description: {cause.family} at {cause.place}: {e.problems[0].what}")
            continue
        text = edit.text
        signals |= edit.signals
        parameters[cause.family, cause.place] = edit.parameters[0]
        done.append(cause)
    if not done:
        return diagnosis, said
    text = with_files(text, machine, target)
    with atomic_path(target / "machine.toml") as temporary:
        Path(temporary).write_text(text, encoding="utf-8")
    said.append(f"description with the effect: {target / 'machine.toml'}")
    for run in runs if signals else ():
        folder = target / "runs" / run.folder.name
        write_run(folder, replace(loads_with(run, signals), machine=None))
        said.append(f"loads with {', '.join(signals)}: {folder}")
    if build:
        build_artefact(target / "machine.toml", target / "extended.h5", progress=progress)
        said.append(f"extended artefact: {target / 'extended.h5'}; check it with twin verify")
    causes = tuple(replace(c, parameter=parameters.get((c.family, c.place), "")) for c in diagnosis.causes)
    return replace(diagnosis, causes=causes), said


def _as_edited(cause: Cause, study: Study) -> Cause:
    """A cause with sizes and settings as descriptions take them (`twin.diagnose.edits`)."""
    bench = study.bench
    settings = dict(cause.settings)
    amplitude, unit = cause.amplitude, cause.unit
    if cause.family == "forced_convection":
        amplitude = amplitude / float(settings.pop("reference", 1.0)) ** cause.exponent  # at 1 m/s
    if cause.place.startswith("films.") and cause.family == "forced_convection":
        film = cause.place.removeprefix("films.")
        settings["surfaces"] = ",".join(p.name for p in bench.places if p.film == film and p.surfaces)
    if cause.family == "coolant":
        area = next(p.area for p in bench.places if p.name == cause.place)
        dT = float(settings.pop("temperature_difference", 0.0)) / area  # W per W/(m^2 K)
        settings["temperature"] = _air(study, cause) + dT
    if cause.family == "scale_expansion":
        part = str(settings.pop("part"))
        settings["surface"] = next((p.name for p in bench.places if part in p.members and p.surfaces), part)
    if cause.family == "capacity":
        settings["conductance"] = amplitude / RIGID
    if cause.family == "loss_law" and cause.signal:
        settings["gain"] = 1.0
    place = cause.place.removesuffix(".expansion") if cause.family == "expansion" else cause.place
    if cause.family == "scale_expansion":
        place = f"axes.{cause.place.removeprefix('axes.')}"
    return replace(cause, amplitude=amplitude, unit=unit, settings=settings, place=place)


def _air(study: Study, cause: Cause) -> float:
    """Mean temperature [degC] of the air around the machine while a cause acts."""
    values = []
    e = study.bench.base.load_model.surroundings
    for planned in study.runs:
        run = planned.run
        time = (run.drive.time[:-1] + run.drive.time[1:]) / 2 - run.drive.time[0]
        for w in cause.windows:
            if w.run == run.name:
                values.append(run.drive.environment[(time >= w.start) & (time < w.end), e])
    return float(np.concatenate(values).mean()) if values else 20.0

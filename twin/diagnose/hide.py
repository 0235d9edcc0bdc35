"""A truth with something in it that the description does not know: a machine or a log, changed and written anew.

What `twin diagnose` finds and what is hidden here in a machine become text by the same table (`twin.diagnose.edits`);
faults of logs are those of `twin.diagnose.damage`. Most have the form that a diagnosis searches, some have not, such as
loads logged as means: docs/hiding.md says it family by family. Beside the copy lies hidden.json: what was hidden.
"""

from __future__ import annotations

import json
import math
import os
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from twin.atomic import atomic_folder, check_folder
from twin.build.mesh import load_part_mesh
from twin.diagnose.damage import DAMAGES, damaged, kind_of
from twin.diagnose.damage_access import Damage
from twin.diagnose.diagnosis import Cause, Window
from twin.diagnose.edits import EDITS, extended_description, loads_with
from twin.errors import DescriptionError, LogError, TwinError
from twin.logs.read import read_run
from twin.logs.refuse import usual_step
from twin.logs.run import Run
from twin.logs.write import write_run
from twin.machine.description import Machine
from twin.machine.extend import changed
from twin.machine.load import load_machine
from twin.nearest import did_you_mean
from twin.units import parse_unit, to_si

FACTS = "hidden.json"
PROFILE = 12  # windows that draw the half sine of the sun
UNITS: dict[str, tuple[str, ...]] = {  # of the size, by family; the first that fits
    "film_gain": ("1", "W/(m^2*K)"), "forced_convection": ("W/(m^2*K)",), "heat_source": ("W",),
    "loss_law": ("1", "W"), "joint": ("1",), "zone": ("K", "K/m"), "sun": ("W",), "coolant": ("W/(m^2*K)",),
    "scale_expansion": ("1/K",), "expansion": ("1",), "capacity": ("J/K",), "misplaced_source": (),
}  # fmt: skip
SETTINGS: dict[str, dict[str, str | None]] = {  # by family: name and unit; "": that of the signal, None: a name
    "heat_source": {"reference": ""}, "loss_law": {"reference": "", "gain": "1"}, "zone": {"height": "m"},
    "coolant": {"temperature": "degC"}, "capacity": {"conductance": "W/K"},
    "scale_expansion": {"fixed_at": "m", "surface": None, "axis": None},
}  # fmt: skip
FOLLOWING = ("forced_convection", "heat_source", "loss_law", "sun")  # a power of their signal
STEADY = ("expansion", "scale_expansion", "capacity", "misplaced_source")


@dataclass(frozen=True)
class Hidden:
    """What is to be hidden, as it was asked for."""

    family: str
    place: str
    size: str  # with a unit: "10 W", "3"; a place where one is exchanged for another
    history: str = ""
    signal: str = ""
    exponent: float = 1.0
    start: float | None = None  # s
    end: float | None = None
    settings: Mapping[str, str] = field(default_factory=dict)  # with units


def hide(asked: Hidden, target: Path, out: Path, runs: Sequence[Path] = ()) -> list[str]:
    """Write a copy of the machine, or of the run folder, `target` to the folder `out`, and tell what was done.

    runs: run folders that get the switch of a machine's hidden history, copied to out/runs.
    Raises TwinError for unknown families, places and signals, units of another dimension, and folders in use.
    """
    _refuse_to_destroy(out, [target, *runs])
    if asked.family == "coarse_model":
        remedy = "build the artefact itself with few states: twin build MACHINE -o A.h5 --states 20"
        raise TwinError("is a property of an artefact, not of a machine or a log", asked.family, remedy)
    if asked.family not in EDITS:
        raise TwinError(f"unknown family '{asked.family}'", "FAMILY", did_you_mean(asked.family, EDITS, "families"))
    if asked.exponent != 1.0 and not (asked.signal and asked.family in FOLLOWING):
        remedy = f"leave it out; with --signal it is for {', '.join(FOLLOWING)}"
        raise TwinError("there is nothing that it is the exponent of", "--exponent", remedy)
    is_run = (target / "run.toml").exists()
    if asked.family in DAMAGES:
        if not is_run:
            what = f"'{asked.family}' is a fault of a log, and this is no run folder"
            raise LogError(
                what, str(target), "give a run folder; `twin simulate MACHINE RUN` writes one with everything"
            )
        if runs:
            raise TwinError("is for machines", "--run", "give the run folder in place of the machine")
        return _hide_in_log(asked, target, out)
    if is_run:
        what = f"'{asked.family}' changes a machine, and this is a run folder"
        raise DescriptionError(what, str(target), "give the machine, and the run with --run")
    return _hide_in_machine(asked, target, out, runs)


def _hide_in_machine(asked: Hidden, target: Path, out: Path, runs: Sequence[Path]) -> list[str]:
    if asked.history:
        remedy = "use --signal with --exponent, or --from and --to"
        raise TwinError(f"'{asked.family}' has no kinds to choose from", "--history", remedy)
    path = target / "machine.toml" if target.is_dir() else target
    machine = load_machine(path)
    text = path.read_bytes().decode("utf-8-sig")
    if asked.signal and (asked.family in STEADY or (asked.family, asked.place[:6]) == ("film_gain", "films.")):
        raise TwinError(f"'{asked.family}' acts always", "--signal", "leave it out")
    logs = {folder: read_run(folder) for folder in runs}
    cause = cause_of(asked, machine, _windows(asked, list(logs.values())))
    for place in (cause.place, str(cause.settings.get("surface", ""))):
        _expect_surface(machine, place)
    edit = extended_description(text, [cause], "hidden")
    with atomic_folder(out) as new:
        text = with_files(edit.text, machine, new, "hidden")
        load_machine(path, text)
        (new / "machine.toml").write_text(text, encoding="utf-8", newline="")
        for folder, log in logs.items():
            machine_path = log.machine and "../../machine.toml"
            write_run(
                new / "runs" / folder.resolve().name, replace(loads_with(log, edit.signals), machine=machine_path)
            )
        _write_facts(new, asked, cause.amplitude, cause.unit, cause.windows)
    told = [f"{out}: '{machine.machine.name}' with {asked.family} at {asked.place}, {asked.size}"]
    told += [f"{out / 'runs' / folder.resolve().name}: its loads, with {', '.join(edit.signals)}" for folder in logs]
    if edit.signals and not logs:
        told.append(
            f"without a column {', '.join(edit.signals)} [1] in loads.csv it stays off: --run writes such copies"
        )
    return told


def _hide_in_log(asked: Hidden, target: Path, out: Path) -> list[str]:
    run = read_run(target)
    kind = kind_of(asked.family, asked.history)
    if asked.settings:
        raise TwinError("is for machines", "--setting", f"a fault of a log has a size only, which {kind.meaning}")
    if asked.signal and not kind.follows:
        raise TwinError(f"'{asked.family}' of this kind follows no column", "--signal", "leave it out")
    damage = Damage(
        family=asked.family,
        place=asked.place,
        size=_size(asked.size, kind.unit) if kind.unit else math.nan,
        history=asked.history,
        signal=asked.signal,
        other="" if kind.unit else asked.size,
        start=-math.inf if asked.start is None else asked.start,
        end=math.inf if asked.end is None else asked.end,
    )
    if kind.unit == "s" and not damage.size > 0.0:
        raise TwinError(f"a time of {asked.size}", "SIZE", "give a positive one, for example '10 min'")
    _expect_some(damage.start, damage.end, run)
    told = f"twin hide: {asked.family} {asked.history} at {asked.place}, {asked.size}".replace("  ", " ")
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


def cause_of(asked: Hidden, machine: Machine, windows: tuple[Window, ...]) -> Cause:
    """What is to be hidden in a machine, as the catalogue says it."""
    amplitude, unit = 0.0, ""
    settings: dict[str, float | str] = {n: _setting(n, text, asked, machine) for n, text in asked.settings.items()}
    if asked.family == "misplaced_source":
        settings["surface"] = asked.size
    else:
        amplitude, unit = _amplitude(asked)
    history = "always"
    if asked.signal:
        history = asked.signal + (f"^{asked.exponent:g}" if asked.exponent != 1.0 else "")
    elif windows:
        history = _told_windows(asked)
    return Cause(
        family=asked.family, place=asked.place, parameter="", amplitude=amplitude, ci95=(amplitude, amplitude),
        unit=unit, statistic=math.inf, threshold=0.0, history=history, signal=asked.signal, exponent=asked.exponent,
        windows=windows, settings=settings,
    )  # fmt: skip


def _amplitude(asked: Hidden) -> tuple[float, str]:
    """The size in SI, in the first unit of the family that it can have."""
    units = UNITS[asked.family]
    if asked.family == "film_gain":
        units = units[:1] if asked.place.startswith("films.") else units[1:]
    if asked.family == "loss_law":
        units = units[1:] if asked.signal else units[:1]
    problems = []
    for unit in units:
        try:
            return _size(asked.size, unit), unit
        except TwinError as e:
            problems.append(e)
    raise problems[0]


def _size(text: str, unit: str) -> float:
    try:
        return to_si(text, unit)
    except ValueError as e:
        example = "'3'" if unit == "1" else f"'10 {unit}'"
        raise TwinError(str(e), "SIZE", f"write a number{'' if unit == '1' else ' with its unit'}: {example}") from e


def _setting(name: str, text: str, asked: Hidden, machine: Machine) -> float | str:
    known = SETTINGS.get(asked.family, {})
    if name not in known:
        remedy = did_you_mean(name, known, f"settings of '{asked.family}'")
        raise TwinError(f"'{asked.family}' has no setting '{name}'", "--setting", remedy)
    unit = known[name]
    if unit is None:
        return text
    if name == "reference":  # of the signal
        if asked.signal not in machine.signals:
            remedy = did_you_mean(asked.signal, machine.signals, "signals")
            raise TwinError(f"unknown signal '{asked.signal}'", "--signal", remedy)
        unit = parse_unit(machine.signals[asked.signal].unit).si
    try:
        return to_si(text, unit)
    except ValueError as e:
        raise TwinError(str(e), f"--setting {name}", f"write a number with its unit: '1 {unit}'") from e


def _windows(asked: Hidden, logs: Sequence[Run]) -> tuple[Window, ...]:
    """From --from to --to in every run; of the sun a half sine between them. None where neither is given."""
    if asked.start is None and asked.end is None:
        return ()
    if asked.signal:
        raise TwinError("a history is given by a signal or by times", "--signal", "leave out --from and --to")
    found = []
    runs: list[Run | None] = [*logs] if logs else [None]
    for log in runs:
        start = asked.start or 0.0
        end = _span(log)[1] if asked.end is None else asked.end
        _expect_some(start, end, log)
        name = "" if log is None else log.folder.resolve().name
        if asked.family != "sun":
            found.append(Window(name, start, end))
            continue
        if end == math.inf:
            raise TwinError("needs the time at which the sun is gone", "--to", "give --from and --to")
        step = (end - start) / PROFILE
        found += [
            Window(name, start + k * step, start + (k + 1) * step, math.sin(math.pi * (k + 0.5) / PROFILE))
            for k in range(PROFILE)
        ]
    return tuple(found)


def _span(log: Run | None) -> tuple[float, float]:
    """Start and end [s] of a run: its last row is held as long as the others. Without an end where none is given."""
    if log is None:
        return 0.0, math.inf
    return float(log.loads.time[0]), float(log.loads.time[-1] + usual_step(log.loads))


def _expect_some(start: float, end: float, log: Run | None) -> None:
    """Raise TwinError where nothing of a run lies between two times [s]."""
    first, last = _span(log)
    if not max(start, first) < min(end, last):
        within = "" if log is None else f" within the run, {first / 3600.0:g} h .. {last / 3600.0:g} h"
        raise TwinError("nothing is left between --from and --to", "--from", f"give times{within}, --from before --to")


def _numbers(run: Run) -> list[np.ndarray]:
    """All that a fault of a log may change."""
    tcp = () if run.tcp is None else (run.tcp.time, run.tcp.displacement)
    tables = [t for t in (run.loads, run.temperatures) if t is not None]
    found = [np.array([np.nan if run.initial_temperature is None else run.initial_temperature]), *tcp]
    return found + [values for t in tables for values in (t.time, *t.columns.values())]


def _told_windows(asked: Hidden) -> str:
    start = f"from {(asked.start or 0.0) / 3600.0:g} h"
    return start + (" on" if asked.end is None else f" to {asked.end / 3600.0:g} h")


def _expect_surface(machine: Machine, place: str) -> None:
    """Raise DescriptionError for a "part.surface" that the mesh of the part does not have."""
    part, dot, _ = place.partition(".")
    if part in machine.parts and dot:
        known = [f"{part}.{s}" for s in load_part_mesh(part, machine.parts[part], machine.folder).surfaces]
        if place not in known:
            remedy = did_you_mean(place, known, f"surfaces of '{part}'")
            raise DescriptionError(f"no such surface: '{place}'", place, remedy)


def with_files(text: str, machine: Machine, new: Path, mark: str = "found") -> str:
    """Copy meshes and scripts into the folder `new`; a mesh that lies elsewhere is named by its absolute path.

    mark: who changed the text, "found" or "hidden" (`twin.machine.extend.changed`).
    """
    folder = machine.folder.resolve()
    for script in folder.glob("*.py"):
        shutil.copyfile(script, new / script.name)
    for name, part in machine.parts.items():
        if part.mesh is None:
            continue
        mesh = (folder / part.mesh).resolve()
        if not mesh.is_relative_to(folder) or Path(part.mesh).is_absolute():
            text = changed(text, {f"parts.{name}.mesh": str(mesh)}, mark)
            continue
        copy = new / mesh.relative_to(folder)
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(mesh, copy)
    return text


def _moved(run: Run, out: Path) -> str | None:
    """The path of the run's machine as seen from another folder."""
    return run.machine and os.path.relpath((run.folder / run.machine).resolve(), out.resolve())


def _write_facts(new: Path, asked: Hidden, amplitude: float | None, unit: str, windows: Sequence[Window]) -> None:
    facts = {
        "family": asked.family, "place": asked.place, "size": asked.size, "amplitude": amplitude, "unit": unit,
        "history": asked.history, "signal": asked.signal, "exponent": asked.exponent, "from_s": asked.start,
        "to_s": asked.end, "settings": dict(asked.settings),
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

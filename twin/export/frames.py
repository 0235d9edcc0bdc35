"""Frames of a result for ParaView: the surface by the artefact, or the volume by the full model stepped again.

The surface has the temperatures of the reduced model, and the displacements that follow from them; the machine is drawn
where its axes are, undeformed, as displacements are data of its points. With the full model at hand (`--field`) every
node has both, by that model stepped again.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from twin.errors import TwinError
from twin.export.options import ExportOptions
from twin.export.run_result import named_result
from twin.rom.artefact import Artefact
from twin.rom.hdf5_file import strings
from twin.rom.surface_motion import is_known, surface_displacements
from twin.rom.tcp import by_body
from twin.rom.turned_surface import surface_turns, turned_surface

UNDEFORMED = {  # why there is no displacement
    True: "no displacement: the artefact is of an older version or has calibrated expansions; --field has it",
    False: "no displacement: the machine has no tool centre point",
}


@dataclass(frozen=True)
class Frame:
    """The machine at one time."""

    time: float  # s since the start of the run
    points: np.ndarray  # (n, 3) m, axes where they are, undeformed
    data: dict[str, np.ndarray]  # temperature (n,) degC; displacement (n, 3) m


@dataclass(frozen=True)
class Frames:
    """A series: the same cells at every time."""

    cell_type: str  # as meshio names it: "triangle", "tetra10"
    cells: np.ndarray  # (c, k) numbers of points
    count: int
    frames: Iterator[Frame]
    note: str = ""  # what is not in it


@dataclass(frozen=True)
class _Stored:
    """What a result says of its times."""

    time: np.ndarray  # (n + 1,) s
    states: np.ndarray  # (n + 1, N)
    axes: tuple[str, ...]
    position: np.ndarray  # (n + 1, n_axes) m
    angle: np.ndarray  # (n + 1, n_turning) rad
    chosen: np.ndarray  # rows that become frames
    run: object  # whose loads it is of, as its summary says

    def position_of(self, axes: Sequence[str], row: int) -> dict[str, float]:
        """Positions [m] of these axes in a row of the result."""
        found = dict(zip(self.axes, self.position[row].tolist(), strict=True))
        return {axis: found[axis] for axis in axes if axis in found}


def frames_of(artefact: Artefact, options: ExportOptions) -> Frames:
    """The series that the options ask for.

    Raises TwinError where no result is named or the machine has no meshes, ArtefactError for `field` where the machine
    that the artefact was built from is gone.
    """
    if not artefact.fields:
        raise TwinError("the artefact has no surface: a lumped machine", artefact.model.name, "use --format json")
    stored = _stored(artefact, options)
    return _volume(artefact, stored) if options.field else _surface(artefact, stored)


def _stored(artefact: Artefact, options: ExportOptions) -> _Stored:
    with named_result(artefact, options) as (f, told):
        time = f["time"][...]
        chosen = np.unique(np.linspace(0, len(time) - 1, min(options.frames, len(time))).round().astype(int))
        angle = f["angle"][...] if "angle" in f else np.zeros((len(time), 0))
        return _Stored(time, f["states"][...], strings(f["axis"]), f["position"][...], angle, chosen, told.get("run"))


def _surface(artefact: Artefact, stored: _Stored) -> Frames:
    from twin.machine.description import Machine

    machine = Machine.model_validate(tomllib.loads(artefact.description))
    turns = surface_turns(artefact.model, artefact.fields)
    order, known = [body.name for body in artefact.model.bodies], is_known(artefact.model, artefact.fields)
    sizes = np.cumsum([0, *(len(f.nodes) for f in artefact.fields)])
    triangles = np.vstack([f.triangles + first for f, first in zip(artefact.fields, sizes, strict=False)])

    def made() -> Iterator[Frame]:
        for row in stored.chosen:
            x = by_body(artefact.model, stored.states[row])
            warm = [f.basis.astype(float) @ x[order.index(f.body)] for f in artefact.fields]
            data = {"temperature": artefact.model.reference_temperature + np.concatenate(warm)}
            moved: Sequence[np.ndarray | None] = [None] * len(artefact.fields)
            if known:
                at = stored.position_of(artefact.model.pose_axes, row)
                moved = surface_displacements(artefact.model, artefact.fields, stored.states[row], at)
            standing = [
                turned_surface(turns, f, stored.angle[row], u) for f, u in zip(artefact.fields, moved, strict=True)
            ]
            bodies = [(f.body, nodes) for f, (nodes, _) in zip(artefact.fields, standing, strict=True)]
            points = _placed(machine, bodies, stored, row)
            if known:
                data["displacement"] = np.vstack([u for _, u in standing if u is not None])
            yield Frame(float(stored.time[row] - stored.time[0]), points, data)

    note = "" if known else UNDEFORMED[artefact.model.moves]
    return Frames("triangle", triangles, len(stored.chosen), made(), note)


def _volume(artefact: Artefact, stored: _Stored) -> Frames:
    from twin.build.displacement_field import DisplacementField
    from twin.build.pipeline import full_model
    from twin.build.product import machine_of
    from twin.build.stepper import CoupledStepper
    from twin.logs.read import read_run
    from twin.logs.signals import signal_values
    from twin.rom.drive import evaluate

    machine = machine_of(artefact, None, artefact.model.name)
    run = read_run(_run_folder(stored.run))
    full = full_model(machine)
    load, dt = full.thermal.load_model, float(stored.time[1] - stored.time[0])
    drive = evaluate(load, run.loads.time, signal_values(run, load.signals), dt, int(stored.chosen[-1]))
    stepper = CoupledStepper(full.thermal)
    deformed = DisplacementField(machine, full.bodies, full.structure)  # type: ignore[arg-type]  # it has meshes
    start = by_body(artefact.model, stored.states[0])
    uniform = [float(b.energy @ x / (b.energy @ b.one)) for b, x in zip(artefact.model.bodies, start, strict=True)]
    x = [u * b.one for u, b in zip(uniform, full.thermal.bodies, strict=True)]
    sizes = np.cumsum([0, *(b.n for b in full.bodies)])
    cells = np.vstack([b.elements + first for b, first in zip(full.bodies, sizes, strict=False)])

    def frame(row: int, x: list[np.ndarray]) -> Frame:
        linear = stored.position_of(full.structure.axes, row)
        points = _placed(machine, [(b.name, b.nodes) for b in full.bodies], stored, row)
        nodal = [state[: b.n] for state, b in zip(x, full.bodies, strict=True)]  # tanks come after the nodes
        temperature = full.thermal.reference_temperature + np.concatenate(nodal)
        data = {"temperature": temperature, "displacement": np.vstack(deformed(linear, x))}
        return Frame(float(stored.time[row] - stored.time[0]), points, data)

    def made() -> Iterator[Frame]:
        wanted = set(stored.chosen.tolist())
        if 0 in wanted:
            yield frame(0, x)
        for step, now, _ in stepper.run(drive, x, 1):
            if step + 1 in wanted:
                yield frame(step + 1, now)

    return Frames("tetra10", cells, len(stored.chosen), made())


def _run_folder(named: object) -> Path:
    """The run whose loads a result is of."""
    if not isinstance(named, str):
        remedy = "run the artefact again, with `twin run -o`"
        raise TwinError("does not say which run it is of", "summary.json of --result", remedy)
    if not Path(named).is_dir():
        remedy = "call from the folder where `twin run` was called"
        raise TwinError(f"the run '{named}' is not here", "summary.json of --result", remedy)
    return Path(named)


def _placed(machine: object, bodies: list[tuple[str, np.ndarray]], stored: _Stored, row: int) -> np.ndarray:
    """Points (n, 3) [m] of all bodies with the axes where they are."""
    from twin.machine.description import Machine
    from twin.machine.kinematics import displacement, linear_axes

    assert isinstance(machine, Machine)
    positions = stored.position_of(linear_axes(machine), row)
    return np.vstack([nodes + displacement(machine, name, positions) for name, nodes in bodies])

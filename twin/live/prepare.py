"""An artefact made ready for the process beside the machine: its facts, and its C code as a library.

Both are kept in a folder named by what they were made from. Writing C needs JAX, which the process that steps the
machine in C is not to load: `python -m twin.live.prepare A.h5 FOLDER` makes them in a process of its own.
"""

from __future__ import annotations

import twin.run.jax_setup  # noqa: F401  isort: skip  before NumPy

import subprocess
import sys
from importlib import resources
from pathlib import Path

import numpy as np

from twin.atomic import atomic_folder
from twin.errors import TwinError
from twin.export.c.source import Source, source_of
from twin.export.c.text import Arrays, identifier, named
from twin.export.compiler import own_compiler
from twin.live.facts import FACTS, LIBRARY, Axis, Channel, Facts, write_facts
from twin.rom.artefact import Artefact, read_artefact
from twin.rom.drive import needed_signals
from twin.rom.model import MachineModel
from twin.run.correction import PoseErrors, default_degrees
from twin.run.correction_axes import axis_jacobian, offset_matrix
from twin.run.correction_polynomial import design_matrix, normalised_axes
from twin.run.correction_struts import on_struts, strut_error_rows
from twin.run.system import Prepared
from twin.run.system import prepare as prepared_of

_FLAGS = ("-std=c99", "-O3", "-shared", "-fPIC")


def facts_of(artefact: Artefact, flags: tuple[str, ...] = ()) -> Facts:
    """The facts of an artefact. Raises TwinError for machines without a TCP or without an axis to correct with."""
    model, load, c = artefact.model, artefact.model.load_model, artefact.certificate
    if not model.moves:
        raise TwinError("the machine has no TCP, so nothing can be corrected", "artefact", "describe [tcp]")
    n = len(model.poses) - model.scattered
    poses = model.poses[:n]
    errors = PoseErrors(model.pose_axes, model.pose_grid, poses, np.zeros((n, 3)))
    axes = normalised_axes(model.pose_axes, poses, default_degrees(errors))
    jacobian = axis_jacobian(artefact, model.pose_axes)
    needed = needed_signals(load)
    names = [s.name for s in load.signals]
    axis_of = {a.position: a.name for a in load.axes} | {a.position: a.name for a in load.rotary}
    air = load.environments[load.surroundings]
    words = "no certificate"
    if "max_temperature_error_in_case" in c:
        kelvin, metres = (float(np.max(c[f"max_{k}_error_in_case"])) for k in ("temperature", "displacement"))
        words = f"{kelvin:.3g} K, {1e6 * metres:.3g} um in scenarios that the model was not trained on"
    return Facts(
        machine=model.name,
        digest=artefact.digest,
        prefix=identifier(model.name),
        step=float(c.get("step", 60.0)),
        reference_temperature=float(model.reference_temperature),
        channels=tuple(
            Channel(s.column, s.unit, s.name in needed, s.default, s.low, s.high, axis_of.get(s.name, ""))
            for s in load.signals
        ),
        axis_channels=tuple(names.index(a.position) for a in load.axes),
        strokes=tuple((a.low, a.high) for a in load.axes),
        air=names.index(air.signal) if air.signal else -1,
        air_temperature=air.temperature,
        sensors=model.all_sensors,
        flags=flags,
        poses=n,
        all_poses=len(model.poses),
        pose_grid=tuple(tuple(g.tolist()) for g in model.pose_grid),
        axes=tuple(Axis(a.name, a.centre, a.half_range, a.degree) for a in axes),
        offset_per_error=tuple(map(tuple, offset_matrix(jacobian).tolist())),
        fit=tuple(map(tuple, np.linalg.pinv(design_matrix(axes, poses)).tolist())),
        certificate=words,
    )


def strut_rows(model: MachineModel, prepared: Prepared) -> np.ndarray:
    """(6 * n, N) [m]: by how much struts are too long at the n poses, per coordinate that is stepped."""
    rows = strut_error_rows(model, np.asarray(model.poses))
    return np.hstack([own.reshape(-1, own.shape[-1]) @ X for own, X in zip(rows, prepared.back, strict=True)])


def prepare(path: Path, folder: Path) -> None:
    """Write the facts and the library of the artefact at `path` to `folder`.

    Raises ArtefactError for files that are none, TwinError without a C compiler, where compiling fails, and for a
    folder of other things.
    """
    if folder.exists() and not (folder / LIBRARY).is_file():
        raise TwinError("is there and holds no compiled machine", str(folder), "name a new folder")
    artefact = read_artefact(path)
    source = source_of(artefact)
    facts = facts_of(artefact, source.flags)
    struts = Arrays(False, source.name)
    if on_struts(artefact.model):
        struts.reals("strut_errors", strut_rows(artefact.model, prepared_of(artefact.model)))
    shim = "".join(struts.parts) + (resources.files("twin.live") / "live.c").read_text(encoding="utf-8")
    with atomic_folder(folder) as temporary:
        write_facts(temporary / FACTS, facts)
        _compile(source, named(shim, source.name), temporary)


def _compile(source: Source, shim: str, folder: Path) -> None:
    compiler = own_compiler()
    if compiler is None:
        raise TwinError("no C compiler, so no C engine", "--engine", "install gcc, name one in CC, or --engine jax")
    code = folder / f"{source.name}.c"
    (folder / f"{source.name}.h").write_text(source.header, encoding="utf-8")
    code.write_text(source.code + shim, encoding="utf-8")
    command = [compiler, *_FLAGS, "-o", str(folder / LIBRARY), str(code), "-lm"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        last = done.stderr.strip()[-200:]
        raise TwinError(f"the compiler {compiler} failed: {last}", "--engine", "name another in CC, or --engine jax")
    code.unlink()  # 40 bytes per number of the model: nothing reads it again


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit("usage: python -m twin.live.prepare A.h5 FOLDER    (the folder runs with `twin live FOLDER ...`)")
    try:
        prepare(Path(sys.argv[1]), Path(sys.argv[2]))
    except TwinError as error:
        print(error, file=sys.stderr)
        sys.exit(error.status)

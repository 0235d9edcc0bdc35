"""Exports of the five-axis machine: seconds and size, and what control tables leave of the full model's error."""

from __future__ import annotations

import resource
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.five_axis import FOLDER, full
from twin.build.displacement_field import DisplacementField
from twin.build.pipeline import BuildOptions
from twin.build.product import build_artefact
from twin.build.stepper import CoupledStepper
from twin.build.structure import Structure
from twin.build.volumetric import displacements
from twin.export.additive import fit_additive
from twin.export.axis_lines import fit_lines, line_offsets
from twin.export.axis_offsets import Offsets, at_poses, left, sampled
from twin.export.formats import FORMATS
from twin.export.generic import grid_offsets
from twin.export.options import ExportOptions
from twin.logs.read import read_run
from twin.logs.signals import signal_values
from twin.machine.load import load_machine
from twin.progress import bar
from twin.rom.artefact import Artefact, read_artefact
from twin.rom.drive import evaluate
from twin.rom.surface_motion import surface_displacements
from twin.run.correction import PoseErrors, fit_correction
from twin.run.correction_axes import axis_jacobian
from twin.run.correction_file import read_pose_errors
from twin.run.replay import replay
from twin.run.results import Result, write_results

HOURS = 4.0  # of experiment A: the X axis has moved
LIMIT = 10.0  # s, any format but series of fields
SERIES = ("vtk", "vtkhdf")


@dataclass(frozen=True)
class TrueErrors(PoseErrors):
    """The full model's TCP errors, at any position."""

    displacement: Callable[[np.ndarray], np.ndarray] = np.zeros_like

    def at(self, position: np.ndarray) -> np.ndarray:
        return self.displacement(position)


def truth() -> list[np.ndarray]:
    """Temperatures above the reference [K] of the full model, body by body, after HOURS."""
    model, run = full().thermal, read_run(FOLDER / "runs" / "experiment_a")
    signals = signal_values(run, model.load_model.signals)
    drive = evaluate(model.load_model, run.loads.time, signals, 60.0, round(60 * HOURS))
    stepper = CoupledStepper(model)
    x = stepper.uniform(float(run.initial_temperature or model.reference_temperature))
    for _, x, _ in stepper.run(drive, x, 1):  # noqa: B020  x goes on from where it began
        last = x
    return list(last)


def surface(artefact: Artefact, result: Result, true: list[np.ndarray]) -> None:
    """Displacements of the surface by the reduced model, as `vtk` has them, beside those of the full model."""
    row, structure = round(60 * HOURS), full().structure
    assert isinstance(structure, Structure)
    at = {axis: float(p) for axis, p in zip(result.axes, result.position[row], strict=True) if axis in structure.axes}
    exact = DisplacementField(load_machine(FOLDER), full().bodies, structure)(at, true)
    found = surface_displacements(artefact.model, artefact.fields, result.states[row], at)
    names = [body.name for body in full().bodies]
    own = [full().thermal.bodies[names.index(f.body)].F @ exact[names.index(f.body)] for f in artefact.fields]
    off, size = np.linalg.norm(np.vstack(found) - np.vstack(own), axis=1), np.linalg.norm(np.vstack(own), axis=1)
    share = np.sqrt(np.mean(off**2) / np.mean(size**2))
    print(
        f"   displacements of the surface: up to {1e6 * size.max():.0f} um, at most {1e6 * off.max():.2f} um from "
        f"those of the full model, rms {100 * share:.2f} %"
    )


def processor_time() -> float:
    """s of this process and of compilers that it has waited for."""
    used = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(u.ru_utime + u.ru_stime for u in used)


def tables(errors: PoseErrors, jacobian: np.ndarray, displacement: Callable[[np.ndarray], np.ndarray]) -> None:
    samples = sampled(errors, jacobian)
    lines, additive = fit_lines(at_poses(errors, jacobian)), fit_additive(samples)
    offsets: dict[str, Offsets] = {
        "offset and slope per axis (siemens, beckhoff)": lambda p: line_offsets(lines, p),
        "tables of every axis over every other (heidenhain)": additive.offsets,
        "grid of 9 x 9 x 9 (generic)": lambda p: grid_offsets(samples, p),
        "27 coefficients per component (twin correction)": fit_correction(errors, jacobian).offsets,
        "product of parabolas, eq (16.1) as printed": fit_correction(errors, jacobian, form="product").offsets,
    }
    true = TrueErrors(errors.axes, errors.grid, errors.poses, displacement(errors.poses), displacement=displacement)
    size = left(np.zeros_like, true, jacobian)
    print(f"   TCP error of the full model: rms {1e6 * np.linalg.norm(size.before_rms):.2f} um")
    for name, function in offsets.items():
        found = left(function, true, jacobian)
        largest = 1e6 * found.after.max()
        print(f"   left by {name}: {100 * found.share:.1f} % of the rms, at most {largest:.2f} um along an axis")


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "five_axis.h5"
        build_artefact(FOLDER, path, BuildOptions(held_out=1), bar)
        artefact = read_artefact(path)
        run, out = FOLDER / "runs" / "experiment_a", Path(folder) / "out"
        result = replay(artefact, read_run(run))
        write_results(out, result, {"run": str(run)})
        for name, format in FORMATS.items():
            options = ExportOptions(result=out if "result" in format.options else None)
            target = Path(folder) / name / f"x{format.suffix}"
            began, worked = time.perf_counter(), processor_time()
            format.write(artefact, target, options)
            seconds, cpu = time.perf_counter() - began, processor_time() - worked
            size = sum(p.stat().st_size for p in target.parent.rglob("*") if p.is_file())
            limit = "" if name in SERIES else f" (limit {LIMIT:g} s)"
            print(f"   {name}: {seconds:.2f} s{limit}, {cpu:.2f} s of processor time, {size / 1e6:.2f} MB")
        errors, _ = read_pose_errors(out, artefact.digest, 3600.0 * HOURS)
        errors = replace(errors, model=artefact.model)
        last = truth()
        surface(artefact, result, last)
        structure = full().structure
        tables(errors, axis_jacobian(artefact, errors.axes), lambda at: displacements(structure, at, [last])[0])


if __name__ == "__main__":
    main()

"""The error of C code against `twin run`: compiled, run on the loads of a run folder, compared."""

from __future__ import annotations

import twin.run.jax_setup  # noqa: F401  isort: skip  before NumPy

import io
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from twin.errors import TwinError
from twin.export.c.source import Source, source_of
from twin.export.compiler import own_compiler, put_weights, taking
from twin.logs.read import read_run
from twin.logs.run import Run
from twin.logs.signals import signal_values
from twin.rom.artefact import Artefact
from twin.rom.sampling import cut
from twin.rom.turning import STRAIGHT
from twin.run.replay import replay
from twin.run.results import Result

_FLAGS = ("-std=c99", "-O3")


@dataclass(frozen=True)
class Difference:
    """The largest ones over a run."""

    temperature: float  # K, any sensor
    actual: float  # m, TCP displacement at the actual position, rotary axes at zero
    poses: float  # m, at any pose
    flags: int  # steps, rotary axes at zero, that one has flags in and the other has none
    turned: int = 0  # steps with a rotary axis off zero, where the code flags the displacement of zero


def measured(artefact: Artefact, folder: Path, single: bool) -> str:
    """One line about the error over a run. Raises TwinError without a C compiler, LogError for a bad run."""
    d = difference(artefact, folder, single)
    precision = "single" if single else "double"
    return (
        f"Error against twin run over {folder.name}, {precision} precision: {d.temperature:.2g} K, "
        f"{1e6 * d.actual:.2g} um at the actual position, {1e6 * d.poses:.2g} um at all poses"
        + (f"; {d.turned} steps with a rotary axis off zero are flagged and not compared there" if d.turned else "")
    )


def difference(artefact: Artefact, folder: Path, single: bool = False) -> Difference:
    """The C runtime beside `twin.run.replay.replay` over a run. Raises TwinError as `measured`."""
    expected = replay(artefact, read_run(folder))
    initial = read_run(folder).initial_temperature
    start = float(expected.temperature[0, -1]) if initial is None else initial
    step = float(expected.time[1] - expected.time[0])
    with tempfile.TemporaryDirectory() as scratch:
        program = compiled_example(source_of(artefact, single), Path(scratch))
        found = table(program, folder / "loads.csv", start, step)
    n = len(expected.sensors)
    temperature, actual, poses = found[:, 1 : n + 1], found[:, n + 1 : n + 4], found[:, n + 4 : -1]
    if len(found) != len(expected.time) - 1:
        raise TwinError(f"{len(found)} steps, {len(expected.time) - 1} expected", str(folder), "report this")
    turned = turned_steps(artefact, read_run(folder), expected)
    flags = np.sum(((found[:, -1] > 0) != expected.flags.any(axis=1))[~turned])
    return Difference(
        temperature=float(np.abs(temperature - expected.temperature[1:]).max(initial=0.0)),
        actual=float(np.abs(actual - expected.tcp_actual[1:])[~turned].max(initial=0.0)),
        poses=float(np.abs(poses - expected.tcp[1:].reshape(len(found), -1)).max(initial=0.0)),
        flags=int(flags),
        turned=int(turned.sum()),
    )


def turned_steps(artefact: Artefact, run: Run, result: Result) -> np.ndarray:
    """(n_steps,) bool: in which steps a rotary axis that turns tool or work is off zero, at their ends or between."""
    load = artefact.model.load_model
    off = (np.abs(result.angle) > STRAIGHT).any(axis=1)
    values = signal_values(run, load.signals)
    angles = [np.abs(np.nan_to_num(values[a.position])) > STRAIGHT for a in load.rotary if a.position in values]
    intervals = cut(run.loads.time - run.loads.time[0], result.time - result.time[0])
    held = np.any(angles, axis=0) if angles else np.zeros(len(run.loads.time), dtype=bool)
    within = intervals.any(held[intervals.sample])
    return np.asarray(within | off[1:] | off[:-1])


def compiled_example(source: Source, folder: Path) -> Path:
    """The example program of a machine, compiled. Raises TwinError without a C compiler, and where it fails."""
    compiler = own_compiler()
    if compiler is None:
        raise TwinError("no C compiler, so nothing can be measured", "--run", "install gcc, or leave out --run")
    names = {f"{source.name}.h": source.header, f"{source.name}.c": source.code, "example.c": source.example}
    for name, text in names.items():
        (folder / name).write_text(text, encoding="utf-8")
    program = folder / "example"
    weights = put_weights(folder, source.weights)
    files = ["example.c", f"{source.name}.c"]
    command = [compiler, *_FLAGS, taking(source.name, weights), "-o", str(program.resolve()), *files, "-lm"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=folder)
    if done.returncode:
        raise TwinError(f"the compiler {compiler} failed: {done.stderr.strip()[-200:]}", "--run", "name another in CC")
    return program


def table(program: Path, loads: Path, initial: float, step: float) -> np.ndarray:
    """What the example writes (steps, columns): time, sensors, TCP at the actual position and all poses, flags."""
    done = subprocess.run(
        [str(program), str(loads), repr(initial), repr(step), "poses"], capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise TwinError(f"the C code failed: {done.stderr.strip()}", str(loads), "look at the run with `twin check`")
    return np.loadtxt(io.StringIO(done.stdout), delimiter=",", skiprows=1, ndmin=2)

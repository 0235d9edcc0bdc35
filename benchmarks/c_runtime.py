"""The runtime in C beside JAX: start, memory, a step with all poses, the correction in a cycle."""

from __future__ import annotations

import twin.run.jax_setup  # noqa: F401  isort: skip  before numpy: JAX's LAPACK is SciPy's OpenBLAS

import resource
import subprocess
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.five_axis import FOLDER
from benchmarks.step import milliseconds
from twin.build.pipeline import BuildOptions
from twin.build.product import build_artefact
from twin.export.c.measure import compiled_example, difference
from twin.export.c.source import Source, source_of
from twin.export.c.text import named
from twin.progress import bar
from twin.rom.artefact import Artefact, read_artefact

RUN = FOLDER / "runs" / "experiment_a"
STARTS = 21
START, MEMORY, CORRECTION = 50.0, 60.0, 10.0  # ms, MB, us: what is asked for


def start(program: Path, folder: Path) -> None:
    rows = (RUN / "loads.csv").read_text(encoding="utf-8").splitlines()
    first = folder / "first.csv"
    first.write_text("\n".join(rows[:8]) + "\n", encoding="utf-8")  # a minute: one step
    seconds, before = [], resource.getrusage(resource.RUSAGE_CHILDREN)
    for _ in range(STARTS):
        began = time.perf_counter()
        subprocess.run([program, first, "22.0", "60", "poses"], stdout=subprocess.DEVNULL, check=True)
        seconds.append(time.perf_counter() - began)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    worked = (after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime) / STARTS
    print(f"   from the command to the first result, all poses written: {1e3 * np.median(seconds):.1f} ms, at best "
          f"{1e3 * min(seconds):.1f} ms; processor time {1e3 * worked:.1f} ms (limit {START:g} ms)")  # fmt: skip


def steps(source: Source, folder: Path) -> None:
    own = folder / "timed"
    own.mkdir()
    (own / "reading.h").write_text(source.example, encoding="utf-8")
    timed = named((Path(__file__).with_name("c_runtime.c")).read_text(encoding="utf-8"), source.name)
    program = compiled_example(replace(source, example=timed), own)
    done = subprocess.run([program, RUN / "loads.csv", "22.0"], capture_output=True, text=True, check=True)
    table = np.array([[float(c) for c in line.split(",")] for line in done.stdout.splitlines()])
    for name, moved in (("axes move, a new factor in every step", 1), ("axes rest, films that follow", 0)):
        of = 1e3 * table[table[:, 3] == moved]
        loads, step = np.median(of[:, 1]), np.median(of[:, 2])
        print(f"   {len(of)} steps of experiment A, {name}: {step:.2f} ms with the last load of the minute, the actual "
              f"position and all poses; the other loads {loads:.2f} ms (processor time)")  # fmt: skip
    correction, memory = (float(c) for c in done.stderr.split())
    print(f"   resident memory at most {memory / 1e3:.1f} MB (limit {MEMORY:g} MB); offsets of the axes at a position: "
          f"{1e6 * correction:.2f} us (limit {CORRECTION:g} us)")  # fmt: skip


def beside_jax(artefact: Artefact) -> None:
    clocks = (("processor time", time.process_time), ("by the clock", time.perf_counter))
    for name, clock in clocks:
        moving, still = (milliseconds(artefact.model, rests, clock)[0] for rests in (False, True))
        print(f"   JAX, {name}, loads evaluated beforehand: {moving:.2f} ms with a new factor, {still:.2f} ms at rest")


def main() -> None:
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        build_artefact(FOLDER, folder / "five_axis.h5", BuildOptions(held_out=1), bar)
        artefact = read_artefact(folder / "five_axis.h5")
        beside_jax(artefact)
        for single in (False, True):
            print(f"   C, {'float32' if single else 'float64'}:")
            own = folder / str(single)
            own.mkdir()
            source = source_of(artefact, single)
            start(compiled_example(source, own), own)
            steps(source, own)
            d = difference(artefact, RUN, single)
            print(f"   largest difference from twin run over experiment A: {d.temperature:.2g} K, "
                  f"{1e6 * d.actual:.2g} um at the actual position, {1e6 * d.poses:.2g} um at all poses")  # fmt: skip


if __name__ == "__main__":
    main()

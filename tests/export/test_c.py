"""The runtime in C, compiled by the C compiler that is there, beside `twin run`."""

from __future__ import annotations

import ctypes
import dataclasses
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import twin
from tests.support.lumped import climbing
from twin.errors import TwinError
from twin.export.c.law_code import arguments_of, law_code
from twin.export.c.measure import compiled_example, difference, table
from twin.export.c.source import source_of
from twin.export.c.text import identifier, named
from twin.logs.read import read_run
from twin.physics.laws import LAWS
from twin.rom.artefact import read_artefact
from twin.rom.load_model import LawUse
from twin.run.correction import PoseErrors, fit_correction
from twin.run.correction_axes import axis_jacobian
from twin.run.replay import replay

ROOT = Path(__file__).parents[2]
SLIDE = ROOT / "tests" / "machines" / "slide" / "runs" / "short"
SPINDLE = ROOT / "tests" / "machines" / "spindle"
SAME, SAME_PLACE = 1e-9, 1e-15  # K, m: nothing but rounding
STRICT = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic")
SHIPPED = {"five_axis": "experiment_a", "ram_borer": "test_5", "transfer_unit": "working_day",
           "ball_screw_axis": "mixed_load", "spindle_drift": "warm_up", "lathe": "warm_up",
           "linear_gantry": "constant_room", "hexapod": "mixed_paths"}  # fmt: skip

pytestmark = [pytest.mark.long, pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc")]


def same(artefact, run):
    d = difference(artefact, run)
    assert d.temperature < SAME
    assert d.actual < SAME_PLACE
    assert d.poses < SAME_PLACE
    assert d.flags == 0


def test_a_meshed_machine_is_stepped_as_twin_run_does(slide_artefact):
    same(read_artefact(slide_artefact), SLIDE)


def test_a_lumped_machine_is_stepped_as_twin_run_does(lumped):
    same(read_artefact(lumped), SPINDLE / "runs" / "warm_up")


def test_a_screw_held_at_both_ends_is_one_in_c(tmp_path):
    text = (SPINDLE / "machine.toml").read_text(encoding="utf-8")
    assert 'fixed_end = "start"' in text
    (tmp_path / "machine.toml").write_text(text.replace('fixed_end = "start"', 'fixed_end = "both"'), encoding="utf-8")
    twin.build(tmp_path, options=twin.BuildOptions(held_out=1)).save(tmp_path / "a.h5")
    same(read_artefact(tmp_path / "a.h5"), SPINDLE / "runs" / "warm_up")


def test_air_that_is_warmer_above_an_axis_that_moves_up_is_so_in_c(tmp_path):
    climbing(tmp_path)
    twin.build(tmp_path, options=twin.BuildOptions(held_out=1)).save(tmp_path / "a.h5")
    artefact = read_artefact(tmp_path / "a.h5")
    same(artefact, SPINDLE / "runs" / "warm_up")
    still = (dataclasses.replace(b, raised=None) for b in artefact.model.bodies)
    still = dataclasses.replace(artefact, model=dataclasses.replace(artefact.model, bodies=tuple(still)))
    warm = [replay(a, read_run(SPINDLE / "runs" / "warm_up")).temperature for a in (artefact, still)]
    assert np.abs(warm[0] - warm[1]).max() > 0.01  # K, that it moves


def test_a_platform_on_struts_is_one_in_c(tmp_path):
    """Twenty minutes of paths in all six directions, by both; the poses are those of the lengths."""
    folder = ROOT / "models" / "hexapod"
    twin.build(folder, options=twin.BuildOptions(held_out=1, hours=0.5, substeps=1)).save(tmp_path / "a.h5")
    run = shutil.copytree(folder / "runs" / "mixed_paths", tmp_path / "run")
    rows = (run / "loads.csv").read_text(encoding="utf-8").splitlines(keepends=True)
    (run / "loads.csv").write_text("".join(rows[:122]), encoding="utf-8")
    artefact = read_artefact(tmp_path / "a.h5")
    same(artefact, run)
    moved = replay(artefact, read_run(run))
    assert np.ptp(moved.position, axis=0).min() > 0.001  # m, of every strut
    assert np.ptp(moved.tcp_actual, axis=0).max() > 1e-6
    twin.export(tmp_path / "a.h5", "c", tmp_path / "m.c")
    command = ["gcc", *STRICT, "-c", tmp_path / "m.c", "-o", tmp_path / "m.o"]
    assert subprocess.run(command, capture_output=True, text=True, check=False).stderr == ""


OFFSETS = """#include "NAME.h"
#include <stdio.h>
int main(void)
{
    static twin_machine m;
    twin_real coefficient[TWIN_POSE_AXES * TWIN_TERMS], at[TWIN_AXES], offset[TWIN_AXES];
    twin_start(&m, 31.0, 60.0);
    twin_correction(&m, coefficient);
    for (;;) {
        for (int a = 0; a < TWIN_AXES; a++)
            if (scanf("%lf", &at[a]) != 1)
                return 0;
        twin_offsets(coefficient, at, offset);
        for (int a = 0; a < TWIN_AXES; a++)
            printf("%.17g\\n", offset[a]);
    }
}
"""


def test_the_offsets_of_the_axes_are_those_of_the_correction(lumped, tmp_path):
    artefact = read_artefact(lumped)
    model, source = artefact.model, source_of(artefact)
    main = named(OFFSETS.replace("NAME", source.name), source.name)
    program = compiled_example(dataclasses.replace(source, example=main), tmp_path)
    states = [(31.0 - model.reference_temperature) * body.one for body in model.bodies]
    tcp = np.asarray(sum(body.G @ x for body, x in zip(model.bodies, states, strict=True)))
    errors = PoseErrors(model.pose_axes, model.pose_grid, model.poses, tcp)
    correction = fit_correction(errors, axis_jacobian(artefact, model.pose_axes))
    low, high = (np.array([edge(g) for g in model.pose_grid]) for edge in (np.min, np.max))
    places = low + np.random.default_rng(3).uniform(-0.2, 1.2, (40, len(low))) * (high - low)  # beyond the poses, too
    told = subprocess.run([program], input=" ".join(map(repr, places.ravel().tolist())), capture_output=True, text=True,
                          check=True)  # fmt: skip
    found = np.array([float(line) for line in told.stdout.split()]).reshape(places.shape)
    assert np.abs(found).max() > 1e-6
    assert np.abs(found - correction.offsets(places)).max() < SAME_PLACE


@pytest.mark.slow
@pytest.mark.parametrize("machine", SHIPPED)
def test_shipped_machines_over_their_scenarios(machine, tmp_path):
    folder = ROOT / "models" / machine
    twin.build(folder, options=twin.BuildOptions(held_out=1)).save(tmp_path / "a.h5")
    same(read_artefact(tmp_path / "a.h5"), folder / "runs" / SHIPPED[machine])


def test_single_precision_has_the_error_that_it_says(slide_artefact, tmp_path):
    told = twin.export(slide_artefact, "c", tmp_path / "m.c", twin.ExportOptions(precision="single", run=SLIDE))
    d = difference(read_artefact(slide_artefact), SLIDE, single=True)
    assert f"{d.temperature:.2g} K" in told[1]
    assert SAME < d.temperature < 0.01
    assert told[1] in (tmp_path / "m.h").read_text(encoding="utf-8")


def test_the_files_compile_without_a_warning_and_take_no_heap(slide_artefact, tmp_path):
    twin.export(slide_artefact, "c", tmp_path / "m.c")
    for name in ("m.c", "m_example.c"):
        subprocess.run(["gcc", *STRICT, "-O2", "-c", name], cwd=tmp_path, check=True)
    symbols = subprocess.run(["nm", "m.o"], cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    wanted = {line.split()[-1] for line in symbols.splitlines() if " U " in line}
    assert not wanted & {"malloc", "calloc", "realloc", "free", "fopen", "printf"}


@pytest.mark.skipif(shutil.which("valgrind") is None, reason="no valgrind")
def test_valgrind_finds_nothing(slide_artefact, tmp_path):
    program = compiled_example(source_of(read_artefact(slide_artefact)), tmp_path)
    done = subprocess.run(
        ["valgrind", "-q", "--error-exitcode=9", "--leak-check=full", str(program), str(SLIDE / "loads.csv"), "22",
         "60", "poses"], capture_output=True, text=True, check=False)  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]


def test_rows_cut_in_two_give_the_same(slide_artefact, tmp_path):
    """A row that is repeated half-way, positions on their linear path, is no other log."""
    rows = (SLIDE / "loads.csv").read_text(encoding="utf-8").splitlines()
    names = [h.partition(" [")[0] for h in rows[0].split(",")]
    values = np.array([[float(c) for c in row.split(",")] for row in rows[1:]])
    straight = [k for k, n in enumerate(names) if n == "time" or n.endswith("_position")]
    twice = np.repeat(values, 2, axis=0)[:-1]
    twice[1::2, straight] = 0.5 * (values[1:, straight] + values[:-1, straight])
    cut = tmp_path / "loads.csv"
    lines = [",".join(repr(float(v)) for v in row) for row in twice]
    cut.write_text("\n".join([rows[0], *lines]) + "\n", encoding="utf-8")
    program = compiled_example(source_of(read_artefact(slide_artefact)), tmp_path)
    once, again = (table(program, path, 22.0, 60.0) for path in (SLIDE / "loads.csv", cut))
    assert np.abs(once[:, 1:-1] - again[:, 1:-1]).max() < SAME


def test_a_signal_without_a_value_is_refused(slide_artefact, tmp_path):
    program = compiled_example(source_of(read_artefact(slide_artefact)), tmp_path)
    loads = tmp_path / "loads.csv"
    loads.write_text("time [s]\n0\n60\n", encoding="utf-8")
    with pytest.raises(TwinError, match="a signal has no value yet"):
        table(program, loads, 22.0, 60.0)


CALLS = ("exp", "log", "sqrt", "tan", "atan", "cos", "sin", "pow", "fmax", "fmin", "fabs", "expm1", "log1p")


def test_every_law_has_the_value_in_c_that_it_has_in_python(tmp_path):
    uses = {}
    code = "#include <math.h>\ntypedef double real;\n#define R(x) x\n"
    code += "".join(f"#define {name.upper()} {name}\n" for name in CALLS)
    code += (ROOT / "twin" / "export" / "c" / "interpolated.c").read_text(encoding="utf-8")
    for name, law in LAWS.items():
        if law.kind == "joint":  # a number by the time a model is built
            continue
        given = {
            a: 1.3 + 0.1 * i if p.default is None else p.default for i, (a, p) in enumerate(law.parameters.items())
        }
        uses[name] = LawUse(name, given, {a: a for a in law.signals})
        code += law_code(f"f_{name}", uses[name]).removeprefix("static ")
        if law.validity:
            code += law_code(f"h_{name}", uses[name], holds=True).removeprefix("static ")
    (tmp_path / "laws.c").write_text(code, encoding="utf-8")
    subprocess.run(["gcc", *STRICT, "-shared", "-fPIC", "-o", "laws.so", "laws.c", "-lm"], cwd=tmp_path, check=True)
    library, random = ctypes.CDLL(str(tmp_path / "laws.so")), np.random.default_rng(1)
    for name, use in uses.items():
        law, arguments = LAWS[name], arguments_of(use)
        for values in (np.zeros(len(arguments)), *random.uniform(-5.0, 60.0, (20, len(arguments)))):
            named = dict(zip(arguments, values, strict=True)) | use.parameters
            own = getattr(library, f"f_{name}")
            own.restype, own.argtypes = ctypes.c_double, [ctypes.c_double] * len(arguments)
            assert own(*values) == pytest.approx(float(law.function(**named)), rel=1e-13, abs=1e-300), name
            if law.validity:
                holds = getattr(library, f"h_{name}")
                holds.restype, holds.argtypes = ctypes.c_int, own.argtypes
                assert bool(holds(*values)) == bool(law.validity.holds(**named)), name


def test_names_are_those_of_c():
    assert identifier("bed.front [1]") == "bed_front__1_"
    assert identifier("1st") == "x_1st"

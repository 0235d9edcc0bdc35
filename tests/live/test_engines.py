"""Both back ends against `twin run`, and their states."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from array import array
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import twin
from twin.errors import TwinError
from twin.face.live import LiveOptions, live
from twin.live.offsets import at, offsets
from twin.live.opened import open_engine
from twin.rom.artefact import read_artefact
from twin.run.correction import fit_correction
from twin.run.correction_file import read_pose_errors
from twin.run.correction_struts import in_struts

pytestmark = pytest.mark.long

HEXAPOD = Path(__file__).parents[2] / "models" / "hexapod"
RUN = Path(__file__).parents[1] / "machines" / "spindle" / "runs" / "warm_up"


@pytest.fixture(scope="module")
def result(spindle):
    return twin.read(spindle).run(RUN).numbers


@pytest.mark.slow
def test_groups_of_fast_rows_do_not_matter(spindle, compiled):
    """Two and a half minutes at 50 Hz, evaluated in pieces while they come; no value where a piece would end."""
    channels = open_engine(spindle, "c", compiled).facts.channels
    rng = np.random.default_rng(5)
    times = 0.02 * np.arange(7500)
    values = np.array([[c.low, c.high - c.low] for c in channels])
    rows = values[:, 0] + values[:, 1] * np.repeat(rng.uniform(size=(150, len(channels))), 50, axis=0)
    rows[1000] = np.nan

    def fed(engine, first, end, size):
        for k in range(first, end, size):
            part = slice(k, min(k + size, end))
            engine.feed(array("d", times[part]), array("d", rows[part].ravel()))

    engines = [open_engine(spindle, "jax", compiled) for _ in range(4)]
    for engine, size in zip(engines[:3], (7500, 1000, 777), strict=True):
        engine.start(21.0)
        fed(engine, 0, 7500, size)
    engines[3].start(21.0)
    fed(engines[3], 0, 4200, 600)
    saved = engines[3].saved()
    engines[3].restore(saved)  # in the middle of a step
    assert engines[3].saved() == saved
    fed(engines[3], 4200, 7500, 600)
    assert engines[0].steps == 2
    assert engines[0].states() == engines[1].states() == engines[2].states() == engines[3].states()
    assert engines[0].saved() == engines[1].saved() == engines[2].saved() == engines[3].saved()
    c = open_engine(spindle, "c", compiled)
    c.start(21.0)
    fed(c, 0, 7500, 1000)
    assert max(c.sensors()) > 21.05
    np.testing.assert_allclose(engines[0].sensors(), c.sensors(), rtol=0, atol=1e-4)


@pytest.fixture(scope="module")
def hexapod(tmp_path_factory):
    path = tmp_path_factory.mktemp("hexapod") / "a.h5"
    twin.build(HEXAPOD, options=twin.BuildOptions(held_out=1, hours=0.5, substeps=1)).save(path)
    return path


# The JAX engine makes a new factor in every step, `twin run` and C keep one as long as films stay near it
@pytest.mark.parametrize(("engine", "kelvin", "metres"), [("c", 1e-9, 1e-13), ("jax", 2e-4, 1e-9)])
def test_a_replay_ends_where_twin_run_ends(engine, kelvin, metres, spindle, state, result, tmp_path):
    out = tmp_path / "c.json"
    options = LiveOptions(engine=engine, speed=0.0, slew="1 mm/s", period="60 s", initial="20 degC")
    runtime = live(spindle, f"replay:{RUN}", [f"file:{out}"], state, options)
    facts = runtime.intake.engine.facts
    np.testing.assert_allclose(runtime.intake.engine.sensors(), result.temperature[-1], rtol=0, atol=kelvin)
    expected = offsets(facts, result.tcp[-1].ravel(), "grid")
    assert np.abs(expected).max() > 1e-6
    found = json.loads(out.read_text())
    np.testing.assert_allclose(found["offsets"]["x"], expected[0], rtol=0, atol=metres)
    assert found["mode"] == "following"
    step = json.loads((state / "step.json").read_text())  # what `twin serve` draws the machine from
    assert step["step"] == len(result.time) - 1
    scale = np.abs(result.states[-1]).max()  # hundreds: coordinates of modes, not K
    np.testing.assert_allclose(step["states"], result.states[-1], rtol=0, atol=kelvin * scale)
    np.testing.assert_allclose(np.reshape(step["displacements_m"], (-1, 3)), result.tcp[-1], rtol=0, atol=metres)
    np.testing.assert_allclose(step["positions_m"], result.position[-1], rtol=0, atol=1e-9)


@pytest.mark.parametrize("engine", ["c", "jax"])
def test_a_state_goes_on_bit_by_bit(engine, spindle, compiled):
    one, other = (open_engine(spindle, engine, compiled) for _ in range(2))
    rng = np.random.default_rng(3)
    channels = one.facts.channels

    def rows(first, n):
        times = array("d", [7.0 * (first + i) for i in range(n)])
        values = [[rng.uniform(c.low, c.high) for c in channels] for _ in range(n)]
        return times, array("d", np.ravel(values).tolist())

    one.start(21.0)
    one.feed(*rows(0, 20))
    other.restore(one.saved())
    more = rows(20, 30)
    assert one.feed(*more) == other.feed(*more) > 2
    assert one.saved() == other.saved()
    assert one.displacements() == other.displacements()


@pytest.mark.parametrize("engine", ["c", pytest.param("jax", marks=pytest.mark.slow)])
def test_the_struts_of_a_platform_are_corrected(engine, hexapod, tmp_path):
    """Twenty minutes of paths in all six directions: offsets are those of `twin correction`."""
    run = shutil.copytree(HEXAPOD / "runs" / "mixed_paths", tmp_path / "run")
    rows = (run / "loads.csv").read_text(encoding="utf-8").splitlines(keepends=True)
    (run / "loads.csv").write_text("".join(rows[:122]), encoding="utf-8")
    twin.read(hexapod).run(run).save(tmp_path / "result")
    errors, _ = read_pose_errors(tmp_path / "result", read_artefact(hexapod).digest)
    model = read_artefact(hexapod).model
    struts = in_struts(replace(errors, model=model))
    expected = fit_correction(struts, np.eye(6))
    out, state = tmp_path / "c.json", tmp_path / "state"
    for form in ("grid", "polynomial"):
        options = LiveOptions(engine=engine, form=form, speed=0.0, slew="1 mm/s", period="60 s", initial="21 degC",
                              fresh=True)  # fmt: skip
        live(hexapod, f"replay:{run}", [f"file:{out}"], state, options)
        found = json.loads(out.read_text())
        assert list(found["offsets"]) == [f"strut_{k}_length" for k in range(1, 7)]
        facts = open_engine(hexapod, engine, state / "engine").facts
        values = tuple(map(tuple, found["offsets"].values()))
        assert np.abs(values).max() > 1e-6
        for pose in (struts.poses[0], struts.poses[40], np.zeros(6)):
            there = [at(facts, own, form, pose) for own in values]
            np.testing.assert_allclose(there, expected.offset(pose), rtol=0, atol=3e-9)
    with pytest.raises(TwinError, match="which of six struts"):
        live(hexapod, f"replay:{run}", [], state, replace(options, events=tmp_path))


def test_polynomial_and_grid_agree_at_the_poses(spindle, compiled, result):
    facts = open_engine(spindle, "c", compiled).facts
    tcp = result.tcp[-1].ravel()
    grid, polynomial = offsets(facts, tcp, "grid"), offsets(facts, tcp, "polynomial")
    for k, position in enumerate(facts.pose_grid[0]):
        there = at(facts, grid[0], "grid", [position])
        assert there == pytest.approx(grid[0][k], abs=1e-15)
        assert at(facts, polynomial[0], "polynomial", [position]) == pytest.approx(there, abs=2e-8)


def test_the_c_engine_needs_neither_jax_nor_numpy(spindle, state, tmp_path):
    code = (
        "import sys\nfrom twin.cli.main import run\n"
        f"status = run(['live', {str(spindle)!r}, '--source', 'replay:{RUN}', '--speed', '0', "
        f"'--out', 'file:{tmp_path}/c.json', '--state', {str(state)!r}])\n"
        "heavy = {'numpy', 'jax', 'scipy', 'pint', 'h5py'} & set(sys.modules)\n"
        "print(heavy)\nsys.exit(status or len(heavy))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr

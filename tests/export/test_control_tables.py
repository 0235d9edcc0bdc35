"""Control tables: parsed back as a control reads them, and applied to the full finite-element model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

import twin
from tests.reference.exports import read_tables
from twin.build.pipeline import full_model
from twin.build.stepper import CoupledStepper
from twin.build.volumetric import displacements
from twin.errors import TwinError
from twin.export.beckhoff import write_beckhoff
from twin.export.control_table import Source
from twin.export.generic import write_generic
from twin.export.heidenhain import write_heidenhain
from twin.export.siemens import write_siemens
from twin.logs.read import read_run
from twin.logs.signals import signal_values
from twin.machine.load import load_machine
from twin.rom.artefact import read_artefact
from twin.rom.drive import evaluate
from twin.run.correction import PoseErrors
from twin.run.correction_axes import axis_jacobian
from twin.run.correction_file import read_pose_errors
from twin.run.replay import replay
from twin.run.results import write_results

pytestmark = pytest.mark.long

ROOT = Path(__file__).parents[2]
FORMATS = {
    "siemens": write_siemens,
    "beckhoff": write_beckhoff,
    "heidenhain": write_heidenhain,
    "generic": write_generic,
}


@dataclass(frozen=True)
class Case:
    """A table's source by the reduced model, and the truth: the full model's error anywhere."""

    source: Source
    truth: Callable[[np.ndarray], np.ndarray]  # positions (m, n_axes) m -> (m, 3) m
    places: np.ndarray  # (m, n_axes) m at which tables are judged; none of them is a point of a table


def full_truth(folder: Path, name: str, hours: float) -> Callable[[np.ndarray], np.ndarray]:
    """The full model stepped through a run of a machine; its TCP error at the end, at any positions."""
    full = full_model(load_machine(folder))
    model, run = full.thermal, read_run(folder / "runs" / name)
    drive = evaluate(
        model.load_model, run.loads.time, signal_values(run, model.load_model.signals), 60.0, round(60 * hours)
    )
    stepper = CoupledStepper(model)
    assert run.initial_temperature is not None
    for _, x, _ in stepper.run(drive, stepper.uniform(run.initial_temperature), 1):
        last = x
    return lambda position: displacements(full.structure, position, [last])[0]


def case(path: Path, folder: Path, name: str, hours: float, result: Path) -> Case:
    artefact = read_artefact(path)
    if not (result / "result.h5").exists():
        write_results(result, replay(artefact, read_run(folder / "runs" / name)), {})
    errors, time = read_pose_errors(result, artefact.digest, 3600.0 * hours)
    errors = replace(errors, model=artefact.model)
    source = Source(errors, axis_jacobian(artefact, errors.axes), artefact.model.name, artefact.digest, time)
    low, high = [g[0] for g in errors.grid], [g[-1] for g in errors.grid]
    places = np.random.default_rng(5).uniform(low, high, (300, len(low)))
    return Case(source, full_truth(folder, name, hours), places)


@pytest.fixture(scope="module")
def slide(slide_artefact, slide_result) -> Case:
    folder = ROOT / "tests" / "machines" / "slide"
    run = read_run(folder / "runs" / "short")
    hours = float(run.loads.time[-1] - run.loads.time[0]) / 3600.0
    return case(slide_artefact, folder, "short", hours, slide_result)


@pytest.fixture(scope="module")
def five_axis(tmp_path_factory) -> Case:
    """Four hours of experiment A: the X axis has moved, and what it heats is about to cool."""
    folder, where = ROOT / "models" / "five_axis", tmp_path_factory.mktemp("five_axis")
    twin.build(folder, options=twin.BuildOptions(held_out=1)).save(where / "a.h5")
    return case(where / "a.h5", folder, "experiment_a", 4.0, where / "result")


def share_left(case: Case, offsets: Callable[[np.ndarray], np.ndarray], which: list[int]) -> float:
    """rms of the full model's error that stays, over that without a table, of some components."""
    added = offsets(case.places)
    after = case.truth(case.places + added) + added @ case.source.jacobian.T
    before = case.truth(case.places)
    return float(np.linalg.norm(after[:, which]) / np.linalg.norm(before[:, which]))


def written(case: Case, name: str, folder: Path):
    path = folder / (name if name == "heidenhain" else f"{name}.txt")
    found = FORMATS[name](path, case.source)
    axes, offsets = getattr(read_tables, name)(path)
    assert [a.lower() for a in axes] == list(case.source.errors.axes)
    return found, offsets


@pytest.mark.parametrize("name", FORMATS)
def test_one_axis(name, slide, tmp_path):
    """What the axis of the small machine can correct, the error along x, is corrected; told is what is left."""
    found, offsets = written(slide, name, tmp_path)
    assert share_left(slide, offsets, [0]) < 0.10
    # and what the file says is what the full model says: largest along x, and across it, where no axis moves
    after = slide.truth(slide.places + offsets(slide.places)) + offsets(slide.places) @ slide.source.jacobian.T
    assert np.abs(after[:, 1:]).max() == pytest.approx(found.after[1:].max(), rel=0.05)
    assert found.uncorrectable[1:] == pytest.approx(found.before[1:])
    assert found.uncorrectable[0] < 1e-12


@pytest.mark.slow
@pytest.mark.parametrize("name", FORMATS)
def test_three_axes(name, five_axis, tmp_path):
    """Tables over all positions leave less than a tenth; a line per axis cannot, and its file says how much."""
    found, offsets = written(five_axis, name, tmp_path)
    left = share_left(five_axis, offsets, [0, 1, 2])
    if name in ("generic", "heidenhain"):
        assert left < 0.10
    else:
        assert 0.2 < left < 0.6
    assert left == pytest.approx(found.share, rel=0.15, abs=0.005)


def planted(error: np.ndarray) -> Source:
    """The same error (3,) [m] at all poses; y carries the work."""
    grid = (np.array([-0.2, 0.0, 0.3]),) * 3
    poses = np.array(np.meshgrid(*grid, indexing="ij")).reshape(3, -1).T
    errors = PoseErrors(("x", "y", "z"), grid, poses, np.tile(error, (27, 1)))
    return Source(errors, np.diag([1.0, -1.0, 1.0]), "m", "0" * 64, 0.0)


@pytest.mark.parametrize("name", FORMATS)
def test_ten_too_far_is_ten_back(name, tmp_path):
    """+10 um of error gives -10 um of offset; of an axis that carries the work the opposite."""
    path = tmp_path / ("t" if name == "heidenhain" else "t.txt")
    found = FORMATS[name](path, planted(np.array([10e-6, 10e-6, -20e-6])))
    _, offsets = getattr(read_tables, name)(path)
    np.testing.assert_allclose(offsets(np.array([[0.1, 0.2, -0.1]])), [[-10e-6, 10e-6, 20e-6]], atol=1e-12)
    assert found.share < 1e-6


def test_a_grid_as_json_is_the_grid_as_csv(slide, tmp_path):
    for suffix in ("csv", "json"):
        write_generic(tmp_path / f"grid.{suffix}", slide.source)
    one, other = (read_tables.generic(tmp_path / f"grid.{suffix}")[1](slide.places) for suffix in ("csv", "json"))
    np.testing.assert_allclose(one, other, atol=1e-15)
    assert np.abs(one).max() > 1e-6


def test_heads_say_what_is_left(slide, tmp_path):
    write_siemens(tmp_path / "s.spf", slide.source)
    text = (tmp_path / "s.spf").read_text()
    for said in ("MD32750", "+10 um error: -10 um", "largest left by this table", "cannot express", "M17"):
        assert said in text
    assert all(line.startswith(("; ", "$SA_", "M17")) for line in text.splitlines())


def test_a_folder_with_something_else_is_not_replaced(slide, tmp_path):
    (tmp_path / "program.h").write_text("0 BEGIN PGM")
    with pytest.raises(TwinError, match=r"program\.h"):
        write_heidenhain(tmp_path, slide.source)
    assert [p.name for p in tmp_path.iterdir()] == ["program.h"]


def test_a_slope_that_no_heat_makes_is_refused(tmp_path):
    source = planted(np.zeros(3))
    steep = replace(source.errors, tcp=0.02 * source.errors.poses)
    with pytest.raises(TwinError, match="MD32760"):
        write_siemens(tmp_path / "s.spf", replace(source, errors=steep))
    assert not list(tmp_path.iterdir())

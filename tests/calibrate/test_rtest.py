"""R-tests in run folders: rows, measurements, placings of the ball, and the errors that come back from files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from twin.calibrate.axis_errors.chain import parse_chain
from twin.calibrate.axis_errors.errors import Ranges, axis_errors
from twin.calibrate.axis_errors.htm import measured_displacement
from twin.calibrate.axis_errors.rtest import Readings, ball_columns, measurements, parts, readings
from twin.calibrate.axis_errors.rtest_model import model_errors, read_pose_history
from twin.calibrate.axis_errors.rtest_plan import Plan, planned, rtest_plan
from twin.errors import LogError, TwinError
from twin.logs.read import read_run
from twin.logs.run import Run, Table, Tcp
from twin.logs.write import write_run
from twin.rom.hdf5_file import put, put_attributes, scale, writing
from twin.run.results import FORMAT

CHAIN = parse_chain("w-C-B-Z-b-X-Y-t")
CENTRE = {"Y": -0.06, "Z": -0.55}
NOISE = 1e-6  # m
HOUR = 3600.0


def growth(hour: float) -> dict[str, float]:
    """Errors that grow with the hours, other ones of each name."""
    return {e.name: hour * (k - 8) * (1e-6 if e.unit == "m" else 3e-6) for k, e in enumerate(axis_errors(CHAIN))}


def hourly(hours: tuple[float, ...] = (0.0, 1.0, 2.0), misplaced: float = 0.0, kind: str = "circles") -> Tcp:
    """An R-test at each hour; every placing of the ball is off by `misplaced` [m]."""
    rng = np.random.default_rng(0)
    plans = [rtest_plan(CHAIN, kind, centre=CENTRE, start=hour * HOUR) for hour in hours]
    rows = []
    for hour, plan in zip(hours, plans, strict=True):
        offset = misplaced * rng.normal(size=(2, 3))[plan.ball]
        ranges = Ranges.of(CHAIN, plan.position)
        exact = measured_displacement(CHAIN, ranges, growth(hour), plan.position, plan.angle, offset)
        rows.append(exact + NOISE * rng.normal(size=exact.shape))
    return replace(planned(plans, NOISE), displacement=np.vstack(rows))


def run_of(tcp: Tcp | None) -> Run:
    time = np.arange(0.0, 3 * HOUR, 60.0)
    return Run(Table(time, {"current": 0.0 * time}, {"current": "A"}), tcp=tcp, synthetic=("loads", "tcp"))


def read_back(folder: Path, tcp: Tcp) -> Readings:
    write_run(folder, run_of(tcp))
    return readings(read_run(folder), CHAIN)


def test_errors_come_back_from_a_run_folder(tmp_path):
    found = measurements(read_back(tmp_path / "run", hourly()), CHAIN)
    assert [round(m.readings.time[0] / HOUR) for m in found] == [0, 1, 2]
    for hour, m in enumerate(found):
        assert m.fit.rank == 17
        for name, value, sigma in zip(m.fit.names, m.fit.value, m.fit.sigma, strict=True):
            if np.isfinite(value):
                assert abs(value - growth(hour)[name]) < 4.5 * sigma, (hour, name)
    assert np.linalg.norm(found[2].rms) > 5 * np.linalg.norm(found[0].rms)


def test_the_example_is_what_the_plan_gives():
    """`tests/calibrate/r_tests`, the example of the command, is written by `run_of(hourly(kind="indexed"))`."""
    shipped = readings(read_run(Path(__file__).parent / "r_tests"), CHAIN)
    planned_again = readings(run_of(hourly(kind="indexed")), CHAIN)
    np.testing.assert_allclose(shipped.position, planned_again.position, atol=1e-9)
    np.testing.assert_allclose(shipped.displacement, planned_again.displacement, atol=1e-12)
    for letter in "BC":
        np.testing.assert_allclose(shipped.angle[letter], planned_again.angle[letter], atol=1e-7)


def test_balls_put_anywhere(tmp_path):
    """Off by 0.2 mm each time: taken as known this is a misfit, fitted it does not hurt."""
    read = read_back(tmp_path / "run", hourly(misplaced=2e-4))
    assert all(m.fit.misfit for m in measurements(read, CHAIN))
    for hour, m in enumerate(measurements(read, CHAIN, known_balls=False)):
        assert (m.balls, m.fit.rank, m.fit.misfit) == (2, 16, False)
        for name, value in m.fit.values().items():
            sigma = m.fit.sigma[m.fit.names.index(name)]
            assert abs(value - growth(hour)[name]) < 4.5 * sigma, (hour, name)


def test_rows_in_any_order_and_incomplete_ones():
    tcp = hourly()
    rng = np.random.default_rng(1)
    order = rng.permutation(len(tcp.time))
    displacement = tcp.displacement.copy()
    displacement[3, 1] = np.nan
    mixed = Tcp(
        tcp.time[order],
        tcp.axes,
        tcp.position[order],
        displacement[order],
        tcp.sigma[order],
        angle={name: values[order] for name, values in tcp.angle.items()},
    )
    read = readings(run_of(mixed), CHAIN)
    assert len(read.time) == len(tcp.time) - 1
    assert (np.diff(read.time) > 0.0).all()
    np.testing.assert_allclose(
        read.position[:, 0], np.delete(tcp.position[:, 1], 3), atol=1e-9
    )  # Y first, of the chain
    found = measurements(read, CHAIN)
    assert found[1].fit.values()["ECZ"] == pytest.approx(growth(1.0)["ECZ"], abs=20e-6)


def test_measurements_are_distinguished_by_time():
    time = np.array([0.0, 10.0, 20.0, 700.0, 710.0, 5000.0])
    assert [p.tolist() for p in parts(time, 600.0)] == [[0, 1, 2], [3, 4], [5]]
    assert [len(p) for p in parts(time, 1e4)] == [6]
    assert parts(np.zeros(0), 600.0) == []


def test_short_measurements_are_passed_over_unless_all_are_short():
    tcp = hourly((0.0, 1.0))
    keep = np.flatnonzero((tcp.time < 0.5 * HOUR) | (tcp.time < HOUR + 40.0))
    short = readings(run_of(tcp), CHAIN).take(keep)
    found = measurements(short, CHAIN)
    assert found[0].fit is not None
    assert found[1].fit is None
    assert (len(found[1].readings.time), found[1].needed) == (5, 10)
    with pytest.raises(LogError, match="5 rows in the longest measurement; 10 are needed"):
        measurements(found[1].readings, CHAIN)
    with pytest.raises(LogError, match="0 rows"):
        measurements(short.take(np.zeros(0, dtype=int)), CHAIN)


def test_missing_columns_are_named():
    with pytest.raises(LogError, match=r"no tcp\.csv"):
        readings(run_of(None), CHAIN)
    tcp = hourly((0.0,))
    with pytest.raises(LogError, match="no positions of axis Z") as e:
        readings(run_of(replace(tcp, axes=("x", "y", "q"))), CHAIN)
    assert "'z [mm]'" in e.value.problems[0].remedy
    blind = readings(run_of(replace(tcp, angle={"b": tcp.angle["b"]})), CHAIN)
    with pytest.raises(LogError, match="no angles of axis C"):
        measurements(blind, CHAIN, known_balls=False)
    gap = {**tcp.angle, "c": np.where(np.arange(len(tcp.time)) == 4, np.nan, tcp.angle["c"])}
    with pytest.raises(LogError, match="angle of axis C is missing"):
        measurements(readings(run_of(replace(tcp, angle=gap)), CHAIN), CHAIN, known_balls=False)


@pytest.mark.parametrize("chain", ["w-C-B'-Z-b-X-Y-t", "w-B-C-Z-b-X-Y-t", "w-C-B-Z'-b-X-Y-t", "w-C-B-b-X-Y-Z-t"])
def test_a_chain_that_does_not_follow_the_ball_is_refused(chain):
    """Senses, order and sides: the logged positions tell whether they are right."""
    wrong = parse_chain(chain)
    read = readings(run_of(hourly((0.0,), kind="indexed")), wrong)
    with pytest.raises(LogError, match="miss a ball on the table by"):
        measurements(read, wrong, known_balls=False)


def test_senses_that_are_turned_round_in_the_log():
    """A table whose angle counts left-handed, with the prime that says so."""
    tcp = hourly((1.0,))
    turned = replace(tcp, angle={"b": -tcp.angle["b"], "c": tcp.angle["c"]})
    chain = parse_chain("w-C-B'-Z-b-X-Y-t")
    (found,) = measurements(readings(run_of(turned), chain), chain, known_balls=False)
    (usual,) = measurements(readings(run_of(tcp), CHAIN), CHAIN, known_balls=False)
    np.testing.assert_allclose(found.fit.value, usual.fit.value)


def test_placings_are_found_by_the_pauses():
    plan: Plan = rtest_plan(CHAIN, "circles", centre=CENTRE, stands=(-0.2, -0.3, -0.4))
    read = readings(run_of(plan.tcp(np.zeros((len(plan.time), 3)))), CHAIN)
    columns = ball_columns(read, CHAIN)
    assert len(columns) == 3
    for k, block in enumerate(columns):
        np.testing.assert_array_equal(np.abs(block).sum(axis=(1, 2)) > 0.0, plan.ball == k)


def result(
    path: Path, time: np.ndarray, tcp: np.ndarray, grid: np.ndarray, axes: tuple[str, ...] = ("x", "y", "z")
) -> Path:
    with writing(path) as f:
        put_attributes(f, {"format": FORMAT, "artefact": "none", "substeps": 4})
        scale(f, "time", time, "s")
        scale(f, "pose_axis", axes)
        put(f, "pose_position", grid, "m")
        put(f, "tcp", tcp, "m")
    return path


def test_errors_of_a_computed_field(tmp_path):
    """A result whose field is planted errors, growing with time: found at the R-test's poses, and all of the volume."""
    nodes = [np.linspace(-0.4, 0.4, 3)] * 3
    grid = np.stack(np.meshgrid(*nodes, indexing="ij"), axis=-1).reshape(-1, 3)  # x, y, z
    tcp = hourly((1.0, 2.0))
    read = readings(run_of(tcp), CHAIN)
    ranges = Ranges.of(CHAIN, read.position)  # errors hold at the R-test's ranges
    field = measured_displacement(CHAIN, ranges, growth(1.0), grid[:, [1, 0, 2]])
    time = np.array([0.0, HOUR, 3 * HOUR])
    path = result(tmp_path / "result.h5", time, time[:, None, None] / HOUR * field, grid)
    found = measurements(read, CHAIN)
    told = model_errors(read_pose_history(tmp_path), CHAIN, read, found)
    for m, model in zip(found, told, strict=True):
        hours = m.readings.time[[0, -1]].mean() / HOUR
        assert model.outside == 0
        assert model.shares.rest < 1e-6
        for name, value in model.fit.values().items():
            assert value == pytest.approx(hours * growth(1.0)[name], abs=2e-8), name
    with pytest.raises(TwinError, match="its poses are of x, y, z"):
        model_errors(read_pose_history(path), parse_chain("w-b-X-Y-t"), read, found)
    late = result(tmp_path / "late.h5", time + 1.5 * HOUR, np.zeros((3, 27, 3)), grid)
    with pytest.raises(TwinError, match=r"computed from 1\.50 to 4\.50 h, measured at 1\.05 h"):
        model_errors(read_pose_history(late), CHAIN, read, found)
    small = result(tmp_path / "small.h5", time, np.zeros((3, 27, 3)), 0.1 * grid)
    assert model_errors(read_pose_history(small), CHAIN, read, found)[0].outside > 10


def test_other_files_are_no_results(tmp_path):
    with pytest.raises(TwinError, match="not a result"):
        read_pose_history(tmp_path)
    with h5py.File(tmp_path / "a.h5", "w") as f:
        f.attrs["format"] = "twin artefact"
    with pytest.raises(TwinError, match="not a result"):
        read_pose_history(tmp_path / "a.h5")

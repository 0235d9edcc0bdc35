"""Measured beside simulated: times, positions, references, and what is left out."""

from dataclasses import replace

import numpy as np
import pytest
import synthetic
import synthetic_run

from twin.calibrate.score.compare import channels, left_out
from twin.errors import LogError
from twin.logs.run import Run, Table, Tcp
from twin.rom.artefact import Artefact, read_artefact
from twin.run.replay import replay
from twin.run.results import Result

pytestmark = pytest.mark.long

MODEL = synthetic.machine()
HALF_STEP = 30.0  # s


@pytest.fixture(scope="module")
def artefact(tmp_path_factory) -> Artefact:
    return read_artefact(synthetic_run.artefact(tmp_path_factory.mktemp("compare") / "a.h5", MODEL))


@pytest.fixture(scope="module")
def base() -> Run:
    return synthetic_run.run(MODEL, hours=1.0)


@pytest.fixture(scope="module")
def result(artefact, base) -> Result:
    return replay(artefact, base)


def table(time: np.ndarray, **columns: np.ndarray) -> Table:
    return Table(time, columns, dict.fromkeys(columns, "degC"))


def test_temperatures_are_compared_where_they_were_measured(artefact, base, result):
    time = np.array([-60.0, 0.0, 60.0, 90.0, 1800.0, 99999.0])
    measured = np.array([1.0, 2.0, np.nan, 4.0, 5.0, 6.0])
    run = replace(base, temperatures=table(time, T03=measured, nobody=measured, T01=np.full(6, np.nan)))
    (channel,) = channels(artefact, run, result)
    assert (channel.name, channel.kind, channel.unit) == ("T03", "temperature", "degC")
    np.testing.assert_array_equal(channel.time, [0.0, 90.0, 1800.0])
    np.testing.assert_array_equal(channel.measured, [2.0, 4.0, 5.0])
    column = result.temperature[:, result.sensors.index("T03")]
    expected = [column[0], 0.5 * (column[1] + column[2]), column[30]]
    np.testing.assert_allclose(channel.simulated, expected, rtol=1e-13)
    told = left_out(run, result)
    assert told.unknown == ("nobody",)
    assert "T00" in told.unmeasured
    assert "T03" not in told.unmeasured
    assert (told.temperature_rows, told.tcp_rows) == (2, 0)


def test_tcp_is_compared_at_the_measured_time_and_pose(artefact, base, result):
    """At a pose of the grid and at an edge in time, the row is the result's own; half a step later, the mean of two."""
    poses = np.array([4, 7, 7, 2])
    time = np.array([600.0, 1200.0, 1200.0 + HALF_STEP, 1e6])
    sigma = np.array([1e-6, 2e-6, 3e-6, 4e-6])
    displacement = np.arange(12.0).reshape(4, 3) * 1e-6
    displacement[1, 1] = np.nan
    tcp = Tcp(
        time, ("z_unused", "y", "x"), np.column_stack([np.zeros(4), MODEL.poses[poses][:, ::-1]]), displacement, sigma
    )
    found = channels(artefact, replace(base, tcp=tcp), result)
    assert [c.name for c in found] == ["dx", "dy", "dz"]
    for axis, channel in enumerate(found):
        rows = [0, 2] if axis == 1 else [0, 1, 2]
        halfway = 0.5 * (result.tcp[20, 7, axis] + result.tcp[21, 7, axis])
        expected = np.array([result.tcp[10, 4, axis], result.tcp[20, 7, axis], halfway])[rows]
        np.testing.assert_allclose(channel.simulated, expected, rtol=1e-12)
        np.testing.assert_array_equal(channel.measured, displacement[rows, axis])
        np.testing.assert_array_equal(channel.sigma, sigma[rows])
        np.testing.assert_array_equal(channel.position, MODEL.poses[poses[rows]])
    assert left_out(replace(base, tcp=tcp), result).tcp_rows == 1


def test_tcp_at_the_logged_position_is_the_result_s_own(artefact, base, result):
    """Where the loads say the machine stood, that is `tcp_actual`; without a position nothing is guessed."""
    position = result.position[5:9][:, [result.axes.index(a) for a in ("x", "y")]]
    tcp = Tcp(result.time[5:9], ("x", "y"), position, np.ones((4, 3)))
    found = channels(artefact, replace(base, tcp=tcp), result)
    np.testing.assert_allclose(np.column_stack([c.simulated for c in found]), result.tcp_actual[5:9], rtol=1e-12)
    with pytest.raises(LogError, match="no position of y"):
        channels(artefact, replace(base, tcp=replace(tcp, axes=("x",), position=position[:, :1])), result)


def test_deviations_from_the_first_row(artefact, base, result):
    time = np.array([120.0, 1200.0, 2400.0])
    position = np.tile(MODEL.poses[4], (3, 1))
    tcp = Tcp(time, ("x", "y"), position, np.zeros((3, 3)))
    absolute = channels(artefact, replace(base, tcp=tcp), result)
    relative = channels(artefact, replace(base, tcp=tcp, tcp_reference="first"), result)
    for a, r in zip(absolute, relative, strict=True):
        np.testing.assert_allclose(r.simulated, a.simulated[1:] - a.simulated[0], rtol=1e-12)
        np.testing.assert_array_equal(r.time, time[1:])
    early = replace(tcp, time=np.array([-5.0, 1200.0, 2400.0]))
    with pytest.raises(LogError, match="first row"):
        channels(artefact, replace(base, tcp=early, tcp_reference="first"), result)


def test_rows_without_place_or_beyond_the_poses_are_counted(artefact, base, result):
    position = np.array([[0.4, 0.4], [np.nan, 0.4], [0.9, 0.4], [0.4, 0.4]])
    displacement = np.ones((4, 3))
    displacement[3] = np.nan
    tcp = Tcp(np.full(4, 60.0), ("x", "y"), position, displacement)
    run = replace(base, tcp=tcp)
    told = left_out(run, result)
    assert (told.tcp_rows, told.tcp_incomplete, told.tcp_outside_grid) == (0, 2, 1)
    assert {len(c.time) for c in channels(artefact, run, result)} == {2}

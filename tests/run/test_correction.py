"""Correction polynomials: the anchors of paper 001's errata, axis offsets, files, and the command."""

import itertools
import json
import shutil
from dataclasses import replace

import h5py
import numpy as np
import pytest
from click.testing import CliRunner

from tests.calibrate import lumped_case
from twin.build.displacement_field import DisplacementField
from twin.build.pipeline import full_model
from twin.build.surface import patch
from twin.cli.correction import command
from twin.cli.main import run
from twin.errors import ModelError, TwinError
from twin.machine.bodies import bodies_of
from twin.machine.kinematics import direction, linear_axes, moved_bodies
from twin.machine.load import load_machine
from twin.rom.artefact import read_artefact
from twin.rom.elastic_ports import cross_matrix
from twin.rom.tcp import by_body, tcp_at, tcp_rows, tilt_at
from twin.run.correction import PoseErrors, corrected_error, default_degrees, fit_correction, quality
from twin.run.correction_axes import _tool_sign, axis_jacobian, offset_matrix, uncorrectable
from twin.run.correction_file import read_correction, read_pose_errors, write_correction
from twin.run.correction_polynomial import (
    NormalisedAxis,
    design_matrix,
    fit_full,
    fit_product,
    fit_without_constant,
    normalised_axes,
)
from twin.run.correction_rotary import fit_rotary, geometric_jacobian, rotary_axes

GRID = (np.array([0.0, 0.5, 1.0]),) * 3
POSES = np.array(list(itertools.product(*GRID)))
CARTESIAN = np.diag([1.0, -1.0, 1.0])  # the second axis carries the work


def anchor() -> np.ndarray:
    """The field 10 + 3x + 2y - 4z + xz of E-001-1 at 27 poses, x, y, z in [-1, 1]."""
    x, y, z = (2.0 * POSES - 1.0).T
    return 10.0 + 3.0 * x + 2.0 * y - 4.0 * z + x * z


def bent(position: np.ndarray) -> np.ndarray:
    """A TCP error (m, 3) [m] of some 40 um that no polynomial of low degree meets."""
    x, y, z = position.T
    return 1e-6 * np.column_stack(
        [
            20.0 * np.sin(2.0 * x) + 8.0 * y * z,
            -15.0 + 10.0 * np.exp(x * y),
            25.0 * np.cos(1.5 * z) + 5.0 * x,
        ]
    )


def grid_errors(count: int) -> PoseErrors:
    grid = (np.linspace(0.0, 1.0, count),) * 3
    poses = np.array(list(itertools.product(*grid)))
    return PoseErrors(("x", "y", "z"), grid, poses, bent(poses))


def test_product_form_misses_the_anchor_that_the_full_form_meets():
    axes = normalised_axes("xyz", POSES, (2, 2, 2))
    values = anchor()[:, None]
    full = fit_full(axes, POSES, values)
    assert full.coefficients.size == 27
    np.testing.assert_allclose(full(POSES), values, atol=1e-12)
    product = fit_product(axes, POSES, values).expanded()
    assert np.abs(product(POSES) - values).max() == pytest.approx(4.03, abs=0.005)
    separable = np.prod(1.0 + POSES * np.array([0.5, -0.3, 2.0]), axis=1)[:, None]
    np.testing.assert_allclose(fit_product(axes, POSES, separable).expanded()(POSES), separable, rtol=1e-8)


def test_condition_of_normalised_axes_and_of_millimetres():
    axes = normalised_axes("xyz", POSES, (2, 2, 2))
    assert np.linalg.cond(design_matrix(axes, POSES)) == pytest.approx(33.56, abs=0.01)
    raw = np.array([0.0, 500.0, 1000.0])[:, None] ** np.arange(3)
    assert np.linalg.cond(raw) ** 3 == pytest.approx(1.1e18, rel=0.01)  # of the Kronecker product


def test_values_of_the_polynomial_by_hand():
    axes = normalised_axes("xyz", POSES, (2, 1, 0))
    full = fit_full(axes, POSES, np.column_stack([POSES[:, 0] ** 2 * POSES[:, 1], 3.0 + 0.0 * POSES[:, 0]]))
    place = np.array([[0.3, 0.8, 0.1], [1.0, 0.2, 0.9]])
    np.testing.assert_allclose(full(place), [[0.3**2 * 0.8, 3.0], [0.2, 3.0]], atol=1e-12)
    for p in place:
        np.testing.assert_allclose(full.at(p), full(p[None])[0], rtol=1e-12, atol=1e-13)
    beyond = np.array([[1.4, 0.8, 0.5]])  # held at the border
    np.testing.assert_allclose(full(beyond), full(np.array([[1.0, 0.8, 0.5]])))
    np.testing.assert_allclose(full.at(beyond[0]), full(beyond)[0])


def test_least_squares_with_more_poses_than_coefficients():
    errors = grid_errors(5)
    correction = fit_correction(errors, CARTESIAN, (2, 2, 2))
    found = quality(correction, errors)
    assert correction.polynomial.coefficients.size == 81
    misfit = errors.tcp - correction.polynomial(errors.poses)
    normal = design_matrix(correction.polynomial.axes, errors.poses).T @ misfit
    assert np.abs(normal).max() < 1e-16  # the misfit is orthogonal to what can be fitted
    assert (found.residual_rms < found.residual).all()
    assert found.residual.max() < 0.02 * found.before.max()


def test_too_few_poses_name_the_degree_that_fits():
    with pytest.raises(TwinError, match="needs 5 positions, the poses have 3") as caught:
        fit_correction(grid_errors(3), CARTESIAN, (2, 4, 2))
    assert "--degree 2" in str(caught.value)


def test_along_one_screw_with_and_without_a_constant():
    z = np.linspace(-0.4, 0.4, 5)[:, None]
    bearing = -0.5
    from_bearing = z - bearing
    shape = 1e-6 * (60.0 * from_bearing - 30.0 * from_bearing**2 + 10.0 * from_bearing**4)
    values = np.hstack([np.zeros((5, 2)), shape])
    errors = PoseErrors(("z",), (z[:, 0],), z, values)
    assert default_degrees(errors) == (4,)
    (axis,) = normalised_axes("z", z, (4,))
    held = fit_without_constant(axis, bearing, z, values)
    np.testing.assert_allclose(held(z), values, atol=1e-17)  # four coefficients, five poses, the true shape
    # four supporting positions are met exactly (paper 001, 1.16), and the bearing too
    noisy = values[1:] + 1e-6 * np.random.default_rng(1).standard_normal((4, 3))
    four = NormalisedAxis("z", 0.1, 0.3, 4)  # all of z[1:]
    exact = fit_without_constant(four, bearing, z[1:], noisy)
    np.testing.assert_allclose(exact(z[1:]), noisy, atol=1e-17)
    s_zero = (bearing - four.centre) / four.half_range
    np.testing.assert_allclose(exact.coefficients @ s_zero ** np.arange(5), 0.0, atol=1e-17)
    # a bearing that moves by 7 um: with a constant nothing is left, without it something is (E-001-3)
    moved = PoseErrors(("z",), (z[:, 0],), z, values + np.array([0.0, 0.0, 7e-6]))
    along_z = np.array([[0.0], [0.0], [1.0]])
    assert quality(fit_correction(moved, along_z), moved).residual[2] < 1e-15
    assert quality(fit_correction(moved, along_z, (2,), zero_at=bearing), moved).residual[2] > 0.5e-6


def test_no_constant_is_for_one_axis_and_the_full_form():
    with pytest.raises(TwinError, match="along one axis"):
        fit_correction(grid_errors(3), CARTESIAN, zero_at=0.0)


def test_offsets_cancel_the_error_to_first_order(capsys):
    errors = grid_errors(3)
    correction = fit_correction(errors, CARTESIAN)
    offsets = correction.offsets(errors.poses)
    np.testing.assert_allclose(offsets, -errors.tcp * np.array([1.0, -1.0, 1.0]), atol=1e-18)
    np.testing.assert_allclose([correction.offset(p) for p in errors.poses], offsets, atol=1e-18)
    left = corrected_error(correction, errors, errors.poses)
    gradient = 40e-6  # of the field per metre: the machine now stands up to 40 um elsewhere
    assert 0.0 < np.abs(left).max() < 3.0 * gradient * np.abs(errors.tcp).max()  # nanometres, of second order
    # first order: with the error scaled down by ten, a hundredth is left
    small = PoseErrors(errors.axes, errors.grid, errors.poses, errors.tcp / 10.0)
    less = corrected_error(fit_correction(small, CARTESIAN), small, small.poses)
    np.testing.assert_allclose(np.abs(less).max(), np.abs(left).max() / 100.0, rtol=1e-3)
    # in between the polynomial misses the true field; the poses cannot know
    places = np.random.default_rng(0).uniform(0.0, 1.0, (200, 3))
    moved = correction.offsets(places)
    rest = bent(places + moved) + moved @ CARTESIAN.T
    with capsys.disabled():
        print(f"\n  left at the poses {1e9 * np.abs(left).max():.2g} nm, in between {1e6 * np.abs(rest).max():.2f} um "
              f"of {1e6 * np.abs(errors.tcp).max():.0f} um")  # fmt: skip
    assert np.abs(rest).max() < 0.05 * np.abs(errors.tcp).max()
    again = quality(correction, errors)
    np.testing.assert_allclose(again.after, np.abs(left).max(axis=0))


def test_tilt_stays_and_is_reported():
    rng = np.random.default_rng(3)
    error = np.hstack([1e-5 * rng.standard_normal((4, 3)), 2e-5 * rng.standard_normal((4, 3))])  # m, rad
    jacobian = np.vstack([CARTESIAN, np.zeros((3, 3))])  # linear axes turn nothing
    rest = uncorrectable(jacobian, error)
    np.testing.assert_allclose(rest[:, :3], 0.0, atol=1e-19)
    np.testing.assert_allclose(rest[:, 3:], error[:, 3:])
    np.testing.assert_allclose(offset_matrix(jacobian)[:, :3], -CARTESIAN)


def test_missing_axes_leave_their_direction():
    error = np.array([[3e-6, -4e-6, 5e-6]])
    skew = np.array([[1.0, 0.0], [0.0, 0.0], [1.0, 1.0]]) / np.array([np.sqrt(2.0), 1.0])  # not at right angles
    np.testing.assert_allclose(uncorrectable(skew, error), [[0.0, -4e-6, 0.0]], atol=1e-20)
    offset = error @ offset_matrix(skew).T
    np.testing.assert_allclose(error + offset @ skew.T, [[0.0, -4e-6, 0.0]], atol=1e-20)
    with pytest.raises(ModelError, match="same way"):
        offset_matrix(np.array([[1.0, -1.0], [0.0, 0.0], [0.0, 0.0]]))


def test_rotary_axes_take_up_a_tilt():
    # an x axis and a table that turns about y, 0.2 m below the TCP
    jacobian = np.array([[1.0, 0.2], [0, 0], [0, 0], [0, 0], [0, 1.0], [0, 0]])
    error = np.array([[4e-6, 0, 0, 0, 3e-5, 0]])
    np.testing.assert_allclose(uncorrectable(jacobian, error, lever=0.5), 0.0, atol=1e-19)
    np.testing.assert_allclose(error @ offset_matrix(jacobian, lever=0.5).T, [[-4e-6 + 0.2 * 3e-5, -3e-5]])


@pytest.mark.parametrize("path", ["models/five_axis", "tests/machines/slide"])
def test_axes_of_the_artefact_agree_with_the_kinematics_of_the_description(path, pytestconfig):
    import tomllib

    machine = load_machine(pytestconfig.rootpath / path)
    written = tomllib.loads((pytestconfig.rootpath / path / "machine.toml").read_text(encoding="utf-8"))
    body = {part: b.name for b in bodies_of(machine) for part in b.parts}
    sides = [body[side.surface.split(".")[0]] for side in (machine.tcp.tool, machine.tcp.work)]
    for axis in linear_axes(machine):
        moved = moved_bodies(machine, axis)
        assert _tool_sign(written, axis) == int(sides[0] in moved) - int(sides[1] in moved) != 0
        assert np.linalg.norm(direction(machine, axis)) == pytest.approx(1.0)


def test_side_of_a_lumped_machine():
    written = {
        "nodes": {"table": {}, "nut": {}},
        "bars": {"screw": {}},
        "axes": {"x": {"carries": ["nut"]}},
        "contacts": {
            "nut": {"kind": "moving", "axis": "x", "pairs": [["screw", "nut"]]},
            "table": {"kind": "fixed", "surfaces": ["table", "nut"]},
        },
        "tcp": {"screws": {"screw": "tool"}},
    }
    assert _tool_sign(written, "x") == 1
    written["tcp"]["screws"]["screw"] = "work"
    assert _tool_sign(written, "x") == -1
    written["axes"]["x"]["carries"] = ["screw"]  # the screw travels, the nut with the work stands still
    assert _tool_sign(written, "x") == 1


def test_file_comes_back(tmp_path):
    errors = grid_errors(3)
    for form in ("full", "product"):
        correction = fit_correction(errors, CARTESIAN, form=form)
        path = tmp_path / f"{form}.json"
        write_correction(path, correction, quality(correction, errors), {"machine": "m"})
        back = read_correction(path)
        assert back.form == form
        np.testing.assert_array_equal(back.offsets(errors.poses), correction.offsets(errors.poses))
    told = json.loads((tmp_path / "full.json").read_text())
    # as the file says how: by its numbers alone
    place = np.array([0.2, 0.7, 0.4])
    s = [(p - a["centre_m"]) / a["half_range_m"] for p, a in zip(place, told["axes"], strict=True)]
    terms = [np.prod([v**e for v, e in zip(s, exponents, strict=True)]) for exponents in told["exponents"]]
    error = [np.dot(terms, c) for c in told["coefficients_m"]]
    full = fit_correction(errors, CARTESIAN)
    np.testing.assert_allclose(np.dot(told["offset_per_error"], error), full.offset(place), atol=1e-18)
    (tmp_path / "other.json").write_text("{}")
    with pytest.raises(TwinError, match="not a correction"):
        read_correction(tmp_path / "other.json")


def call(*arguments):
    return CliRunner().invoke(command, [str(a) for a in arguments], catch_exceptions=False)


def test_command(slide_artefact, slide_result, tmp_path):
    path = tmp_path / "correction.json"
    told = call(slide_artefact, slide_result, "-o", path)
    assert told.exit_code == 0
    assert "15 coefficients in full form for x" in told.output
    assert "in directions that no axis moves in" in told.output
    digest = read_artefact(slide_artefact).digest
    errors, at = read_pose_errors(slide_result, digest)
    with h5py.File(slide_result / "result.h5") as f:
        np.testing.assert_array_equal(errors.tcp, f["tcp"][-1])
        assert at == f["time"][-1] - f["time"][0]
    correction = read_correction(path)
    written = json.loads(path.read_text())
    assert written["tool_motion_per_axis_motion"] == [[1.0, 0.0, 0.0]]  # the plate with the tool is on the slide
    assert written["artefact"] == digest
    assert np.abs(errors.tcp[:, 0]).max() > 1e-7
    # five poses, degree four: x is cancelled at every pose, y and z stay
    left = corrected_error(correction, errors, errors.poses)
    assert np.abs(left[:, 0]).max() < 1e-3 * np.abs(errors.tcp[:, 0]).max()
    np.testing.assert_allclose(left[:, 1:], errors.tcp[:, 1:], atol=1e-3 * np.abs(errors.tcp).max())
    np.testing.assert_allclose(written["uncorrectable_um"][1:], 1e6 * np.abs(errors.tcp[:, 1:]).max(axis=0))
    assert written["uncorrectable_um"][0] < 1e-9


def test_command_options(slide_artefact, slide_result, tmp_path):
    path = tmp_path / "c.json"
    with h5py.File(slide_result / "result.h5") as f:
        times, tcp = f["time"][...], f["tcp"][...]
    told = call(slide_artefact, slide_result, "-o", path, "--time", f"{times[3] - times[0]} s", "--degree", "x=2")
    assert "9 coefficients" in told.output
    written = json.loads(path.read_text())
    assert written["time_s"] == times[3] - times[0]
    assert written["before_um"] == pytest.approx((1e6 * np.abs(tcp[3]).max(axis=0)).tolist())
    told = call(slide_artefact, slide_result, "-o", path, "--form", "product")
    assert "compressed" in told.output
    told = call(slide_artefact, slide_result, "-o", path, "--zero-at", "-350 mm")
    c = json.loads(path.read_text())
    s = (-0.35 - c["axes"][0]["centre_m"]) / c["axes"][0]["half_range_m"]
    np.testing.assert_allclose(np.array(c["coefficients_m"]) @ s ** np.arange(5), 0.0, atol=1e-17)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (("--time", "900 h"), "the run lasts"),
        (("--time", "-1 h"), "--time"),
        (("--degree", "z=2"), "no axis 'z'"),
        (("--degree", "two"), "no degree"),
        (("--degree", "7"), "needs 8 positions"),
        (("--degree", "99"), "degree 99 along axis 'x' needs 100 positions, the poses have 5"),
        (("--degree", "9" * 5000), "no degree"),
        (("--zero-at", "-600.1 mm"), "far outside the stroke of axis 'x', -200 to 200 mm"),
        (("--zero-at", "5 m"), "far outside the stroke"),
        (("--zero-at", "3 kg"), "--zero-at"),
        (("--zero-at", "0 mm", "--form", "product"), "along one axis"),
    ],
)
def test_bad_options_say_what_to_write(options, told, slide_artefact, slide_result, tmp_path):
    with pytest.raises(TwinError) as caught:
        call(slide_artefact, slide_result, "-o", tmp_path / "c.json", *options)
    assert told in str(caught.value)
    assert not (tmp_path / "c.json").exists()


def test_results_of_other_artefacts_are_refused(slide_artefact, slide_result, tmp_path):
    with pytest.raises(TwinError, match="not a result"):
        call(slide_artefact, slide_artefact, "-o", tmp_path / "c.json")
    with pytest.raises(TwinError, match="not a result"):
        call(slide_artefact, tmp_path, "-o", tmp_path / "c.json")
    shutil.copy(slide_result / "result.h5", tmp_path / "result.h5")
    with h5py.File(tmp_path / "result.h5", "a") as f:
        f.attrs["artefact"] = "0" * 64
    with pytest.raises(TwinError, match="another artefact"):
        call(slide_artefact, tmp_path, "-o", tmp_path / "c.json")


@pytest.mark.parametrize("content", [b"time [s],x [m]\n0,1\n", b"{}", b"[1]", b"", b"\xff\x00"])
def test_other_files_are_not_replaced(content, tmp_path, capsys):
    """Told before anything is read: there is neither an artefact nor a result."""
    path = tmp_path / "loads.csv"
    path.write_bytes(content)
    assert run(["correction", str(tmp_path / "a.h5"), str(tmp_path / "result"), "-o", str(path)]) == 2
    told = capsys.readouterr().err
    assert "loads.csv" in told
    assert "not replaced" in told
    assert "Traceback" not in told
    assert path.read_bytes() == content


def test_errors_between_the_poses_are_those_of_the_model_where_it_has_its_structure():
    model = lumped_case.artefact().model
    state = 5.0 * np.random.default_rng(2).normal(size=model.n)
    at_poses = tcp_at(model, by_body(model, state), model.poses)
    errors = PoseErrors(model.pose_axes, model.pose_grid, model.poses, at_poses, model, state)
    position = np.random.default_rng(3).uniform(model.poses.min(), model.poses.max(), (7, 1))
    wanted = np.array([sum(G[k] @ x for G, x in zip(tcp_rows(model, position), by_body(model, state), strict=True))
                       for k in range(7)])  # fmt: skip
    np.testing.assert_allclose(errors.at(position), wanted, atol=1e-9 * np.abs(wanted).max())
    interpolated = replace(errors, model=None).at(position)
    assert np.abs(interpolated - wanted).max() > 1e-3 * np.abs(wanted).max()
    np.testing.assert_allclose(errors.at(model.poses), at_poses, rtol=1e-12, atol=1e-15)


def test_plus_ten_is_minus_ten():
    """A tool that stands 10 um too far is moved 10 um back; an axis that carries the work goes the other way."""
    errors = PoseErrors(("x", "y", "z"), GRID, POSES, np.full((27, 3), 10e-6))
    offset = fit_correction(errors, CARTESIAN).offset([0.4, 0.1, 0.9])
    np.testing.assert_allclose(offset, [-10e-6, 10e-6, -10e-6], atol=1e-18)


def patch_rotation(full, displacement, surface: str) -> np.ndarray:
    """(3,) [rad]: least-squares rigid rotation of a patch's nodes in the full model's displacement field."""
    part, _, face = surface.partition(".")
    for body, u in zip(full.bodies, displacement, strict=True):
        if any(p.name == part for p in body.parts):
            mesh, offset = body.part(part)
            whole = patch(mesh, mesh.facets(face))
            nodes, weight = whole.nodes + offset, np.sqrt(np.abs(whole.mean))[:, None]  # area of each node
            rows = [
                w * np.hstack([np.eye(3), -cross_matrix(r)]) for w, r in zip(weight, body.nodes[nodes], strict=True)
            ]
            return np.linalg.lstsq(np.vstack(rows), (weight * u[nodes]).ravel(), rcond=None)[0][3:]
    raise AssertionError(surface)


def test_tilt_is_that_of_the_full_displacement_field(slide_artefact):
    machine = load_machine("tests/machines/slide")
    full = full_model(machine)
    rise = [8.0 * b.nodes[:, 2] + 5.0 * b.nodes[:, 0] * (1 + i) + 3.0 for i, b in enumerate(full.bodies)]
    u = DisplacementField(machine, full.bodies, full.structure)({"x": 0.13}, rise)
    tool, work = (patch_rotation(full, u, side.surface) for side in (machine.tcp.tool, machine.tcp.work))
    told = tilt_at(full.thermal, rise, np.array([[0.13]]))
    assert np.abs(told).max() > 5e-6
    np.testing.assert_allclose(told[0], tool - work, atol=0.02 * np.abs(tool - work).max())
    # the artefact says the same of states that stand for the same field
    artefact = read_artefact(slide_artefact)
    states = np.random.default_rng(0).normal(size=artefact.model.n)
    x = by_body(artefact.model, states)
    errors = PoseErrors(artefact.model.pose_axes, artefact.model.pose_grid, artefact.model.poses,
                        tcp_at(artefact.model, x, artefact.model.poses), artefact.model, states)  # fmt: skip
    correction = fit_correction(errors, np.eye(3)[:, :1])
    np.testing.assert_allclose(quality(correction, errors).tilt, np.abs(errors.tilt).max(axis=0))


WITH_ROTARY = """
[axes.c]
kind = "rotary"
direction = [0.0, 0.0, 1.0]
point = ["120 mm", -0.05, "80 mm"]
carries = ["bed"]
position = "x_position"
"""


def turned(p: np.ndarray, angle: float) -> np.ndarray:
    """A point turned about the axis of WITH_ROTARY, exactly."""
    c, s = np.cos(angle), np.sin(angle)
    at = np.array([0.12, -0.05, 0.08])
    return at + np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ (p - at)


def test_geometric_jacobian_is_the_derivative_of_exact_motions(slide_artefact):
    artefact = read_artefact(slide_artefact)
    artefact = replace(artefact, description=artefact.description + WITH_ROTARY)
    (axis,) = rotary_axes(artefact)
    J = geometric_jacobian(artefact, ("x",), (axis,), {"x": 0.13})
    tool = artefact.model.structure.system.tool_point + np.array([0.13, 0.0, 0.0])  # the slide carries the tool
    step = 1e-5
    work = (turned(tool, step) - turned(tool, -step)) / (2.0 * step)  # the work turns away under the tool
    np.testing.assert_allclose(J[:, 1], [*-work, 0.0, 0.0, -1.0], atol=1e-9)
    np.testing.assert_allclose(J[:, 0], [1.0, 0.0, 0.0, 0.0, 0.0, 0.0], atol=1e-12)


def test_a_rotary_axis_takes_up_the_tilt_about_it(slide_artefact, slide_result, tmp_path):
    plain = read_artefact(slide_artefact)
    artefact = replace(plain, description=plain.description + WITH_ROTARY)
    errors, _ = read_pose_errors(slide_result, artefact.digest)
    errors = replace(errors, model=artefact.model)
    found = fit_rotary(artefact, errors)
    tilt = errors.tilt
    assert found.axes == ("x", "c")
    # tilt about x and y stays; that about z is weighed against dy, which turning makes: together less is left
    np.testing.assert_allclose(found.left_tilt[:2], np.abs(tilt[:, :2]).max(axis=0))
    before = np.hstack([errors.tcp[:, 1:2], 0.1 * tilt[:, 2:]])
    after = []
    for pose, w, r, offset in zip(errors.poses, errors.tcp, tilt, found.polynomial(errors.poses), strict=True):
        tool = artefact.model.structure.system.tool_point + np.array([pose[0], 0.0, 0.0])
        moved = w + [offset[0], 0.0, 0.0] - (turned(tool, offset[1]) - tool)
        after.append([moved[1], 0.1 * (r[2] - offset[1])])
        assert abs(moved[0]) < 0.02 * np.abs(errors.tcp[:, 0]).max()  # the polynomial's misfit
    assert np.linalg.norm(after) < 0.9 * np.linalg.norm(before)
    correction = fit_correction(errors, axis_jacobian(artefact, errors.axes))
    write_correction(tmp_path / "c.json", correction, quality(correction, errors), {}, found)
    told = json.loads((tmp_path / "c.json").read_text())["with_rotary_axes"]
    assert told["units"] == ["m", "rad"]
    np.testing.assert_allclose(told["left_tilt_urad"], 1e6 * found.left_tilt)


def test_no_rotary_axis_to_correct_with(slide_artefact, slide_result, tmp_path):
    with pytest.raises(TwinError, match="no rotary axis"):
        call(slide_artefact, slide_result, "-o", tmp_path / "c.json", "--rotary")
    assert not (tmp_path / "c.json").exists()


@pytest.mark.parametrize("angles", ["c=30 deg", "30 deg", ""])
def test_angles_are_of_axes_that_turn(slide_artefact, slide_result, tmp_path, angles):
    with pytest.raises(TwinError, match="turns tool or work"):
        call(slide_artefact, slide_result, "-o", tmp_path / "c.json", "--angles", angles)
    assert not (tmp_path / "c.json").exists()

"""Rotary axes in the structure, against the machine meshed as it stands when they have turned."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from twin.build.coupled_direct import assemble_coupled
from twin.build.full_model import FullModel, assemble
from twin.build.mesh import BodyMesh, body_mesh, part_mesh
from twin.build.pipeline import positions_off_grid, rich_model
from twin.build.rich_basis import RichOptions
from twin.build.scenario import draw
from twin.build.stepper import CoupledStepper
from twin.build.structure import Structure
from twin.errors import TwinError
from twin.machine.bodies import bodies_of
from twin.machine.description import Machine
from twin.machine.load import load_machine
from twin.machine.parameters import parameters
from twin.machine.turning import pieces_of, standing_axes, turning_axes
from twin.rom.artefact import Artefact, read_artefact, write_artefact
from twin.rom.parallel import rotated
from twin.rom.tcp import at_positions, by_body, row_weights, tcp_at, tcp_rows, tilt_at
from twin.run.correction import PoseErrors
from twin.run.correction_axes import offset_matrix
from twin.run.correction_rotary import fit_rotary, geometric_jacobian, rotary_axes

SLIDE = Path(__file__).parents[1] / "machines" / "slide"
# A turntable on the slide that carries a tilting head, which carries the tool; both stay within what they turn on.
MORE = """
[parts.head]
material = "steel"
box = { origin = [0.06, -0.01, 0.205], size = [0.03, 0.02, 0.02], divisions = [2, 2, 2] }

[axes.c]
kind = "rotary"
direction = [0.0, 0.0, 2.0]
point = [0.0, 0.0, 0.0]
carries = ["plate"]
position = "c_position"

[axes.a]
kind = "rotary"
direction = [1.0, 0.0, 0.0]
point = ["0 mm", "0 mm", "215 mm"]
carries = ["head"]
position = "a_position"

[contacts.a_bearing]
kind = "fixed"
surfaces = ["head.x_min", "plate.x_max"]
conductance = "3000 W/(m^2*K)"

[signals.c_position]
unit = "deg"
range = [-180, 180]
default = 0.0

[signals.a_position]
unit = "deg"
range = [-120, 120]
default = 0.0
"""


EDITS = (
    ('surfaces = ["slide.*", "plate.*",', 'surfaces = ["slide.*", "plate.*", "head.*",'),
    ('surface = "plate.z_max"\npoint = [0.0, 0.0, 0.28]', 'surface = "head.x_max"\npoint = [0.15, 0.0, 0.28]'),
)


def described(folder: Path, *edits: tuple[str, str]) -> Machine:
    text = (SLIDE / "machine.toml").read_text(encoding="utf-8") + MORE
    for old, new in (*EDITS, *edits):
        assert old in text, old
        text = text.replace(old, new)
    (folder / "machine.toml").write_text(text, encoding="utf-8")
    return load_machine(folder)


@pytest.fixture(scope="module")
def machine(tmp_path_factory) -> Machine:
    return described(tmp_path_factory.mktemp("turning"))


@pytest.fixture(scope="module")
def full(machine) -> FullModel:
    return assemble(machine)


def meshed_as_turned(machine: Machine, bodies: tuple[BodyMesh, ...], angles: dict[str, float]) -> tuple[BodyMesh, ...]:
    """The meshes with their nodes where the axes bring them, outermost axis first."""

    def turned(x: np.ndarray, part: str) -> np.ndarray:
        for t in reversed(turning_axes(machine)):
            if part in t.parts:
                axis = machine.axes[t.axis]
                R = rotated(angles[t.axis] * np.array(axis.direction) / np.linalg.norm(axis.direction))
                x = np.array(axis.point) + (x - axis.point) @ R.T
        return x

    found = []
    for body in bodies:
        parts = []
        for part in body.parts:
            mesh = type(part.mesh)(np.ascontiguousarray(turned(part.mesh.p.T, part.name).T), part.mesh.t)
            parts.append(part_mesh(part.name, mesh, part.surfaces))
        found.append(body_mesh(body.name, tuple(parts)))
    return tuple(found)


def fields(full: FullModel, seed: int) -> list[np.ndarray]:
    """Smooth ones that differ from part to part, K."""
    rng = np.random.default_rng(seed)
    found = []
    for body, thermal in zip(full.bodies, full.thermal.bodies, strict=True):
        T = np.zeros(thermal.n)
        for part, first in zip(body.parts, body.offsets, strict=True):
            T[first : first + part.n] = rng.uniform(-5, 5) + part.nodes @ rng.uniform(-20, 20, 3)
        found.append(T)
    return found


def test_what_turns_and_on_what(machine):
    first, second = turning_axes(machine)
    assert (first.axis, first.parts, first.bearing, first.sign) == ("c", ("plate", "head"), ("plate",), 1)
    assert (second.axis, second.parts) == ("a", ("head",))
    assert second.surfaces == (("plate.x_max", "head.x_min"),)  # what it turns on comes first
    assert standing_axes(machine) == {}
    slide = next(b for b in bodies_of(machine) if b.name == "slide")
    assert [p.parts[-1] for p in pieces_of(slide, turning_axes(machine))] == ["nut", "plate", "head"]


@pytest.mark.parametrize(
    ("edit", "reason"),
    [
        (("point = [0.0, 0.0, 0.0]\n", ""), "no `point` says where it lies"),
        (('carries = ["plate"]', 'carries = ["slide", "pad_1"]'), "guides, supports"),
        (('carries = ["head"]', 'carries = ["bed"]'), "guides, supports"),
        (('carries = ["head"]', 'carries = ["plate"]'), "another axis turns the same parts"),
        (('carries = ["plate"]', 'carries = ["plate", "bed"]'), "several bodies"),
    ],
)
def test_why_an_axis_turns_nothing(tmp_path, edit, reason):
    (told,) = standing_axes(described(tmp_path, edit)).values()
    assert reason in told


def test_a_turning_axis_needs_an_angle(tmp_path):
    with pytest.raises(TwinError, match="expected a unit of rad"):
        assemble(described(tmp_path, ('unit = "deg"\nrange = [-120, 120]', 'unit = "mm"\nrange = [-120, 120]')))


@pytest.mark.long
def test_it_bends_as_if_meshed_as_it_stands(machine, full):
    """Random angles and positions: within 5 % of what turning changes."""
    rng = np.random.default_rng(7)
    ours, wanted, straight = [], [], []
    for seed in range(3):
        angles = {"c": rng.uniform(-np.pi, np.pi), "a": rng.uniform(-2.0, 2.0)}
        coupled = assemble_coupled(machine, meshed_as_turned(machine, full.bodies, angles))
        x = {"x": rng.uniform(-0.2, 0.2)}
        T = fields(full, seed)
        centre = full.structure.system.tool_centre({**x, **angles}) - [x["x"], 0.0, 0.0]
        object.__setattr__(coupled.system, "tool_point", centre)
        wanted.append(coupled.displacement(x, T))
        ours.append(full.structure.displacement({**x, **angles}, T))
        straight.append(full.structure.displacement(x, T))
    ours, wanted, straight = np.array(ours), np.array(wanted), np.array(straight)
    assert np.abs(wanted - straight).max() > 10e-6
    assert np.abs(ours - wanted).max() < 0.05 * np.abs(wanted - straight).max()  # of boxes of few elements


def test_at_angles_zero_nothing_changes(machine, full):
    plain = machine.model_copy(update={"axes": {"x": machine.axes["x"]}})
    structure, T = assemble(plain).structure, fields(full, 5)
    assert isinstance(full.structure, Structure)
    assert structure.cut is None
    for at in ({"x": 0.1}, {"x": 0.1, "c": 0.0, "a": 0.0}):
        np.testing.assert_allclose(full.structure.displacement(at, T), structure.displacement({"x": 0.1}, T), rtol=1e-9)


def test_a_full_turn_is_none(full):
    T = fields(full, 6)
    turned = full.structure.displacement({"x": 0.1, "c": 2 * np.pi, "a": 0.0}, T)
    np.testing.assert_allclose(turned, full.structure.displacement({"x": 0.1}, T), rtol=1e-6)


def test_rows_states_and_tilt_follow_angles(full):
    model, T = full.thermal, fields(full, 8)
    positions = np.array([[0.1, 0.8, -0.5], [-0.1, 0.0, 0.0], [0.15, -2.0, 1.0]])
    assert model.turning == ("c", "a")
    wanted = np.array([full.structure.displacement(p, T) for p in positions])
    np.testing.assert_allclose(tcp_at(model, T, positions), wanted, atol=1e-12)
    by_rows = sum(G @ t for G, t in zip(tcp_rows(model, positions), T, strict=True))
    np.testing.assert_allclose(by_rows, wanted, atol=1e-12)
    np.testing.assert_allclose(tcp_at(model, T, positions[:, :1]), tcp_at(model, T, positions * [1, 0, 0]), atol=1e-15)
    # tilt is what moves points of the tool apart
    tilt = tilt_at(model, T, positions)
    assert np.abs(tilt[0] - tilt_at(model, T, positions[:, :1])[0]).max() > 1e-5
    _, outside = row_weights(model, positions)
    assert outside.tolist() == [True, False, True]  # the grid's poses have angles zero
    drawn = positions_off_grid(model, 3)
    assert drawn.shape == (20, 3)
    assert np.abs(drawn[:, 1]).max() > 2.0


@pytest.fixture(scope="module")
def stored(machine, full, tmp_path_factory) -> Artefact:
    """As a build leaves it, with states as they come."""
    reduced = rich_model(machine, full, RichOptions(samples=6))
    bare = replace(reduced, bodies=tuple(replace(b, F=None) for b in reduced.bodies))
    path = tmp_path_factory.mktemp("artefact") / "a.h5"
    text = (machine.folder / "machine.toml").read_text(encoding="utf-8")
    write_artefact(path, bare, description=text, parameters=parameters(machine))
    return read_artefact(path)


def test_a_model_without_its_structure_has_the_rows_at_angles_that_it_was_given(full):
    """As the window model of a calibration and the model of a diagnosis are."""
    positions = np.array([[0.1, 0.8, -0.5], [-0.1, 0.0, 0.0]])
    bare = replace(at_positions(full.thermal, positions), structure=None)
    assert bare.turning == full.thermal.turning
    weights, outside = row_weights(bare, positions)
    assert not outside.any()
    T = fields(full, 8)
    wanted = [full.structure.displacement(p, T) for p in positions]
    np.testing.assert_allclose(tcp_at(bare, T, positions), wanted, atol=1e-12)
    assert (weights.max(axis=1) == 1.0).all()


def test_the_artefact_keeps_what_turns(full, stored):
    """Read back, it tells of a warm machine what the full model does, wherever its axes stand."""
    drive = draw(full.thermal.load_model, 5, hours=0.5).drive
    assert np.abs(drive.angle).max() > 1.0
    last = []
    for model in (full.thermal, stored.model):
        stepper = CoupledStepper(model)
        *_, (_, x, _) = stepper.run(drive, stepper.uniform(28.0))
        last.append(x)
    positions = positions_off_grid(full.thermal, 1)
    wanted, found = (tcp_at(m, x, positions) for m, x in zip((full.thermal, stored.model), last, strict=True))
    assert np.abs(wanted).max() > 10e-6
    assert np.abs(found - wanted).max() < 0.05e-6


def test_offsets_follow_the_angle(stored):
    """-J^-1 w: linear and rotary offsets leave no displacement, and no tilt about the axes as they stand."""
    model, angles = stored.model, (0.9, -0.6)
    state = 3.0 * np.random.default_rng(2).normal(size=model.n)
    at_zero = tcp_at(model, by_body(model, state), model.poses)
    errors = PoseErrors(model.pose_axes, model.pose_grid, model.poses, at_zero, model, state).turned(angles)
    assert np.abs(errors.tcp - at_zero).max() > 0.01 * np.abs(at_zero).max()
    axes = rotary_axes(stored)
    at = {"x": 0.1, "c": angles[0], "a": angles[1]}
    J = geometric_jacobian(stored, ("x",), axes, at)
    centre, system = model.structure.system.tool_centre, model.structure.system
    for k, axis in enumerate(("x", "c", "a")):
        step = 1e-6
        moved = (centre({**at, axis: at[axis] + step}) - centre({**at, axis: at[axis] - step})) / (2 * step)
        np.testing.assert_allclose(J[:3, k], moved, atol=1e-8)
    assert system.turning == ("c", "a")
    found = fit_rotary(stored, errors)
    assert found.axes == ("x", "c", "a")
    # three axes, six components: what is left is square to all their motions, in the norm of the fit
    J = geometric_jacobian(stored, ("x",), axes, {"x": float(model.poses[0, 0]), "c": angles[0], "a": angles[1]})
    rest = np.append(errors.tcp[0], errors.tilt[0])
    weighted = np.append(np.ones(3), np.full(3, 0.1))[:, None]
    assert np.abs(J[3:, 1:].T @ J[3:, 1:] - np.eye(2)).max() < 1e-12  # a's axis is square to c's
    offset = offset_matrix(J, 0.1) @ rest
    assert np.abs((weighted * J).T @ (weighted[:, 0] * (rest + J @ offset))).max() < 1e-9 * np.abs(rest).max()

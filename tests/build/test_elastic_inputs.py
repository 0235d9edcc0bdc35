"""The TCP displacement at every position from few rows of the temperatures: full, reduced, stored, calibrated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.calibrate import lumped_case
from tests.support.descriptions import edited
from twin.build.full_model import FullModel, assemble
from twin.build.pipeline import rich_model
from twin.build.rich_basis import RichOptions
from twin.build.scenario import draw
from twin.build.stepper import CoupledStepper
from twin.build.structure import Structure
from twin.machine.description import Encoder
from twin.machine.load import load_machine
from twin.machine.parameters import parameters
from twin.rom import tcp
from twin.rom.apply import with_values
from twin.rom.artefact import read_artefact, write_artefact
from twin.rom.model import MachineModel
from twin.rom.tcp import at_positions, is_exact, row_weights, tcp_at, tcp_over, tcp_rows

SCALE = '[scales.x_glass]\naxis = "x"\nsurface = "bed.y_min"\nexpansion = "40e-6 1/K"\nfixed_at = "-50 mm"\n\n'
TANK = '[tanks.oil]\nsurface = "bed.x_max"\ncapacity = "5 kJ/K"\nconductance = "10 W/K"\n\n'  # one more state
BEFORE = "[signals.x_position]"
ENCODER = Encoder(kind="linear", scale="bed.y_min", reader="slide.y_min", fixed_at=-0.3, expansion=8e-6)


@pytest.fixture(scope="module")
def machine(tmp_path_factory):
    """The slide machine with all that the rows may read: ports, a tank's state, a linear encoder, an added scale."""
    given = load_machine(edited(tmp_path_factory.mktemp("inputs"), (BEFORE, SCALE + TANK + BEFORE)))
    return given.model_copy(update={"axes": {"x": given.axes["x"].model_copy(update={"encoder": ENCODER})}})


@pytest.fixture(scope="module")
def full(machine) -> FullModel:
    return assemble(machine)


@pytest.fixture(scope="module")
def reduced(machine, full) -> MachineModel:
    return rich_model(machine, full, RichOptions(samples=6))


@pytest.fixture(scope="module")
def positions(full) -> np.ndarray:
    """Random ones, ends of the stroke, and where pads and the nut pass stations: there the rows have their kinks."""
    assert isinstance(full.structure, Structure)
    kinks = np.concatenate([g.rail.stations - g.pad.centroid @ g.along for g in full.structure.system.guides])
    inside = kinks[np.abs(kinks) <= 0.2]
    assert len(inside) > 5
    return np.concatenate([np.random.default_rng(0).uniform(-0.2, 0.2, 20), [-0.2, 0.2], inside])[:, None]


@pytest.fixture(scope="module")
def states(full, reduced) -> dict[str, list[np.ndarray]]:
    """Of the full and the reduced model after an hour of a scenario."""
    found = {}
    drive = draw(reduced.load_model, 5, hours=1.0).drive
    for name, model in {"full": full.thermal, "reduced": reduced}.items():
        stepper = CoupledStepper(model)
        *_, (_, found[name], _) = stepper.run(drive, stepper.uniform(28.0))
    return found


def random_fields(model: MachineModel, seed: int) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    return [10.0 * rng.normal(size=b.n) for b in model.bodies]


def without_structure(model: MachineModel) -> MachineModel:
    """As artefacts were before they had it."""
    bodies = tuple(replace(b, W=None, W_members=None) for b in model.bodies)
    return replace(model, bodies=bodies, structure=None)


def test_rows_of_the_full_model_are_its_structure(full, positions):
    x = random_fields(full.thermal, 1)
    wanted = np.array([full.structure.displacement(p, x) for p in positions])
    rows = tcp_rows(full.thermal, positions)
    by_rows = sum(G @ T for G, T in zip(rows, x, strict=True))
    assert np.abs(wanted).max() > 1e-6
    over = tcp_over(full.thermal, [np.stack([T, -T]) for T in x], positions)
    for found in (by_rows, tcp_at(full.thermal, x, positions), over[0], -over[1]):
        np.testing.assert_allclose(found, wanted, atol=1e-12 * np.abs(wanted).max())
    for G, body in zip(tcp_rows(full.thermal, full.thermal.poses), full.thermal.bodies, strict=True):
        np.testing.assert_allclose(G, body.G, atol=1e-12 * np.abs(body.G).max())


def test_one_state_per_position_and_positions_met_twice(full, positions):
    many = [np.array(x) for x in zip(*(random_fields(full.thermal, k) for k in range(len(positions))), strict=True)]
    twice = np.concatenate([positions, positions[::-1]])
    found = tcp_at(full.thermal, [np.concatenate([x, x]) for x in many], twice)
    for k in (0, 7, len(positions) + 3):
        one = full.structure.displacement(twice[k], [x[k % len(positions)] for x in many])
        np.testing.assert_allclose(found[k], one, atol=1e-12 * np.abs(found).max())


def test_the_reduced_model_is_as_exact_between_the_poses_as_at_them(full, reduced, positions, states):
    wanted = np.array([full.structure.displacement(p, states["full"]) for p in positions])
    assert np.abs(wanted).max() > 20e-6
    error = np.abs(tcp_at(reduced, states["reduced"], positions) - wanted).max()
    at_poses = tcp_at(reduced, states["reduced"], reduced.poses) - tcp_at(full.thermal, states["full"], reduced.poses)
    between = np.abs(tcp_at(without_structure(reduced), states["reduced"], positions) - wanted).max()
    assert error < 0.05e-6
    assert error < 1.5 * np.abs(at_poses).max()
    assert between > 2.0 * error


def test_an_artefact_keeps_it_bit_by_bit(machine, reduced, positions, tmp_path):
    bare = replace(reduced, bodies=tuple(replace(b, F=None) for b in reduced.bodies))
    write_artefact(tmp_path / "a.h5", bare, parameters=parameters(machine))
    stored = read_artefact(tmp_path / "a.h5").model
    assert is_exact(stored)
    for a, b in zip(tcp_rows(stored, positions), tcp_rows(bare, positions), strict=True):
        np.testing.assert_array_equal(a, b)
    write_artefact(tmp_path / "old.h5", without_structure(bare))
    old = read_artefact(tmp_path / "old.h5").model
    assert not is_exact(old)
    for a, b in zip(tcp_rows(old, old.poses), bare.bodies, strict=True):
        np.testing.assert_allclose(a, b.G, atol=1e-18)


def test_calibrated_expansions_hold_at_every_position(machine, full, reduced, positions):
    """A material's expansion scales what its parts do: as if these were so much warmer, for the TCP alone."""
    (chosen,) = [p for p in parameters(machine) if p.path == "materials.cast_iron.expansion"]
    values = {chosen.path: 1.2 * chosen.nominal}
    x = random_fields(full.thermal, 3)
    changed = with_values(full.thermal, [chosen], values)
    scaled = [T.copy() for T in x]
    for b, body in enumerate(full.thermal.bodies):
        for m, name in enumerate(body.members):
            if name in chosen.targets:
                scaled[b][body.member_states(m)] *= 1.2
    wanted = np.array([full.structure.displacement(p, scaled) for p in positions])
    np.testing.assert_allclose(tcp_at(changed, x, positions), wanted, atol=1e-12 * np.abs(wanted).max())
    small = with_values(reduced, [chosen], values)
    for body in small.bodies:
        np.testing.assert_allclose(body.W_members.sum(axis=0), body.W, atol=1e-9 * np.abs(body.W).max())
    for rows, at_grid in zip(tcp_rows(small, small.poses), small.bodies, strict=True):
        np.testing.assert_allclose(rows, at_grid.G, atol=1e-9 * np.abs(at_grid.G).max())


def test_lumped_machine(tmp_path):
    full = lumped_case.finer()
    positions = np.random.default_rng(1).uniform(-0.1, 0.3, (9, 1))
    x = random_fields(full.thermal, 4)
    wanted = np.array([full.structure.displacement(p, x) for p in positions])
    np.testing.assert_allclose(tcp_at(full.thermal, x, positions), wanted, atol=1e-12 * np.abs(wanted).max())
    a = lumped_case.artefact()
    write_artefact(tmp_path / "a.h5", a.model, parameters=a.parameters)
    stored = read_artefact(tmp_path / "a.h5").model
    for one, other in zip(tcp_rows(stored, positions), tcp_rows(a.model, positions), strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_machine_without_linear_axes_has_one_position():
    model = lumped_case.finer().thermal
    structure = replace(model.structure, axes=(), screws=(), scales=())
    still = replace(model, pose_axes=(), pose_grid=(), poses=np.zeros((1, 0)), structure=structure)
    x = random_fields(still, 0)
    wanted = sum(body.W[:3] @ T for body, T in zip(still.bodies, x, strict=True))
    assert np.abs(wanted).max() > 1e-6
    np.testing.assert_allclose(tcp_at(still, x, np.zeros((4, 0))), np.tile(wanted, (4, 1)), rtol=1e-12)


def test_a_model_with_the_rows_of_positions_is_exact_there(reduced, positions, states):
    there = at_positions(reduced, np.vstack([positions, positions[:3]]))
    assert there.scattered == len(np.unique(positions, axis=0))
    assert len(there.poses) == len(reduced.poses) + there.scattered
    weights, outside = row_weights(there, positions)
    assert not outside.any()
    assert np.count_nonzero(weights) == len(positions)
    for k, (body, rows) in enumerate(zip(there.bodies, tcp_rows(reduced, positions), strict=True)):
        np.testing.assert_allclose(np.tensordot(weights, body.G, 1), rows, atol=1e-18, err_msg=str(k))
        np.testing.assert_allclose(body.G_members.sum(axis=0), body.G, atol=1e-18)

    def read(model: MachineModel) -> np.ndarray:
        own, _ = row_weights(model, positions)
        return sum(np.einsum("mp,pcn,n->mc", own, b.G, x) for b, x in zip(model.bodies, states["reduced"], strict=True))

    np.testing.assert_allclose(read(there), tcp_at(reduced, states["reduced"], positions), atol=1e-13)
    assert np.abs(read(reduced) - read(there)).max() > 1e-8  # what interpolation would have left
    bare = replace(there, structure=None)
    np.testing.assert_allclose(tcp_at(bare, states["reduced"], positions), read(there), atol=1e-15)
    np.testing.assert_allclose(
        tcp_over(bare, [x[None] for x in states["reduced"]], positions)[0], read(there), atol=1e-15
    )


def test_other_positions_are_interpolated_and_without_a_structure_nothing_changes(reduced, positions, monkeypatch):
    there, other = at_positions(reduced, positions), positions[:20] * 0.99 + 1e-4
    np.testing.assert_array_equal(row_weights(there, other)[0][:, : len(reduced.poses)], row_weights(reduced, other)[0])
    bare = replace(reduced, structure=None)
    assert at_positions(bare, positions) is bare
    assert at_positions(reduced, np.zeros((0, 1))) is reduced
    monkeypatch.setattr(tcp, "MOST", len(there.poses) - len(reduced.poses))
    assert at_positions(reduced, positions).scattered
    assert at_positions(reduced, np.vstack([positions, other])) is reduced  # more than it keeps

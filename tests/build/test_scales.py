"""Added scales: a term of the TCP displacement, linear in position and in the mean temperature of a surface."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.descriptions import edited
from tests.support.lumped import edited as edited_lumped
from twin.build.coupled_direct import assemble_coupled
from twin.build.full_model import FullModel, assemble
from twin.build.pipeline import rich_model
from twin.build.rich_basis import RichOptions
from twin.build.scenario import draw
from twin.build.stepper import CoupledStepper, tcp_at_poses
from twin.build.surface import patch
from twin.build.volumetric import displacements
from twin.errors import DescriptionError
from twin.machine.load import load_machine
from twin.rom.poses import pose_weights

SCALE = '[scales.x_glass]\naxis = "x"\nsurface = "bed.y_min"\nexpansion = "40e-6 1/K"\nfixed_at = "-50 mm"\n\n'
TANK = '[tanks.oil]\nsurface = "bed.x_max"\ncapacity = "5 kJ/K"\nconductance = "10 W/K"\n\n'  # one more state
BEFORE = "[signals.x_position]"
ALPHA, FIXED = 40e-6, -0.05


@pytest.fixture(scope="module")
def machine(tmp_path_factory):
    return load_machine(edited(tmp_path_factory.mktemp("scales"), (BEFORE, SCALE + TANK + BEFORE)))


@pytest.fixture(scope="module")
def full(machine) -> FullModel:
    return assemble(machine)


@pytest.fixture(scope="module")
def plain(tmp_path_factory) -> FullModel:
    return assemble(load_machine(edited(tmp_path_factory.mktemp("plain"), (BEFORE, TANK + BEFORE))))


def random_fields(full: FullModel, seed: int) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    nodes = [5.0 + 3.0 * b.nodes @ rng.normal(size=3) + rng.normal(size=b.n) for b in full.bodies]
    sizes = [b.n for b in full.thermal.bodies]
    return [np.append(T, rng.normal(size=n - len(T))) for T, n in zip(nodes, sizes, strict=True)]


def surface_mean(full: FullModel, fields: list[np.ndarray]) -> float:
    part, offset = full.bodies[0].part("bed")
    p = patch(part, part.facets("y_min"))
    return float(p.mean @ fields[0][offset + p.nodes])


@pytest.mark.parametrize("x", [-0.2, -0.05, 0.0, 0.131])
def test_it_adds_what_the_description_says(full, plain, x):
    fields = random_fields(full, 1)
    added = full.structure.displacement({"x": x}, fields) - plain.structure.displacement({"x": x}, fields)
    mean = surface_mean(full, fields)
    assert abs(mean) > 1.0
    np.testing.assert_allclose(added, [-ALPHA * mean * (x - FIXED), 0.0, 0.0], atol=1e-15)


def test_the_reference_and_the_volume_have_it(machine, full):
    direct = assemble_coupled(machine, full.bodies)
    fields = [random_fields(full, seed) for seed in (2, 3)]
    positions = np.array([[-0.17], [0.09]])
    many = displacements(full.structure, positions, fields)
    nodal = [[T[: b.n] for T, b in zip(f, full.bodies, strict=True)] for f in fields]
    for i, position in enumerate(positions):
        for k in range(2):
            one = full.structure.displacement(position, fields[k])
            np.testing.assert_allclose(direct.displacement(position, nodal[k]), one, atol=1e-11)
            np.testing.assert_allclose(many[k, i], one, atol=1e-15)
            told = full.structure.encoder_terms("x", position, fields[k])
            assert told.total == pytest.approx(one[0], abs=1e-12)
            wanted = -ALPHA * surface_mean(full, fields[k]) * (position[0] - FIXED)
            assert told.scale == pytest.approx(wanted, rel=1e-9)


def test_scales_of_the_reduced_model_are_those_of_the_full(machine, full, plain):
    """Equal to the full one at every pose of the grid and between them, within what a build is allowed."""
    reduced = rich_model(machine, full, RichOptions(samples=6))
    drive = draw(reduced.load_model, 5, hours=1.0).drive
    states = {}
    for name, model in {"full": full.thermal, "reduced": reduced}.items():
        stepper = CoupledStepper(model)
        *_, (_, states[name], _) = stepper.run(drive, stepper.uniform(28.0))
    w = tcp_at_poses(reduced, states["reduced"])
    np.testing.assert_allclose(w, tcp_at_poses(full.thermal, states["full"]), atol=0.2e-6)
    added = w - tcp_at_poses(plain.thermal, states["full"])
    assert np.abs(added).max() > 20e-6
    mean = surface_mean(full, states["full"])
    for x in (-0.163, 0.02, 0.177):  # linear in the position, which every interpolation between poses takes exactly
        weights, _ = pose_weights(reduced.pose_grid, np.array([[x]]))
        np.testing.assert_allclose((weights @ added)[0], [-ALPHA * mean * (x - FIXED), 0.0, 0.0], atol=0.2e-6)
    for body in reduced.bodies:
        assert body.G_members is not None
        np.testing.assert_allclose(body.G_members.sum(axis=0), body.G, atol=1e-15)


@pytest.mark.parametrize("place", ["bed", "screw.end", "screw"])
def test_lumped_machine(tmp_path, place):
    at = "[contacts.front_outer]"
    text = SCALE.replace("bed.y_min", place)
    bare = assemble(load_machine(edited_lumped(tmp_path)))
    full = assemble(load_machine(edited_lumped(tmp_path, (at, text + at))))
    rng = np.random.default_rng(0)
    fields = [rng.normal(size=b.n) for b in full.thermal.bodies]
    k, body = next((k, b) for k, b in enumerate(full.thermal.bodies) if place.split(".")[0] in b.members)
    own = fields[k][body.member_states(body.members.index(place.split(".")[0]))]
    trapezoid = (own[1:] + own[:-1]).mean() / 2 if len(own) > 1 else 0.0
    mean = {"bed": own[0], "screw.end": own[-1], "screw": trapezoid}[place]
    for x in (-0.05, 0.21):
        added = full.structure.displacement({"x": x}, fields) - bare.structure.displacement({"x": x}, fields)
        np.testing.assert_allclose(added, [-ALPHA * mean * (x - FIXED), 0.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(
        tcp_at_poses(full.thermal, fields)[-1], full.structure.displacement(full.thermal.poses[-1], fields), atol=1e-15
    )


@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        ('axis = "x"', 'axis = "y"', "not a linear axis"),
        ("bed.y_min", "bed.front", "unknown surface"),
        ("40e-6 1/K", "40 1/K", "less than or equal"),
        ('expansion = "40e-6 1/K"\n', "", "expansion"),
    ],
)
def test_what_is_refused(tmp_path, old, new, what):
    with pytest.raises(DescriptionError, match=what) as e:
        load_machine(edited(tmp_path, (BEFORE, SCALE.replace(old, new) + BEFORE)))
    assert any("scales.x_glass" in p.where for p in e.value.problems)

"""What another discretisation would measure otherwise: the shape of this machine's own discretisation error."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.build.simulate import simulate_run
from twin.calibrate.fit.measured import measured
from twin.diagnose.evidence.discretisation import (
    Difference,
    _acting,
    _others,
    differences,
    inside_of,
    with_inside,
    with_segments,
)
from twin.diagnose.model.probed_model import make_probed_model
from twin.diagnose.model.rich_probed_model import Mesh
from twin.diagnose.model.study import make_study
from twin.diagnose.model.surrogate import make_surrogate
from twin.inject.machines.loads import loads_of_run
from twin.logs.read import read_run
from twin.logs.run import Run
from twin.machine.check_lumped import node_capacity, total_capacity
from twin.machine.description import Machine
from twin.machine.load import load_machine
from twin.machine.parameters import parameters


def outputs(machine: Machine) -> np.ndarray:
    """(m,) of the fitted runs, of the parameters of the machine as shipped."""
    known = parameters(small_case.machine())
    study = small_case.study()
    plans = [p.measured for p in study.runs]
    other = make_study(make_probed_model(machine, known, small_case.runs()), plans, study.fitted)
    return np.concatenate([other.outputs(k, np.zeros(len(known))) for k in study.fitted])


@pytest.fixture(scope="module")
def both():
    machine, study = small_case.machine(), small_case.study()
    plans = [p.measured for p in study.runs]
    found = differences(machine, study, make_surrogate(study), parameters(machine), small_case.runs(), plans)
    assert len(found) == 1 + len(heavy(machine))  # bars, nodes
    return found


def heavy(machine: Machine) -> list[str]:
    """The nodes that get an inside."""
    return [n for n in machine.nodes if with_inside(machine, n) is not machine]


@pytest.mark.slow
def test_bars_of_finer_elements_tell_the_error_of_the_described_ones(both):
    """A machine of eight times as many elements, which nothing was made with, is where the difference leads to."""
    machine = small_case.machine()
    bars = {n: b.model_copy(update={"elements": 8 * b.elements}) for n, b in machine.bars.items()}
    error = outputs(machine.model_copy(update={"bars": bars})) - outputs(machine)
    d = both[0].known[:, 0]
    assert np.linalg.norm(error - d) < 0.35 * np.linalg.norm(
        error
    )  # the nut heats within an element: less than second order


@pytest.mark.slow
def test_the_difference_follows_the_parameters(both):
    study = small_case.described()
    n = len(study.probed.parameters)
    x = 0.3 * np.random.default_rng(4).standard_normal(n)
    machine, known = small_case.machine(), parameters(small_case.machine())
    split = with_inside(machine, heavy(machine)[0])
    plans = [p.measured for p in study.runs]
    acting = [_acting(p, split) for p in known]
    other = make_study(make_probed_model(split, acting, small_case.runs()), plans, study.fitted)
    exact = np.concatenate([other.outputs(k, x) - study.outputs(k, x) for k in study.fitted])
    told = both[1].real[:, 0] + both[1].D[:, :n] @ x
    assert np.linalg.norm(exact - told) < 0.2 * np.linalg.norm(exact)
    assert np.linalg.norm(exact - told) < np.linalg.norm(exact - both[1].real[:, 0])


def test_meshes_and_rails_in_more_segments_are_other_discretisations():
    machine = load_machine(Path(__file__).parents[1] / "machines" / "slide")
    moving = {n: c.segments for n, c in machine.contacts.items() if c.kind == "moving"}
    (mesh,), rails = _others(machine)
    assert mesh.machine is machine
    assert mesh.mesh is Mesh.FINER
    assert moving
    more = [[other.machine.contacts[n].segments for n in moving] for other in rails]
    assert all(np.diff([list(moving.values()), *more], axis=0).ravel() >= 0)
    assert more[0] > list(moving.values())
    assert more[-1] == [2 * s for s in moving.values()]
    for other in rails:
        assert other.mesh is Mesh.DESCRIBED
        assert all(other.machine.contacts[n] == c for n, c in machine.contacts.items() if n not in moving)
    lumped = [other for others in _others(small_case.machine()) for other in others]
    assert all(other.machine.contacts.keys() >= small_case.machine().contacts.keys() for other in lumped)


def test_a_mesh_too_large_to_be_halved_has_linear_elements_instead(monkeypatch):
    machine = load_machine(Path(__file__).parents[1] / "machines" / "slide")
    monkeypatch.setattr("twin.diagnose.evidence.discretisation.finer_fits", lambda _: False)
    (mesh,), _ = _others(machine)
    assert mesh.mesh is Mesh.LINEAR
    assert mesh.machine is machine


def test_what_a_real_division_shows_is_one_that_is_not_known():
    """Measurements are one of the real ones, each channel with a sign of its own; the columns know the others."""
    rng = np.random.default_rng(2)
    known, real = rng.standard_normal((60, 3)), rng.standard_normal((60, 2))
    share = np.repeat(np.arange(4), 15)
    difference = Difference(known, real, np.zeros((60, 5)), share)
    seen = set()
    for _ in range(200):
        y = difference.drawn(rng, np.zeros(5))
        one = next(k for k in range(2) if np.allclose(np.abs(y), np.abs(real[:, k])))
        signs = [np.unique(np.sign(y * real[:, one])[share == s]) for s in range(4)]
        assert all(len(own) == 1 for own in signs)
        seen.add((one, *(float(own[0]) for own in signs)))
    assert len(seen) == 2 * 2**4
    columns = difference.columns(lambda v: 100.0 * v, 0.6)
    assert all(len(np.unique(share[np.flatnonzero(c)])) == 1 for c in columns.T)
    mean = sum(np.outer(d, d) for d in 100.0 * known.T) * (share[:, None] == share)
    np.testing.assert_allclose(columns @ columns.T, mean, atol=1.0)


def test_an_inside_takes_half_of_a_node_and_nothing_is_lost():
    machine = small_case.machine()
    assert max(machine.nodes, key=lambda n: node_capacity(machine, n)) in heavy(machine)
    for name in heavy(machine):
        split = with_inside(machine, name)
        assert split.nodes.keys() - machine.nodes.keys() == {inside_of(name)}
        assert total_capacity(split) == pytest.approx(total_capacity(machine))
        both = [split.tcp.expansion.get(m, (0.0, 0.0, 0.0)) for m in (name, inside_of(name))]
        assert np.sum(both, axis=0) == pytest.approx(machine.tcp.expansion.get(name, (0.0, 0.0, 0.0)))
    light = {n: v.model_copy(update={"capacity": 50.0}) for n, v in machine.nodes.items()}
    assert not heavy(machine.model_copy(update={"nodes": light}))


def simulated(machine: Machine, seed: int, folder: Path) -> Run:
    """Two hours by the full model, without noise."""
    loads_of_run(machine, seed, folder.name, 2.0, 60.0, {}).write(folder)
    return simulate_run(machine, read_run(folder), tcp_every=600.0)[0]


@pytest.mark.slow
def test_a_machine_of_parts_knows_its_mesh_and_its_rails_at_every_sensor(tmp_path):
    """Of a division that nothing was made with the known ones tell some."""
    machine = load_machine(Path(__file__).parents[1] / "machines" / "slide")
    # the third is sealed, and has positions of its own
    known, runs = parameters(machine), [simulated(machine, seed, tmp_path / f"{seed}") for seed in (1, 2, 3)]
    probed = make_probed_model(machine, known, runs)
    plans = [measured(probed.base, run, b.drive, b.name) for run, b in zip(runs, probed.runs, strict=True)]
    study = make_study(probed, plans, range(2))
    mesh, rails = differences(machine, study, make_surrogate(study), known, runs, plans)
    x = np.zeros(len(known))
    fitted = study.fitted
    base = make_study(make_probed_model(machine, known, runs, nominal_of=fitted), plans, fitted).all_outputs(x)
    np.testing.assert_allclose(base, study.all_outputs(x), atol=0.1)  # noise of a single reading; it rises by 30 K
    other = with_segments(machine, 3.0)
    more = make_study(make_probed_model(other, known, runs, nominal_of=fitted), plans, fitted).all_outputs(x) - base
    for own in np.unique(rails.share):
        rows = rails.share == own
        if np.sqrt(np.mean(more[rows] ** 2)) > 0.02:
            columns = np.hstack([rails.known[rows], rails.real[rows]])
            left = more[rows] - columns @ np.linalg.lstsq(columns, more[rows], rcond=None)[0]
            assert np.linalg.norm(left) < 0.7 * np.linalg.norm(more[rows])
    assert np.abs(mesh.known).max() > 0.01
    assert not mesh.D.any()
    assert not rails.D.any()

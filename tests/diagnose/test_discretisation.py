"""What another discretisation would measure otherwise: the shape of this machine's own discretisation error."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.diagnose.evidence.discretisation import _acting, _others, differences, inside_of, with_inside
from twin.diagnose.evidence.pulls import Pulls
from twin.diagnose.model.probed_model import make_probed_model
from twin.diagnose.model.study import make_study
from twin.diagnose.model.surrogate import make_surrogate
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


@pytest.mark.long
def test_bars_of_finer_elements_tell_the_error_of_the_described_ones(both):
    """A machine of eight times as many elements, which nothing was made with, is where the difference leads to."""
    machine = small_case.machine()
    bars = {n: b.model_copy(update={"elements": 8 * b.elements}) for n, b in machine.bars.items()}
    error = outputs(machine.model_copy(update={"bars": bars})) - outputs(machine)
    d = both[0].d
    assert np.linalg.norm(error - d) < 0.35 * np.linalg.norm(
        error
    )  # the nut heats within an element: less than second order


@pytest.mark.long
def test_the_difference_follows_the_parameters(both):
    study = small_case.study()
    n = len(study.probed.parameters)
    x = 0.3 * np.random.default_rng(4).standard_normal(n)
    machine, known = small_case.machine(), parameters(small_case.machine())
    split = with_inside(machine, heavy(machine)[0])
    plans = [p.measured for p in study.runs]
    acting = [_acting(p, split) for p in known]
    other = make_study(make_probed_model(split, acting, small_case.runs()), plans, study.fitted)
    exact = np.concatenate([other.outputs(k, x) - study.outputs(k, x) for k in study.fitted])
    assert np.linalg.norm(exact - both[1].at(x)) < 0.2 * np.linalg.norm(exact)
    assert np.linalg.norm(exact - both[1].at(x)) < np.linalg.norm(exact - both[1].d)


def test_rails_in_more_segments_are_other_discretisations():
    machine = load_machine(Path(__file__).parents[1] / "machines" / "slide")
    moving = {n: c.segments for n, c in machine.contacts.items() if c.kind == "moving"}
    (same, _, linear), *others = _others(machine)
    assert same is machine
    assert linear
    assert moving
    assert len(others) > 1
    for other, share, quadratic in others:
        assert not quadratic
        times = share / (share - 1.0)  # the error goes with the length: it is share times what 1 / times of it leaves
        assert {n: other.contacts[n].segments for n in moving} == {n: round(times * s) for n, s in moving.items()}
        assert all(other.contacts[n].segments > s for n, s in moving.items())
        assert all(other.contacts[n] == c for n, c in machine.contacts.items() if n not in moving)
    assert all(o.contacts.keys() >= small_case.machine().contacts.keys() for o, _, _ in _others(small_case.machine()))


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


def test_a_parameter_is_out_of_its_tolerance_where_few_synthetic_measurements_move_one_so_far():
    known = parameters(small_case.machine())
    rng = np.random.default_rng(1)
    spread = rng.uniform(0.3, 2.0, len(known))
    fitted, settled = (spread * rng.standard_normal((2000, len(known))) for _ in range(2))
    pulls = Pulls.of(known, fitted, settled)
    passing = np.mean([(pulls.fitted.strain(x) >= 1.0).any() for x in spread * rng.standard_normal((2000, len(known)))])
    assert 0.01 < passing < 0.06
    named = next(i for i, p in enumerate(known) if p.kind == "source")
    other = next(i for i, p in enumerate(known) if p.kind == "capacity")
    far = np.zeros(len(known))
    far[[named, other]] = 20.0
    strain = pulls.strain(far, far)
    assert strain[named] > 1.0
    assert strain[other] == 0.0  # a capacity is no cause
    assert pulls.strain(far, -far)[named] == 0.0  # the calibrations contradict each other

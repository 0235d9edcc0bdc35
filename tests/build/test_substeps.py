"""How many substeps `twin build` takes: as few as hold the limits."""

from __future__ import annotations

import pytest

from tests.build.two_bodies import model
from twin.build.comparison import Way, compare_ways
from twin.build.pipeline import BuildOptions, enough_substeps
from twin.build.scenario import draw
from twin.machine.description import Limits

OPTIONS = BuildOptions()


@pytest.fixture(scope="module")
def errors() -> dict[int, float]:
    """K in a 10 K case, of steps of so many substeps against much finer ones: other scenarios than the choice has."""
    machine, found = model(), {}
    scenarios = [draw(machine.load_model, 40 + i, 1.0, OPTIONS.step) for i in range(6)]
    for substeps in (1, 2, 4):
        (compared,) = compare_ways([Way(machine, 16), Way(machine, substeps)], [(0, 1)], scenarios)
        found[substeps] = float(compared.scaled(Limits())[0].max())
    return found


@pytest.mark.long
def test_tighter_limits_take_more_substeps_and_these_hold_them(errors):
    assert errors[2] < 0.7 * errors[1]  # the limits below are apart
    limits = [20.0 * errors[1], *(errors[1] * 2.0**-k for k in range(-2, 3)), errors[4] / 20.0]
    chosen = [enough_substeps(model(), Limits(temperature=limit, displacement=1.0), OPTIONS) for limit in limits]
    assert chosen == sorted(chosen)
    assert {chosen[0], chosen[-1]} == {1, 4}
    assert all(errors[n] <= limit for n, limit in zip(chosen, limits, strict=True) if n < 4)


def test_enough_is_judged_by_displacements_too():
    assert enough_substeps(model(), Limits(temperature=1e3, displacement=1.0), OPTIONS) == 1
    assert enough_substeps(model(), Limits(temperature=1e3, displacement=1e-15), OPTIONS) == 4

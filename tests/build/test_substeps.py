"""How many substeps `twin build` takes: as few as hold the limits, also in the rare scenario that needs more."""

from __future__ import annotations

from tests.build.two_bodies import model
from twin.build.comparison import FINER, Way, compare_ways
from twin.build.pipeline import CHOICE, SHORTER, TRAINING_SEED, BuildOptions, enough_substeps
from twin.build.scenario import draw
from twin.machine.description import Limits

OPTIONS = BuildOptions()


def test_the_chosen_substeps_hold_half_of_the_limit_and_tighter_limits_take_more():
    machine = model()
    hours = OPTIONS.hours / SHORTER
    scenarios = [draw(machine.load_model, TRAINING_SEED + i, hours, OPTIONS.step) for i in range(CHOICE)]
    error = {}
    for substeps in (1, 2):
        (found,) = compare_ways([Way(machine, 4 * FINER), Way(machine, substeps)], [(0, 1)], scenarios)
        error[substeps] = float(found.scaled(Limits())[0].max())
    assert error[2] < 0.7 * error[1]  # K: the cases below are apart
    chosen = [
        enough_substeps(machine, Limits(temperature=limit, displacement=1.0), OPTIONS)
        for limit in (3.0 * error[1], 3.0 * error[2], 0.3 * error[2])
    ]
    assert chosen == [1, 2, 4]


def test_enough_is_judged_by_displacements_too():
    machine = model()
    assert enough_substeps(machine, Limits(temperature=1e3, displacement=1.0), OPTIONS) == 1
    assert enough_substeps(machine, Limits(temperature=1e3, displacement=1e-15), OPTIONS) == 4

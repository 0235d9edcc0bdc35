"""Edges of windows: derivatives against differences, names, and what is no edge."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.diagnose.acted import units_of
from twin.diagnose.batch import Batch, History, Hypothesis
from twin.diagnose.diagnosis import Window
from twin.diagnose.edges import PULSE, SHORTEST, Edge, edges_of, moved, per_second, with_pulses

HOUR = 3600.0


def heat(*windows: Window, family: str = "heat_source") -> Hypothesis:
    """100 W at the housing in windows."""
    elements = small_case.elements()
    columns = elements.block_of["heat", "housing"]
    weights = np.ones((1, len(columns)))
    batch = Batch(family, "heat", "W", ("housing",), columns[None], (History("", weights, windows=windows),))
    return Hypothesis(batch, 0, batch.histories[0], 0.0, (100.0,), 1.0)


def names() -> list[str]:
    return [p.run.name for p in small_case.study().runs]


def test_edges_are_the_ends_within_a_run():
    study = small_case.study()
    first, second = names()[:2]
    end = float(study.runs[0].run.drive.time[-1])
    assert edges_of(study, heat(Window(first, 0.0, end))) == []
    assert edges_of(study, heat(Window(first, HOUR, end))) == [Edge(0, False)]
    both = heat(Window(first, HOUR, 2 * HOUR), Window(second, 0.0, HOUR))
    assert edges_of(study, both) == [Edge(0, False), Edge(0, True), Edge(1, True)]
    assert edges_of(study, replace(both, batch=replace(both.batch, family="sun"))) == []


@pytest.mark.parametrize("edge", [Edge(0, False), Edge(0, True)])
def test_the_derivative_by_an_edge_is_that_of_outputs(edge):
    study, elements = small_case.study(linear=True), small_case.elements(linear=True)
    h = heat(Window(names()[0], HOUR, 2 * HOUR))
    x, a = np.zeros(len(study.bench.parameters)), np.array([100.0])

    def at(shift):
        units = units_of(study, elements, elements.index, moved(study, h, [(edge, shift)]))
        return study.outputs(0, x, with_pulses(study, elements, h, units, a, [], 0), a)

    units = units_of(study, elements, elements.index, h)
    _, D = study.by_amplitudes(0, x, with_pulses(study, elements, h, units, a, [edge], 0), [*a, 0.0])
    wanted = (at(PULSE / 2) - at(-PULSE / 2)) / PULSE
    size = np.abs(wanted).max()
    assert size > 1e-5  # K per s
    assert np.abs(D[:, 1] * per_second(edge) - wanted).max() < 1e-6 * size


def test_moved_windows_stay_in_their_run_and_are_named_anew():
    study = small_case.study()
    first, second = names()[:2]
    end = float(study.runs[0].run.drive.time[-1])
    h = moved(study, heat(Window(first, HOUR, 2 * HOUR)), [(Edge(0, False), -9e9), (Edge(0, True), 900.0)])
    assert h.when.windows == (Window(first, 0.0, 2.25 * HOUR),)
    assert h.when.name == f"from 0.0 h to 2.2 h of {first}"
    short = moved(study, heat(Window(first, HOUR, 2 * HOUR)), [(Edge(0, True), -9e9)])
    assert short.when.windows[0].end == HOUR + SHORTEST
    last = heat(Window(first, HOUR, end), Window(second, 0.0, float(study.runs[1].run.drive.time[-1])))
    assert moved(study, last, [(Edge(0, False), 360.0)]).when.name == f"from 1.1 h of {first} on"

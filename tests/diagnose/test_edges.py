"""Edges of windows: derivatives against differences, names, and what is no edge."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.diagnose.evidence.batch import Batch, History, Hypothesis
from twin.diagnose.evidence.bells import Bell, by_blocks, name
from twin.diagnose.faults.acted import slots_with, units_of
from twin.diagnose.result.diagnosis import Window
from twin.diagnose.search.edges import Edge, edges_of, longer, moved, shape_errors, with_pulses
from twin.diagnose.search.policy import POLICY

HOUR = 3600.0


def heat(*windows: Window, family: str = "heat_source") -> Hypothesis:
    """100 W at the housing in windows."""
    elements = small_case.elements()
    columns = elements.block_of["heat", "housing"]
    weights = np.ones((1, len(columns)))
    batch = Batch(family, "heat", "W", ("housing",), columns[None], (History("", weights, windows=windows),))
    return Hypothesis(batch, 0, batch.histories[0], 0.0, (100.0,))


def names() -> list[str]:
    return [p.run.name for p in small_case.study().runs]


def test_edges_are_the_ends_within_a_run():
    study = small_case.study()
    first, second = names()[:2]
    end = float(study.runs[0].run.drive.time[-1])
    assert edges_of(study, heat(Window(first, 0.0, end))) == []
    assert edges_of(study, heat(Window(first, HOUR, end))) == [Edge("begin", 0)]
    both = heat(Window(first, HOUR, 2 * HOUR), Window(second, 0.0, HOUR))
    assert edges_of(study, both) == [Edge("begin", 0), Edge("end", 0), Edge("begin", 1), Edge("end", 1)]
    lasting = heat(Window(first, HOUR, end), Window(second, 0.0, float(study.runs[1].run.drive.time[-1])))
    assert edges_of(study, lasting) == [Edge("begin", 0)]
    assert edges_of(study, replace(both, batch=replace(both.batch, family="not_thermal", kind="step"))) == []


@pytest.mark.long
@pytest.mark.parametrize("edge", [Edge("begin", 0), Edge("end", 0)])
def test_the_derivative_by_an_edge_is_that_of_outputs(edge):
    study, elements = small_case.study(linear=True), small_case.elements(linear=True)
    h = heat(Window(names()[0], HOUR, 2 * HOUR))
    x, a = np.zeros(len(study.probed.parameters)), np.array([100.0])

    def at(shift):
        units = units_of(study, moved(study, elements, h, [(edge, shift)]))
        return study.outputs(0, x, with_pulses(study, elements, h, units, a, [], 0), a)

    units = units_of(study, h)
    _, D = study.by_amplitudes(0, x, with_pulses(study, elements, h, units, a, [edge], 0), [*a, 0.0])
    half = 0.5 / abs(edge.per_second)  # of the pulse, whose response is the derivative
    wanted = (at(half) - at(-half)) / (2.0 * half)
    size = np.abs(wanted).max()
    assert size > 1e-5  # K per s
    assert np.abs(D[:, 1] * edge.per_second - wanted).max() < 1e-6 * size


def sunny(*centres: float) -> Hypothesis:
    """A bell of 2.5 h at the housing in both runs."""
    study, elements = small_case.study(linear=True), small_case.elements(linear=True)
    columns, bell = elements.block_of["heat", "housing"], Bell(centres, 2.5 * HOUR)
    weights, windows = by_blocks(study.fitted_runs, elements.histories.blocks, bell)
    when = History(name(bell, study.fitted_runs), weights, windows=windows, bell=bell)
    batch = Batch("sun", "heat", "W", ("housing",), columns[None], (when,), 1)
    return Hypothesis(batch, 0, when, 0.0, (100.0, 60.0))


@pytest.mark.long
@pytest.mark.parametrize("edge", [Edge("centre", 1), Edge("length")])
def test_the_derivative_by_a_bell_is_that_of_outputs(edge):
    study, elements = small_case.study(linear=True), small_case.elements(linear=True)
    h = sunny(2.0 * HOUR, 1.5 * HOUR)
    assert edges_of(study, h) == [Edge("centre", 0), Edge("centre", 1), Edge("length")]
    x, a = np.zeros(len(study.probed.parameters)), np.array([100.0, 60.0])

    def at(shift):
        units = units_of(study, moved(study, elements, h, [(edge, shift)]))
        return study.outputs(1, x, with_pulses(study, elements, h, units, a, [], 1), a)

    units = units_of(study, h)
    _, D = study.by_amplitudes(1, x, with_pulses(study, elements, h, units, a, [edge], 1), [*a, 0.0])
    half = 0.5 / abs(edge.per_second)
    wanted = (at(half) - at(-half)) / (2.0 * half)
    assert np.abs(wanted).max() > 1e-5  # K per s
    assert np.abs(D[:, 2] * edge.per_second - wanted).max() < 1e-6 * np.abs(wanted).max()


def test_moved_windows_stay_in_their_run_and_are_named_anew():
    study = small_case.study()
    first, second = names()[:2]
    end = float(study.runs[0].run.drive.time[-1])
    h = moved(
        study,
        small_case.elements(),
        heat(Window(first, HOUR, 2 * HOUR)),
        [(Edge("begin", 0), -9e9), (Edge("end", 0), 900.0)],
    )
    assert h.when.windows == (Window(first, 0.0, 2.25 * HOUR),)
    assert h.when.name == f"from 0.0 h to 2.2 h of {first}"
    short = moved(study, small_case.elements(), heat(Window(first, HOUR, 2 * HOUR)), [(Edge("end", 0), -9e9)])
    assert HOUR + 60.0 <= short.when.windows[0].end < 1.5 * HOUR  # some steps in time are left
    last = heat(Window(first, HOUR, end), Window(second, 0.0, float(study.runs[1].run.drive.time[-1])))
    assert (
        moved(study, small_case.elements(), last, [(Edge("begin", 0), 360.0)]).when.name == f"from 1.1 h of {first} on"
    )


def test_longer_windows_end_where_the_next_one_begins_or_the_run_ends():
    study, elements = small_case.study(), small_case.elements()
    first, second = names()[:2]
    end = float(study.runs[0].run.drive.time[-1])
    h = heat(Window(first, HOUR, 1.5 * HOUR), Window(first, 1.75 * HOUR, end - 600.0), Window(second, HOUR, 2 * HOUR))
    ends = [w.end for w in longer(study, elements, h).when.windows]
    assert ends == [1.75 * HOUR - 600.0, end, 3 * HOUR]
    whole = heat(Window(first, HOUR, end))
    assert longer(study, elements, whole) is whole


@pytest.mark.long
def test_another_exponent_of_a_loss_leaves_open_the_change_by_its_exponent():
    study, elements = small_case.study(linear=True), small_case.elements(linear=True)
    place, name = next((p, n) for kind, p, n in elements.index if kind == "source" and n.endswith("^2.00"))
    column = elements.index["source", place, name]
    x, a = np.zeros(len(study.probed.parameters)), np.array([20.0])

    def source(exponent: float) -> Hypothesis:
        signal, _, reference = elements.histories.unit[name]
        when = History(name, np.ones((1, 1)), signal=signal, exponent=exponent, reference=reference)
        batch = Batch("loss_law", "source", "W", (place,), np.array([[column]]), (when,))
        return Hypothesis(batch, 0, when, 0.0, tuple(a))

    def outputs(units):
        return study.outputs(0, x, slots_with(study, elements, units, 0), [*a, 1.0][: len(units)])

    h = source(2.0)
    own = units_of(study, h)
    (more,) = shape_errors(study, h, own, a, POLICY)
    left_open = outputs([*own, more]) - outputs(own)
    by = 1e-3
    steeper = (outputs(units_of(study, source(2.0 + by))) - outputs(own)) / by * POLICY.exponent
    assert np.abs(left_open).max() > 1e-2
    np.testing.assert_allclose(left_open, steeper, atol=2e-3 * np.abs(steeper).max())

"""Further windows are taken where they explain enough, and not where they only reduce a strong cause's misfit."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from twin.diagnose.evidence.batch import Batch, History, Hypothesis
from twin.diagnose.evidence.bells import Bell, by_blocks, name
from twin.diagnose.result.diagnosis import Window
from twin.diagnose.search.growth import between, chilled, grown, refined_edges

BLOCKS = 6


def hypothesis(g: np.ndarray) -> Hypothesis:
    """The first of six hours, with unit information in each."""
    windows = [History(f"hour {b}", np.eye(BLOCKS)[[b]], windows=(Window("a", 3600.0 * b, 3600.0 * (b + 1)),))
               for b in range(BLOCKS)]  # fmt: skip
    batch = Batch("heat_source", "heat", "W", ("p",), np.arange(BLOCKS)[None], tuple(windows), 1)
    return Hypothesis(batch, 0, windows[0], float(g[0] ** 2), (float(g[0]),))


@pytest.mark.parametrize(("size", "more", "wanted"), [(10.0, 10.0, 2), (10.0, 0.5, 1), (6.0, 6.0, 2), (2.0, 2.0, 1)])
def test_a_window_must_bring_its_price(size, more, wanted):
    g = np.zeros(BLOCKS)
    g[0], g[3] = size, more
    found = grown(hypothesis(g), g, np.eye(BLOCKS))
    assert len(found.when.windows) == wanted
    if wanted == 2:  # one size for both: (g1 + g2)^2 / 2
        assert found.statistic == pytest.approx((size + more) ** 2 / 2.0, rel=1e-6)
        assert found.statistic > size**2


@pytest.mark.parametrize(("explained", "brings", "wanted"), [(36.0, 30.0, 2), (1500.0, 30.0, 1), (1500.0, 300.0, 2)])
def test_the_price_rises_with_what_is_explained_already(explained, brings, wanted):
    """The same gain is enough beside a weak cause and too little beside a strong one."""
    g = np.zeros(BLOCKS)
    g[0] = explained**0.5
    g[3] = (2.0 * (explained + brings)) ** 0.5 - g[0]  # one size for both: (g1 + g2)^2 / 2
    assert len(grown(hypothesis(g), g, np.eye(BLOCKS)).when.windows) == wanted


def test_a_bell_finds_its_hour_in_every_run():
    """Runs that start at other hours of the day: noon is in the third hour of one and in the sixth of the other."""
    runs = [("a", 60.0), ("b", 60.0)]
    blocks = [(r, 60 * b, 60 * (b + 1)) for r in range(2) for b in range(8)]
    histories = []
    for hour in range(2, 7):
        bell = Bell((3600.0 * hour,) * 2, 4 * 3600.0)
        weights, windows = by_blocks(runs, blocks, bell)
        histories.append(History(name(bell, runs), weights, windows=windows, bell=bell))
    batch = Batch("sun", "heat", "W", ("p",), np.arange(16)[None], tuple(histories), 1)
    truth, _ = by_blocks(runs, blocks, Bell((3 * 3600.0, 6 * 3600.0), 4 * 3600.0))
    g = np.array([50.0, 30.0]) @ truth
    start = max(
        (Hypothesis(batch, 0, h, float((h.weights @ g) @ np.linalg.solve(h.weights @ h.weights.T, h.weights @ g)),
                    (1.0, 1.0)) for h in histories),
        key=lambda h: h.statistic,
    )  # fmt: skip
    found = grown(start, g, np.eye(16))
    assert found.when.bell is not None
    assert found.when.bell.centres == (3 * 3600.0, 6 * 3600.0)
    assert found.amplitude == pytest.approx((50.0, 30.0), rel=1e-6)
    assert found.statistic > 1.2 * start.statistic


def coolant(kind: str = "coolant") -> tuple[Batch, np.ndarray]:
    """A film and its heat in the first hour, in the last three, or in all four; what they explain (8, 8)."""
    hours = [(0, 1), (1, 4), (0, 4)]
    windows = [History(f"{a} to {b} h", np.kron(np.eye(2), (np.arange(4) >= a) & (np.arange(4) < b)),
                       windows=(Window("a", 3600.0 * a, 3600.0 * b),)) for a, b in hours]  # fmt: skip
    return Batch("coolant", kind, "W/(m^2*K)", ("p",), np.arange(8)[None], tuple(windows), 1, smallest=5.0), np.eye(8)


@pytest.mark.parametrize("first", [0, 1, 2])
def test_a_coolant_begins_where_cold_does_most(first):
    """Cold of the first hour; a film that suits all hours."""
    batch, block = coolant()
    g = np.concatenate([[10.0, 10.0, 10.0, 10.0], [-9.0, -1.0, 1.0, -0.5]])
    found = chilled(Hypothesis(batch, 0, batch.histories[first], 1.0, (10.0, -2.0)), g, block)
    if first == 0:
        assert found is None  # it has begun there already
    else:
        assert found is not None
        assert (found.when.windows, found.amplitude) == (batch.histories[0].windows, pytest.approx((10.0, -9.0)))
        np.testing.assert_array_equal(found.when.weights, batch.histories[0].weights)


def test_a_coolant_begins_in_all_hours_that_cold_asks_for():
    """Cold of hours 1, 2 and 4 of four: two windows, for hours that touch are one."""
    hours = [Window("a", 3600.0 * b, 3600.0 * (b + 1)) for b in range(4)]
    windows = [History(f"{b} h", np.kron(np.eye(2), np.eye(4)[[b]]), windows=(hour,)) for b, hour in enumerate(hours)]
    batch = Batch("coolant", "coolant", "W/(m^2*K)", ("p",), np.arange(8)[None], tuple(windows), 1, smallest=5.0)
    g = np.concatenate([np.full(4, 10.0), [-9.0, -9.0, 0.0, -9.0]])
    found = chilled(Hypothesis(batch, 0, windows[2], 1.0, (10.0, -2.0)), g, np.eye(8))
    assert found is not None
    assert found.when.windows == (Window("a", 0.0, 7200.0), Window("a", 10800.0, 14400.0))
    np.testing.assert_array_equal(found.when.weights, np.kron(np.eye(2), [[1.0, 1.0, 0.0, 1.0]]))
    assert found.amplitude == pytest.approx((10.0, -9.0))


@pytest.mark.parametrize(("cold", "begins"), [(-8.0, True), (-5.0, False)])
def test_cold_may_be_as_good_as_heat_in_all_other_hours(cold, begins):
    """Parameters take what the two differ by: a coolant of the first hour is as good as heat of the others."""
    batch, block = coolant()
    g = np.concatenate([np.full(4, 10.0), [cold, 5.2, 5.2, 5.2]])
    found = chilled(Hypothesis(batch, 0, batch.histories[2], 1.0, (10.0, 2.0)), g, block)
    assert (found is not None) == begins
    if found is not None:
        assert found.when.windows == batch.histories[0].windows


def test_no_cold_and_no_coolant_begin_nowhere_else():
    batch, block = coolant()
    warm = np.concatenate([np.zeros(4), [9.0, 1.0, 1.0, 1.0]])
    assert chilled(Hypothesis(batch, 0, batch.histories[1], 1.0, (10.0, 2.0)), warm, block) is None
    hot = np.concatenate([np.zeros(4), [9.0, -3.0, -3.0, -2.0]])  # more than cold of the last three hours
    assert chilled(Hypothesis(batch, 0, batch.histories[2], 1.0, (10.0, 2.0)), hot, block) is None
    heat, block = coolant("heat")
    assert chilled(Hypothesis(heat, 0, heat.histories[1], 1.0, (10.0, 2.0)), -warm, block) is None


def windows_of_heat(hours: int, step: float, decay: float) -> tuple[np.ndarray, Batch]:
    """(steps, hours) what a sensor reads beside a small mass of a time constant `decay` [s] heated for each hour, and
    every stretch of hours."""
    t = step * np.arange(1, int(hours * 3600 / step) + 1)
    begun = [np.where(t > 3600.0 * b, 1.0 - np.exp(-np.clip(t - 3600.0 * b, 0.0, None) / decay), 0.0)
             for b in range(hours + 1)]  # fmt: skip
    D = np.stack([a - b for a, b in pairwise(begun)], axis=1)
    stretches = [(a, b) for a in range(hours) for b in range(a + 1, hours + 1)]
    histories = tuple(
        History(f"{a} to {b}", np.isin(np.arange(hours), np.arange(a, b))[None].astype(float),
                windows=(Window("a", 3600.0 * a, 3600.0 * b),))
        for a, b in stretches
    )  # fmt: skip
    return D, Batch("heat_source", "heat", "W", ("p",), np.arange(hours)[None], histories, 1)


def of(batch: Batch, k: int, g: np.ndarray, F: np.ndarray) -> Hypothesis:
    w = batch.histories[k].weights[0]
    return Hypothesis(batch, 0, batch.histories[k], float((w @ g) ** 2 / (w @ F @ w)), (float(w @ g / (w @ F @ w)),))


def test_windows_begin_and_end_between_the_hours():
    """Heat from 2.2 to 5.4 h, felt within ten minutes: full hours explain less than the nearest quarters do."""
    step = 60.0
    D, batch = windows_of_heat(8, step, 600.0)
    t = step * np.arange(1, len(D) + 1)
    grow = [np.where(t > at, 1.0 - np.exp(-np.clip(t - at, 0.0, None) / 600.0), 0.0) for at in (2.2 * 3600, 5.4 * 3600)]
    y = 10.0 * (grow[0] - grow[1])
    g, F = D.T @ y, D.T @ D
    hours = max((of(batch, k, g, F) for k in range(len(batch.histories))), key=lambda h: h.statistic)
    found = refined_edges(hours, g, F)
    (window,) = found.when.windows
    assert (window.start, window.end) == pytest.approx((2.25 * 3600, 5.5 * 3600), abs=901.0)
    assert window.start % 900.0 == window.end % 900.0 == 0.0
    assert y @ y - found.statistic < 0.6 * (y @ y - hours.statistic)
    assert found.amplitude[0] == pytest.approx(10.0, rel=0.1)
    assert found.when.name == f"from {window.start / 3600:.1f} h to {window.end / 3600:.1f} h of a"
    again = refined_edges(found, g, F)  # there is nothing better near it
    assert again.when.windows == found.when.windows


def test_what_lasts_to_the_end_of_a_run_keeps_its_end():
    D, batch = windows_of_heat(6, 60.0, 600.0)
    t = 60.0 * np.arange(1, len(D) + 1)
    y = 5.0 * np.where(t > 2.5 * 3600, 1.0 - np.exp(-np.clip(t - 2.5 * 3600, 0.0, None) / 600.0), 0.0)
    g, F = D.T @ y, D.T @ D
    k = next(i for i, h in enumerate(batch.histories) if h.windows[0].start == 7200.0 and h.windows[0].end == 21600.0)
    found = refined_edges(of(batch, k, g, F), g, F)
    assert (found.when.windows[0].start, found.when.windows[0].end) == (2.5 * 3600, 6 * 3600.0)


def test_a_familys_own_windows_keep_their_edges():
    """Of histories that act in every run alike, as a user's own family has them, no block is known by itself."""
    first = tuple(Window(run, 0.0, 3600.0) for run in "ab")
    longer = tuple(Window(run, 0.0, 7200.0) for run in "ab")
    histories = (
        History("1 h", np.array([[1.0, 0.0, 1.0, 0.0]]), windows=first),
        History("2 h", np.ones((1, 4)), windows=longer),
    )
    batch = Batch("heat_source", "heat", "W", ("p",), np.arange(4)[None], histories, 1)
    g, F = np.array([5.0, 4.0, 5.0, 4.0]), np.eye(4)
    h = of(batch, 0, g, F)
    assert refined_edges(h, g, F) is h
    assert grown(h, g, F).when.windows == first


def test_a_coolant_that_warms_is_cold_in_the_hours_between():
    """Heat in all other hours is as good as cold in its own where parameters are free."""
    batch, _ = coolant()
    warm = Hypothesis(batch, 0, batch.histories[1], 9.0, (60.0, 5.0))
    cold = between(warm)
    assert cold is not None
    assert [(w.start, w.end) for w in cold.when.windows] == [(0.0, 3600.0)]
    assert cold.when.weights == pytest.approx(batch.histories[0].weights)
    assert cold.amplitude == (60.0, -5.0)
    assert between(Hypothesis(batch, 0, batch.histories[1], 9.0, (60.0, -5.0))) is None
    assert between(Hypothesis(batch, 0, batch.histories[2], 9.0, (60.0, 5.0))) is None  # no hours are left

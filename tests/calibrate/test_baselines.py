"""Learned baselines know other runs, or the past of their own, and nothing else."""

from dataclasses import replace

import numpy as np
import pytest

from twin.calibrate.score.baselines import baselines, learned, regression, transfer
from twin.calibrate.score.pieces import Piece, Rows, input_names, on_grid, rows_of, split
from twin.calibrate.transfer_function.model import first_order_lags
from twin.errors import LogError, ModelError
from twin.logs.run import Run, Segment, Table

NAMES = ("bearing", "motor")
PLACES = np.array([[0.1], [0.7]])


def piece(seed: int, hours: float = 8.0, every: float = 600.0, places: int = 1) -> Piece:
    """Temperatures each minute; deviations by two lags of the bearing, twice as large at the second place."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 3600.0 * hours + 1.0, 60.0)
    power = np.repeat(rng.uniform(0.0, 10.0, len(time) // 60 + 1), 60)[: len(time)]
    bearing = first_order_lags(np.array([1500.0]), np.ones(1), 60.0, "zero").simulate(power)
    columns = {"bearing": 20.0 + bearing, "motor": 25.0 + rng.standard_normal(len(time)).cumsum() * 0.02}
    rise = first_order_lags(np.array([700.0, 4000.0]), np.array([-4e-6, -12e-6]), 60.0).simulate(bearing)
    at = np.arange(0, len(time), int(every / 60.0))
    place = np.arange(len(at)) % places
    measured = (rise[at] * (1.0 + place))[:, None] * [0.5, 0.0, 1.0]
    measured[:, 1] = np.nan
    rows = Rows(time[at], PLACES[place], measured, np.zeros((len(at), 3)), np.full(len(at), 1e-6))
    table = Table(time, columns, dict.fromkeys(columns, "degC"))
    return Piece(Run(Table(time, {"power": power}, {"power": "W"}), temperatures=table), f"run {seed}", rows, None)


def error(predicted: np.ndarray, p: Piece) -> float:
    return float(np.sqrt(np.nanmean((predicted - p.rows.measured)[1:] ** 2)))


@pytest.mark.parametrize("method", ["arx", "oe"])
@pytest.mark.parametrize("places", [1, 2])
def test_transfer_functions_predict_runs_they_have_not_seen(method, places):
    train, test = piece(1, places=places), piece(2, places=places)
    predict = transfer([train], NAMES, method, 60.0 if method == "oe" else None)
    # a second place is measured 10 min after the start at first, when it is at rest no more
    limit = 0.05 if places == 1 else 0.2
    assert error(predict(test), test) < limit * error(np.zeros_like(test.rows.measured), test)


def test_regression_takes_positions_where_they_differ():
    train, test = piece(3, places=2), piece(4, places=2)
    blind = replace(train, rows=replace(train.rows, position=0.0 * train.rows.position))
    seeing, without = regression([train], NAMES)(test), regression([blind], NAMES)(test)
    assert error(seeing, test) < 0.8 * error(without, test)


def mean_of(pieces):
    """The simplest that learns: the mean of all it was given."""
    level = np.nan_to_num(np.concatenate([p.rows.measured for p in pieces])).mean(axis=0)
    return lambda p: level * np.ones_like(p.rows.measured)


def test_how_they_learn_is_said():
    a, b, c = piece(5), piece(6), piece(7)
    assert learned(mean_of, [a], [b], [c])[1] == "fitted to 1 training run"
    assert "each run predicted by a fit to the other" in learned(mean_of, [], [a, b], [])[1]
    assert "what was measured before" in learned(mean_of, [], [a], [])[1]
    missing = {x.name: x for x in baselines([], [a], [], ())}["OE"]
    assert missing.predicted is None
    assert "no temperatures" in missing.how


def spoilt(p: Piece, rows: np.ndarray) -> Piece:
    other = np.where(np.isfinite(p.rows.measured), 1.0, np.nan)
    return replace(p, rows=replace(p.rows, measured=np.where(rows[:, None], other, p.rows.measured)))


@pytest.mark.parametrize("fit", [mean_of, lambda pieces: regression(pieces, NAMES)])
def test_no_prediction_knows_what_it_is_scored_on(fit):
    """Spoil what must not be known: the predictions stay the same."""
    a, b, s = piece(8), piece(9), piece(10)
    (alone,), _ = learned(fit, [], [a], [])
    late = a.rows.time >= a.rows.time[30]
    (again,), _ = learned(fit, [], [spoilt(a, late)], [])
    np.testing.assert_array_equal(again[~late], alone[~late])
    assert np.any(again != alone)
    first, _, sealed = learned(fit, [], [a, b], [s])[0]
    every = np.ones(len(a.rows), dtype=bool)
    np.testing.assert_array_equal(learned(fit, [], [spoilt(a, every), b], [s])[0][0], first)
    np.testing.assert_array_equal(learned(fit, [], [a, b], [spoilt(s, every)])[0][2], sealed)
    trained = learned(fit, [s], [a, b], [])[0]
    unseen = learned(fit, [s], [spoilt(a, every), spoilt(b, every)], [])[0]
    np.testing.assert_array_equal(trained[0], unseen[0])


def test_transfer_functions_do_not_know_what_they_predict():
    """They count from the first measurement of a run, once it is known, and from nothing later."""
    train, test = piece(11), piece(12)
    predict = transfer([train], NAMES, "oe", 60.0)
    late = test.rows.time > 0.0
    np.testing.assert_array_equal(predict(spoilt(test, late)), predict(test))
    shifted = replace(test, rows=replace(test.rows, measured=test.rows.measured + 1e-3))
    np.testing.assert_allclose(predict(shifted)[1:, 2], predict(test)[1:, 2] + 1e-3, atol=1e-12)
    np.testing.assert_array_equal(predict(shifted)[0], 0.0)


def test_temperatures_are_those_measured_by_then():
    p = piece(13)
    time = p.run.temperatures.time
    np.testing.assert_array_equal(
        p.temperatures(("motor",), time[:5] + 59.0)[:, 0], p.run.temperatures.columns["motor"][:5]
    )
    u, y, at = on_grid(p, NAMES, 600.0)
    np.testing.assert_array_equal(at, np.arange(len(p.rows)))
    np.testing.assert_array_equal(y[:, 2], p.rows.measured[:, 2] - p.rows.measured[0, 2])
    assert not u[0].any()


def test_inputs_that_all_runs_have():
    a, b = piece(14).run, piece(15).run
    columns = dict(b.temperatures.columns) | {"motor": np.full(len(b.temperatures.time), np.nan)}
    b = replace(b, temperatures=replace(b.temperatures, columns=columns))
    assert input_names([a, b]) == ("bearing",)
    assert input_names([a, b], ("power", "bearing")) == ("power", "bearing")
    with pytest.raises(LogError, match="no values of 'motor'"):
        input_names([a, b], ("motor",))
    assert rows_of((), 1e-6).measured.shape == (0, 3)


def test_segments_that_restart_are_runs_of_their_own():
    run = replace(piece(16).run, segments=(Segment("one", 30.0, 3600.0), Segment("two", 7200.0, 10800.0)))
    whole = split(run, restart=False)
    assert [(r is run, [s.name for s in own]) for r, own in whole] == [(True, ["one", "two"])]
    (first, (one,)), (second, _) = split(run, restart=True)
    assert one.name == "one"
    assert first.loads.time[0] == 0.0  # still holds at 30 s
    assert first.temperatures.time[[0, -1]].tolist() == [60.0, 3600.0]
    assert second.loads.time[[0, -1]].tolist() == [7200.0, 10800.0]


def test_too_little_to_learn_from_is_said():
    short = piece(17, hours=0.4)
    found = {x.name: x for x in baselines([], [short], [], NAMES)}
    assert found["OE"].predicted is None
    assert found["OE"].how.startswith("not available: ")
    with pytest.raises(ModelError):
        learned(mean_of, [], [], [short])

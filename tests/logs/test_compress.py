"""Compressed logs keep the heat, and time spent at places."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from twin.errors import LogError
from twin.logs.compress import compress_loads, compress_stream, dwell_shares
from twin.logs.run import Table
from twin.logs.sampling_rule import averaging_gain

UNITS = {"x": "m", "i": "A", "v": "m/s", "m": "N*m", "n": "1/s", "t": "degC", "on": "1"}


def log(n: int = 1000, interval: float = 0.01, seed: int = 0) -> Table:
    rng = np.random.default_rng(seed)
    columns = {
        "x": np.cumsum(rng.normal(size=n)) * 1e-3,
        "i": rng.normal(size=n) * 5.0,
        "v": rng.normal(size=n),
        "m": rng.normal(size=n) * 3.0,
        "n": rng.normal(size=n) * 10.0,
        "t": 20.0 + rng.normal(size=n),
        "on": (rng.random(n) < 0.3).astype(float),
    }
    return Table(interval * np.arange(n), columns, UNITS)


def test_duty_of_a_fifth_at_ten_amperes():
    """E-001-4: the mean of squares is 20 A^2, the square of the mean 4 A^2, a factor five."""
    time = np.arange(1000) * 0.01
    current = np.where(np.arange(1000) % 10 < 2, 10.0, 0.0)
    compressed = compress_loads(Table(time, {"i": current}, {"i": "A"}), 1.0)
    assert len(compressed.time) == 10
    assert compressed.columns["i"] ** 2 == pytest.approx(np.full(10, 20.0), rel=1e-13)
    assert np.mean(current) ** 2 == pytest.approx(4.0)


@pytest.mark.parametrize("interval", [0.1, 1.0, 0.037, 9.99])
def test_heat_is_kept(interval: float):
    loads = log()
    c = compress_loads(loads, interval, {"p": ("m", "n")})
    k = len(c.time)
    held = np.clip(np.minimum(loads.time + 0.01, k * interval) - loads.time, 0.0, None)  # s that each sample counts
    for heat, ours in (
        (loads.columns["i"] ** 2, c.columns["i"] ** 2),
        (abs(loads.columns["v"]), c.columns["v"]),
        (2 * np.pi * loads.columns["m"] * loads.columns["n"], c.columns["p"]),
        (loads.columns["t"], c.columns["t"]),
        (loads.columns["on"], c.columns["on"]),
    ):
        assert ours.sum() * interval == pytest.approx(heat @ held, rel=1e-11)
    assert c.units["p"] == "W"
    assert c.columns["x"] == pytest.approx(np.interp(c.time, loads.time, loads.columns["x"]), abs=1e-15)


def test_missing_values_are_left_out():
    values = np.array([1.0, np.nan, 3.0, np.nan, np.nan, 2.0])
    c = compress_loads(Table(np.arange(6.0), {"i": values}, {"i": "A"}), 3.0)
    assert c.columns["i"] == pytest.approx([np.sqrt(5.0), 2.0])
    c = compress_loads(Table(np.arange(6.0), {"i": values}, {"i": "A"}), 1.0)
    assert np.isnan(c.columns["i"]).tolist() == np.isnan(values).tolist()


@pytest.mark.parametrize("times", [1.0, 10.0])
def test_the_gain_is_that_of_the_average(times: float):
    """A sine at the corner frequency of a time constant, averaged over its tenth."""
    tau, n = 100.0, 200_000
    frequency, window = times / (2 * np.pi * tau), tau / 10.0
    time = np.arange(n) * 0.05
    c = compress_loads(Table(time, {"t": np.sin(2 * np.pi * frequency * time)}, {"t": "degC"}), window)
    middle = 2 * np.pi * frequency * (c.time + window / 2)
    basis = np.column_stack([np.sin(middle), np.cos(middle)])
    amplitude = np.hypot(*np.linalg.lstsq(basis, c.columns["t"], rcond=None)[0])
    assert amplitude == pytest.approx(averaging_gain(frequency, window), rel=1e-5)


@pytest.mark.parametrize("sizes", [[1000], [1] * 1000, [7] * 142 + [6], [313, 400, 287]])
def test_a_stream_gives_the_same(sizes: list[int]):
    loads = log()
    borders = np.cumsum([0, *sizes])
    pieces = [
        Table(loads.time[a:b], {n: v[a:b] for n, v in loads.columns.items()}, UNITS) for a, b in pairwise(borders)
    ]
    parts = list(compress_stream(pieces, 0.25, lambda: 0.01))
    whole = compress_loads(loads, 0.25)
    assert np.concatenate([p.time for p in parts]) == pytest.approx([*whole.time, 10.0], abs=1e-12)
    for name in UNITS:
        ours = np.concatenate([p.columns[name] for p in parts])
        assert ours[:-1] == pytest.approx(whole.columns[name], rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("interval", [0.01, 0.3, 0.995, 6.0, 9.999, 10.0])
@pytest.mark.parametrize("size", [1, 7, 1000])
def test_a_stream_keeps_the_heat_to_its_last_sample(interval: float, size: int):
    loads = log()
    pieces = [
        Table(loads.time[a : a + size], {n: v[a : a + size] for n, v in loads.columns.items()}, UNITS)
        for a in range(0, 1000, size)
    ]
    parts = list(compress_stream(pieces, interval, lambda: 0.01))
    time = np.concatenate([p.time for p in parts])
    assert time[-1] == pytest.approx(10.0, abs=1e-9)
    assert len(time) == np.ceil(10.0 / interval - 1e-9) + 1
    assert np.diff(time).min() > 1e-4
    c = {n: np.concatenate([p.columns[n] for p in parts]) for n in UNITS}
    held = np.diff(time)
    for heat, ours in ((loads.columns["i"] ** 2, c["i"] ** 2), (abs(loads.columns["v"]), c["v"])):
        assert ours[:-1] @ held == pytest.approx(heat.sum() * 0.01, rel=1e-9)
        assert ours[-1] == pytest.approx(heat[-1])
    assert c["x"] == pytest.approx(np.interp(time, loads.time, loads.columns["x"]), abs=1e-9)


def test_nothing_comes_of_a_stream_shorter_than_an_interval():
    assert list(compress_stream([log()], 10.1, lambda: 0.01)) == []


def test_dwell_of_an_even_sweep_and_of_rest():
    borders = np.linspace(0.0, 1.0, 11)
    time = np.array([0.0, 2.0, 4.0, 6.0])
    share = dwell_shares(time, np.array([0.2, 0.7, 0.2, 0.2]), np.array([0.0, 4.0, 6.0]), borders)
    assert share[0] == pytest.approx(np.where((np.arange(10) >= 2) & (np.arange(10) < 7), 0.2, 0.0), abs=1e-15)
    assert share[1].sum() == 1.0
    assert share[1].max() == 1.0
    beyond = dwell_shares(time, np.array([-1.0, 1.0, 1.0, 1.0]), np.array([0.0, 2.0]), borders)
    assert beyond.sum() == pytest.approx(0.5)


@pytest.mark.parametrize("at", [0.0, 0.3, 0.5, 1.0])
def test_a_rest_on_a_border_keeps_its_share(at: float):
    """On the last one too, where an axis rests at the end of its stroke."""
    borders = np.array([0.0, 0.3, 0.5, 1.0])
    time = np.array([0.0, 1.0, 3.0])
    share = dwell_shares(time, np.array([0.1, at, at]), np.array([0.0, 1.0, 3.0, 4.0]), borders)
    assert share.sum(axis=1) == pytest.approx(np.ones(3), abs=1e-15)
    assert share[1].max() == share[2].max() == 1.0
    assert np.argmax(share[1]) == {0.0: 0, 0.3: 1, 0.5: 2, 1.0: 2}[at]


def test_dwell_is_the_mean_along_the_path():
    rng = np.random.default_rng(1)
    time = np.cumsum(rng.uniform(0.01, 0.1, 400))
    position = np.cumsum(rng.normal(size=400)) * 0.05
    borders = np.linspace(position.min(), position.max() + 1e-9, 8)
    edges = np.linspace(time[0], time[-1], 5)
    share = dwell_shares(time, position, edges, borders)
    assert share.sum(axis=1) == pytest.approx(np.ones(4), abs=1e-12)
    for k in range(4):
        fine = np.linspace(edges[k], edges[k + 1], 200_001)[:-1] + (edges[1] - edges[0]) / 400_000
        counted = np.histogram(np.interp(fine, time, position), borders)[0] / 200_000
        assert share[k] == pytest.approx(counted, abs=1e-4)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"products": {"p": ("m", "w")}}, "no column 'w'"),
        ({"products": {"p": ("m", "x")}}, "is no power"),
        ({"interval": 11.0}, "no interval of 11 s is complete"),
    ],
)
def test_mistakes_are_named(change: dict, message: str):
    with pytest.raises(LogError, match=message):
        compress_loads(**{"loads": log(), "interval": 1.0} | change)


def test_times_must_increase():
    with pytest.raises(LogError, match="do not increase"):
        compress_loads(Table(np.array([0.0, 0.0, 1.0]), {}, {}), 1.0)


def test_columns_may_not_change_in_a_stream():
    a, b = log(10), Table(np.arange(10, 20) * 0.01, {"i": np.ones(10)}, {"i": "A"})
    with pytest.raises(LogError, match="columns change"):
        list(compress_stream([a, b], 1.0, lambda: 0.01))

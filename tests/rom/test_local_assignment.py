"""Local assignment (paper 001, module 1.05): a nut's heat and conductance go to the screw segments that it passes."""

from dataclasses import replace

import numpy as np
import pytest
import synthetic

from twin.logs.blocks import group, resolve
from twin.logs.compress import dwell_shares
from twin.physics.screws import screw_friction
from twin.rom.drive import evaluate
from twin.rom.law_values import parameters_of

STATIONS = np.linspace(0.05, 0.95, 10)  # segments of 0.1 m from 0 to 1 m, numbered from 1 in the paper
BORDERS = np.linspace(0.0, 1.0, 11)
NUT = 0.1  # m: coordinate of the nut at axis position zero


def screw(assignment: str = "segment"):
    """One axis whose nut runs on ten segments."""
    load = synthetic.load_model(n_bodies=2, pads=1)
    rails = tuple(replace(r, stations=tuple(STATIONS)) if "screw" in r.name else r for r in load.rails)
    pairs = tuple(
        replace(p, station=NUT, rail_moves=False, assignment=assignment) if p.contact == "x_screw" else p
        for p in load.pairs
    )
    ports, first = [], 0
    new_rails = []
    for rail in rails:
        new_rails.append(replace(rail, first_port=first))
        ports += [f"{rail.name}[{i}]" for i in range(len(rail.stations))]
        first += len(rail.stations)
    new_pairs = []
    for p in pairs:
        new_pairs.append(replace(p, pad_port=len(ports)))
        ports.append(f"pad of {p.contact}")
    return replace(load, rails=tuple(new_rails), pairs=tuple(new_pairs), ports=tuple(ports))


LOAD = screw()
PAIR = next(k for k, p in enumerate(LOAD.pairs) if p.contact == "x_screw")
RAIL = LOAD.rails[LOAD.pairs[PAIR].rail]
SOURCE = next(j for j, s in enumerate(LOAD.sources) if s.contact == "x_screw")
SEGMENTS = slice(RAIL.first_port, RAIL.first_port + 10)


def signals(coordinate: np.ndarray, speed: np.ndarray) -> dict[str, np.ndarray]:
    found = {s.name: np.full(len(coordinate), 20.0 if s.unit == "degC" else 0.0) for s in LOAD.signals}
    return found | {"x_position": coordinate - NUT, "x_speed": speed}


def sweep(n_turns: int, sampling: float, seconds: float = 60.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time, coordinate and speed of a nut that goes to and fro evenly over the segments 3 to 7, 0.2 .. 0.7 m."""
    time = np.arange(0.0, seconds + sampling / 2, sampling)
    phase = (n_turns * time / seconds) % 1.0
    coordinate = 0.2 + 0.5 * (1.0 - abs(2.0 * phase - 1.0))
    return time, coordinate, np.full(len(time), n_turns * 1.0 / seconds)


FIFTHS = np.where((np.arange(10) >= 2) & (np.arange(10) <= 6), 0.2, 0.0)


@pytest.mark.parametrize(("n_turns", "sampling"), [(1, 30.0), (2, 0.25), (12, 0.5), (30, 0.1)])
def test_a_fifth_of_the_power_each(n_turns: int, sampling: float):
    time, coordinate, speed = sweep(n_turns, sampling)
    drive = evaluate(LOAD, time, signals(coordinate, speed), 60.0, 1)
    source = LOAD.sources[SOURCE]
    power = drive.power[0, SOURCE]
    assert power == pytest.approx(1.1 * float(screw_friction(speed[0], **parameters_of(source.use))), rel=1e-12)
    shares = drive.port_heat[0, SEGMENTS] / (source.rail_share * power)
    np.testing.assert_allclose(shares, FIFTHS, atol=1e-12)
    np.testing.assert_allclose(drive.weight[0, PAIR], FIFTHS, atol=1e-12)  # and so the conductance
    np.testing.assert_allclose(drive.square[0, PAIR], FIFTHS, atol=1e-12)
    assert not drive.neighbour[0, PAIR].any()


def test_between_stations_the_neighbours_take_part():
    """The interpolated assignment spreads the same heat over seven segments; the default stays that."""
    assert synthetic.load_model().pairs[0].assignment == "interpolated"
    time, coordinate, speed = sweep(2, 0.25)
    drive = evaluate(screw("interpolated"), time, signals(coordinate, speed), 60.0, 1)
    heat = drive.port_heat[0, SEGMENTS]
    assert np.count_nonzero(heat > 1e-9 * heat.sum()) == 7
    np.testing.assert_allclose(heat[3:6] / heat.sum(), 0.2, atol=1e-12)
    assert heat.sum() == pytest.approx(0.6 * drive.power[0, SOURCE], rel=1e-12)


@pytest.mark.parametrize("dt", [60.0, 7.0, 0.9])
@pytest.mark.parametrize("assignment", ["segment", "interpolated"])
def test_energy_is_conserved_whatever_the_way(dt: float, assignment: str):
    rng = np.random.default_rng(3)
    time = np.cumsum(rng.uniform(0.05, 2.0, 500))
    coordinate, speed = rng.uniform(-0.2, 1.3, 500), rng.normal(size=500)  # beyond both ends at times
    drive = evaluate(screw(assignment), time, signals(coordinate, speed), dt)
    np.testing.assert_allclose(
        drive.port_heat.sum(axis=1), drive.power[:, SOURCE], rtol=1e-12, atol=1e-12 * drive.power.max()
    )
    np.testing.assert_allclose(drive.weight[:, PAIR].sum(axis=1), 1.0, atol=1e-12)


def test_shares_are_the_time_over_each_segment():
    """Against the dwell times of the compressed log, which are found another way."""
    rng = np.random.default_rng(5)
    time = np.arange(0.0, 600.5, 0.5)
    coordinate = 0.5 + 0.45 * np.sin(0.03 * time + np.cumsum(rng.normal(size=len(time))) * 0.1)
    drive = evaluate(LOAD, time, signals(coordinate, np.ones(len(time))), 60.0)
    ours = dwell_shares(time, coordinate, drive.time, BORDERS)
    np.testing.assert_allclose(drive.weight[:, PAIR], ours, atol=1e-12)
    np.testing.assert_allclose(
        drive.port_heat[:, SEGMENTS], 0.6 * drive.power[:, [SOURCE]] * ours, rtol=1e-11, atol=1e-12
    )


def test_heat_follows_the_speed_at_each_place():
    """Slow over one segment, fast over another: dwell and friction balance, so every metre gets the same heat."""
    time = np.array([0.0, 40.0, 50.0])
    coordinate = np.array([0.3, 0.4, 0.5])  # 2.5 mm/s over segment 4, 10 mm/s over segment 5
    drive = evaluate(LOAD, time, signals(coordinate, np.array([0.0025, 0.01, 0.01])), 50.0, 1)
    heat = drive.port_heat[0, SEGMENTS]
    assert heat[3] == pytest.approx(heat[4], rel=1e-12)
    np.testing.assert_allclose(drive.weight[0, PAIR, 3:5], [0.8, 0.2], rtol=1e-12)


@pytest.mark.parametrize("size", [1, 7, 50, 1000])
def test_block_by_block_is_the_same(size: int):
    """Through blocks of records and back, and evaluated in pieces as they come: the same means, the same energy."""
    time, coordinate, speed = sweep(6, 0.1)
    speed = speed * (1.0 + 0.5 * np.sin(time))
    records = np.column_stack([coordinate, speed])
    log = resolve(group([records], ["s", "v"], ["m", "m/s"], 0.0, 0.1, size)).table
    whole = evaluate(LOAD, time, signals(coordinate, speed), 10.0, 6)
    from_blocks = evaluate(LOAD, log.time, signals(log.columns["s"], log.columns["v"]), 10.0, 6)
    np.testing.assert_allclose(from_blocks.port_heat, whole.port_heat, rtol=1e-9, atol=1e-12)
    parts = []
    for k in range(6):  # a piece ends with the first record of the next one: positions run to it
        rows = slice(100 * k, 100 * (k + 1) + 1)
        parts.append(evaluate(LOAD, time[rows], signals(coordinate[rows], speed[rows]), 10.0, 1))
    np.testing.assert_allclose(np.vstack([p.port_heat for p in parts]), whole.port_heat, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(np.vstack([p.weight for p in parts]), whole.weight, atol=1e-12)
    total = sum(p.port_heat.sum() for p in parts)
    assert total == pytest.approx(whole.power[:, SOURCE].sum(), rel=1e-12)

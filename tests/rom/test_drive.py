"""Loads become heat, films and contact positions without losing energy or flags."""

import time as clock
from dataclasses import replace

import numpy as np
import pytest
import synthetic

from twin.errors import LogError
from twin.physics import motors
from twin.rom.contact import station_weights
from twin.rom.drive import evaluate
from twin.rom.load_model import LawUse, Signal, Source

LOAD = synthetic.load_model()


def at_rest(time, **changes):
    """Signals of a machine standing still in the middle of its strokes, with `changes`."""
    signals = {s.name: np.full(len(time), 20.0 if s.unit == "degC" else 0.0) for s in LOAD.signals}
    for axis in LOAD.axes:
        signals[axis.position] = np.full(len(time), 0.4)
    return signals | changes


@pytest.mark.parametrize("dt", [60.0, 7.0, 13.7, 1000.0])
def test_energy_is_that_of_the_held_samples(dt):
    time, signals = synthetic.loads(LOAD, sampling=7.3)
    drive = evaluate(LOAD, time, signals, dt)
    power = np.asarray(motors.motor_copper(signals["x_current"], 0.4))
    end = np.append(time[1:], np.inf)
    held = np.clip(np.minimum(end, drive.time[-1]) - time, 0.0, None)
    assert np.sum(drive.power[:, 0] * np.diff(drive.time)) == pytest.approx(power @ held, rel=1e-12)


def test_powers_are_averaged_not_currents():
    """20 % duty at 10 A is 20 % of the heat of 10 A, not 4 %."""
    time = np.arange(0.0, 600.0, 1.0)
    drive = evaluate(LOAD, time, at_rest(time, x_current=np.where(time % 10 < 2, 10.0, 0.0)), 60.0)
    np.testing.assert_allclose(drive.power[:, 0], 0.2 * 3 * 0.4 * 10.0**2, rtol=1e-13)


def test_step_inside_a_sample_and_sample_inside_a_step():
    time = np.array([0.0, 100.0, 130.0])
    drive = evaluate(LOAD, time, at_rest(time, x_current=np.array([1.0, 2.0, 3.0])), 60.0)
    held = 1.2 * np.array([1.0, (40 * 1.0 + 20 * 4.0) / 60, (10 * 4.0 + 50 * 9.0) / 60])
    np.testing.assert_allclose(drive.power[:, 0], held, rtol=1e-13)
    np.testing.assert_allclose(drive.time, [0.0, 60.0, 120.0, 180.0])


def test_times_since_1970_give_the_same_drive():
    time, signals = synthetic.loads(LOAD)
    here, there = evaluate(LOAD, time, signals, 60.0), evaluate(LOAD, time + 1.8e9, signals, 60.0)
    np.testing.assert_allclose(there.power, here.power, rtol=1e-6)
    np.testing.assert_allclose(there.weight, here.weight, atol=1e-6)


def test_a_uniform_sweep_spreads_exactly():
    """Equal dwell on all segments: h/L inside, half of it at the ends; exact for w^2 and w_i w_{i+1} too."""
    pair = LOAD.pairs[2]  # the x nut
    stations = np.asarray(LOAD.rails[pair.rail].stations)
    n = len(stations)
    sweep = stations[[0, -1]] - pair.station  # positions beyond the stroke are fine for this purpose
    time = np.array([0.0, 60.0])
    signals = at_rest(time, x_position=sweep, x_speed=np.array([0.3, 0.3]))
    drive = evaluate(LOAD, time, signals, 60.0)
    inner = 1.0 / (n - 1)
    shares = np.full(n, inner)
    shares[[0, -1]] /= 2
    np.testing.assert_allclose(drive.weight[0, 2, :n], shares, rtol=1e-12)
    np.testing.assert_allclose(drive.square[0, 2, :n], shares * 2 / 3, rtol=1e-12)
    np.testing.assert_allclose(drive.neighbour[0, 2, : n - 1], inner / 6, rtol=1e-12)
    ports = slice(LOAD.rails[pair.rail].first_port, LOAD.rails[pair.rail].first_port + n)
    np.testing.assert_allclose(drive.port_heat[0, ports], 0.6 * drive.power[0, 1] * shares, rtol=1e-12)


def test_dwell_is_the_mean_along_the_path():
    time, signals = synthetic.loads(LOAD, hours=0.2)
    drive = evaluate(LOAD, time, signals, 60.0)
    for k, pair in enumerate(LOAD.pairs):
        stations = np.asarray(LOAD.rails[pair.rail].stations)
        fine = np.linspace(0.0, 60.0, 40001)[:-1] + 60.0 / 80000
        position = np.interp(60.0 * 3 + fine, time, signals[LOAD.axes[pair.axis].position])
        s = pair.station - position if pair.rail_moves else pair.station + position
        i, right = station_weights(stations, s)
        w = np.zeros((len(s), len(stations)))
        w[np.arange(len(s)), i] = 1 - right
        w[np.arange(len(s)), i + 1] += right
        np.testing.assert_allclose(drive.weight[3, k], w.mean(axis=0), atol=1e-7)
        np.testing.assert_allclose(drive.square[3, k], (w**2).mean(axis=0), atol=1e-7)
        np.testing.assert_allclose(drive.neighbour[3, k, :-1], (w[:, 1:] * w[:, :-1]).mean(axis=0), atol=1e-7)


def test_friction_heat_goes_where_it_is_made():
    """Half a step resting at one end, half moving at the other: the heat belongs to the moving half."""
    pair = LOAD.pairs[2]
    time = np.array([0.0, 30.0, 30.001, 60.0])
    position = np.array([0.0, 0.0, 0.7, 0.75])
    speed = np.array([0.0, 0.0, 0.05 / 29.999, 0.0])
    drive = evaluate(LOAD, time, at_rest(time, x_position=position, x_speed=speed), 60.0)
    rail = LOAD.rails[pair.rail]
    heat = drive.port_heat[0, rail.first_port : rail.first_port + len(rail.stations)]
    far = np.asarray(rail.stations) > pair.station + 0.5
    assert heat[far].sum() == pytest.approx(heat.sum(), rel=1e-12)
    assert drive.weight[0, 2, : len(far)][~far].sum() == pytest.approx(0.5, abs=1e-3)


def test_contact_heat_is_conserved():
    law = LawUse("guide_friction", {"load": 1e4}, {"speed": "x_speed"})
    load = replace(LOAD, sources=(*LOAD.sources, Source("guide", law, 1.0, "x_guide", 0.5)))
    time, signals = synthetic.loads(load)
    drive = evaluate(load, time, signals, 60.0)
    contact = [j for j, s in enumerate(load.sources) if s.contact]
    np.testing.assert_allclose(drive.port_heat.sum(axis=1), drive.power[:, contact].sum(axis=1), rtol=1e-12, atol=1e-12)
    assert drive.port_heat.max() > 0.0


def flagged(drive):
    return {
        name: np.flatnonzero(drive.flags[:, k]).tolist()
        for k, name in enumerate(drive.flag_names)
        if drive.flags[:, k].any()
    }


def test_no_flag_inside_the_certified_box():
    time, signals = synthetic.loads(LOAD)
    assert flagged(evaluate(LOAD, time, signals, 60.0)) == {}


def test_bounds_themselves_are_inside():
    time = np.arange(0.0, 300.0, 10.0)
    assert flagged(evaluate(LOAD, time, at_rest(time, x_current=np.full(30, 20.0)), 60.0)) == {}


def test_every_kind_of_flag():
    time = np.arange(0.0, 600.0, 10.0)
    step = (time // 60).astype(int)
    signals = at_rest(time, x_current=np.where(step == 2, 21.0, 1.0), ambient=np.where(step == 4, 5.0, 20.0))
    signals["y_speed"] = np.where(step == 5, 9.0, 0.0)
    signals["z_unused"] = np.full(60, np.nan)
    assert flagged(evaluate(LOAD, time, signals, 60.0)) == {
        "signals.ambient below 10 degC": [4],
        "signals.x_current above 20 A": [2],
        "signals.y_speed above 1 m/s": [5],
    }


def test_missing_values_are_held_and_flagged():
    time = np.arange(0.0, 600.0, 10.0)
    current = np.full(60, 4.0)
    current[20:24] = np.nan
    drive = evaluate(LOAD, time, at_rest(time, x_current=current), 60.0)
    assert flagged(drive) == {"signals.x_current missing, last value held": [3]}
    np.testing.assert_allclose(drive.power[:, 0], 1.2 * 16.0)


def test_positions_beyond_stroke_and_stations():
    time = np.arange(0.0, 601.0, 10.0)
    position = np.interp(time, [0, 300, 600], [0.4, 0.9, 0.4])
    signals = tuple(replace(s, high=2.0) if s.name == "x_position" else s for s in LOAD.signals)
    found = flagged(evaluate(replace(LOAD, signals=signals), time, at_rest(time, x_position=position), 60.0))
    assert found == {"axes.x beyond its stroke": [4, 5]}
    more_pads = replace(synthetic.load_model(pads=4), signals=signals)  # at 0.1 .. 0.4 m; stations reach to 1.15 m
    found = flagged(evaluate(more_pads, time, at_rest(time, x_position=position), 60.0))
    assert found == {
        "axes.x beyond its stroke": [4, 5],
        "contacts.x_guide: x_guide.pad[2] beyond the stations of its rail": [4, 5],
        "contacts.x_guide: x_guide.pad[3] beyond the stations of its rail": [3, 4, 5, 6],
    }


def test_gaps_and_the_end_of_the_log():
    time = np.concatenate([np.arange(0.0, 300.0, 10.0), np.arange(600.0, 900.0, 10.0)])
    found = flagged(evaluate(LOAD, time, at_rest(time), 60.0, n_steps=18))
    assert found == {"gap in loads": [4, 5, 6, 7, 8, 9], "after the end of loads, last values held": [16, 17]}


def test_forty_signals_keep_their_flags():
    """More conditions than a machine word has bits."""
    extra = tuple(Signal(f"s{i}", f"s{i}", "1", "value", 0.0, 1.0) for i in range(40))
    load = replace(LOAD, signals=LOAD.signals + extra)
    time = np.arange(0.0, 120.0, 10.0)
    signals = at_rest(time) | {f"s{i}": np.full(12, 2.0) for i in range(40)}
    assert set(flagged(evaluate(load, time, signals, 60.0))) == {f"signals.s{i} above 1 1" for i in range(40)}


def test_bad_logs_are_refused():
    time = np.arange(0.0, 120.0, 10.0)
    signals = at_rest(time)
    signals.pop("x_speed")
    signals.pop("ambient")
    with pytest.raises(LogError, match="ambient, x_speed"):
        evaluate(LOAD, time, signals, 60.0)
    with pytest.raises(LogError, match="increase"):
        evaluate(LOAD, time[::-1], at_rest(time), 60.0)
    with pytest.raises(LogError, match="no valid value"):
        evaluate(LOAD, time, at_rest(time, x_current=np.full(12, np.nan)), 60.0)
    with pytest.raises(LogError, match="3 values for 12 times"):
        evaluate(LOAD, time, at_rest(time, x_current=np.zeros(3)), 60.0)


def test_a_day_of_fast_samples_is_quick():
    load = synthetic.load_model(n_bodies=4, n_segments=12, pads=4)
    time, signals = synthetic.loads(load, hours=12.0, sampling=1.0)
    evaluate(load, time[:100], {k: v[:100] for k, v in signals.items()}, 60.0)  # compile
    start = clock.perf_counter()
    evaluate(load, time, signals, 60.0)
    assert clock.perf_counter() - start < 3.0  # 0.4 s alone on one core of 2026; the bound leaves room for company

"""What a plan tells a machine to do: signals of one motor follow each other as in the runs, all within their ranges."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.diagnose.small_case import runs, study
from twin.build.full_model import assemble
from twin.diagnose.plan.actuators import actuators_of
from twin.diagnose.plan.experiments import experiments_of, longest_of
from twin.logs.signals import signal_values
from twin.machine.load import load_machine
from twin.rom.load_model import AxisWiring, EnvironmentWiring, Film, LawUse, LoadModel, Pair, Signal, Source

BALL_SCREW = Path(__file__).parents[2] / "models" / "ball_screw_axis" / "nodes.toml"


@pytest.fixture(scope="module")
def ball_screw() -> LoadModel:
    return assemble(load_machine(BALL_SCREW)).thermal.load_model


def moved(n: int = 600) -> dict[str, np.ndarray]:
    """An axis that runs at three speeds with rests between, and its motor: 1 A at rest, 3 A and more in motion."""
    speed = np.repeat([0.0, 0.1, 0.0, 0.2, 0.0, 0.4], n // 6)
    return {
        "x_speed": speed,
        "screw_speed": speed / 0.02,
        "x_current": np.where(speed > 0.0, 3.0 + 5.0 * speed, 1.0),
        "ambient": np.full(n, 20.0),
    }


@pytest.mark.long
def test_the_signals_of_an_axis_are_one_actuator_and_follow_its_speed(ball_screw):
    (x,) = actuators_of(ball_screw, [moved()])
    assert (x.name, x.leader, set(x.followers)) == ("x", "x_speed", {"screw_speed", "x_current"})
    at = x.at(np.array([0.0, 0.2, 0.4]))
    assert at["screw_speed"] == pytest.approx([0.0, 10.0, 20.0])  # a lead of 20 mm
    assert at["x_current"] == pytest.approx([1.0, 4.0, 5.0])


def two_axes() -> LoadModel:
    """Two axes with a motor, a guide and a bearing each, a spindle, and a draught that nobody commands."""
    of_axis = (("position", "m", 0.4), ("speed", "m/s", 0.6), ("current", "A", 15.0), ("motor_speed", "1/s", 30.0))
    rows = [(f"{a}_{what}", unit, high) for a in "xy" for what, unit, high in of_axis]
    rows += [("spindle_speed", "1/s", 160.0), ("spindle_current", "A", 50.0), ("draught", "m/s", 1.0)]
    signals = tuple(Signal(n, n, unit, "rms" if unit == "A" else "value", 0.0, high) for n, unit, high in rows)
    sources = []
    for a in "xy":
        motor = {"current": f"{a}_current", "speed": f"{a}_speed"}
        sources.append(Source(f"{a}_motor", LawUse("axis_motor", {}, motor), 1.0, "", 0.0))
        sources.append(
            Source(f"{a}_bearing", LawUse("bearing_friction", {}, {"speed": f"{a}_motor_speed"}), 1.0, "", 0.0)
        )
        sources.append(
            Source(f"{a}_guide", LawUse("guide_friction", {}, {"speed": f"{a}_speed"}), 1.0, f"{a}_guide", 0.5)
        )
    for s, law in (("speed", "bearing_friction"), ("current", "motor_copper")):
        sources.append(Source(f"spindle_{s}", LawUse(law, {}, {s: f"spindle_{s}"}), 1.0, "", 0.0))
    film = Film("housing", LawUse("mixed_plate", {}, {"speed": "draught"}), 0, 1.0, 10.0)
    axes = tuple(AxisWiring(a, (1.0, 0.0, 0.0), -0.4, 0.4, f"{a}_position") for a in "xy")
    pairs = tuple(Pair(f"{a}_guide", i, i, i, 0.0, False, 1.0, 1.0) for i, a in enumerate("xy"))
    air = (EnvironmentWiring("room", "", 20.0),)
    return LoadModel(signals, axes, air, tuple(sources), (film,), (), (), (), pairs)


def seen(load: LoadModel, **changes: np.ndarray) -> dict[str, np.ndarray]:
    return {s.name: np.zeros(400) for s in load.signals} | changes


def test_axes_that_always_moved_together_can_be_moved_apart():
    """The runs alone would take them for one."""
    load, on, off = two_axes(), np.repeat([0.0, 0.3, 0.0, 0.3], 100), np.repeat([1.0, 0.0, 0.0, 1.0], 100)
    both = {f"{a}_{what}": factor * on for a in "xy" for what, factor in
            (("speed", 1.0), ("current", 20.0), ("motor_speed", 50.0))}  # fmt: skip
    run = seen(load, **both, spindle_speed=100.0 * off, spindle_current=20.0 * off)
    found = {a.name: {a.leader, *a.followers} for a in actuators_of(load, [run])}
    assert found["x"] == {"x_speed", "x_current", "x_motor_speed"}
    assert found["y"] == {"y_speed", "y_current", "y_motor_speed"}
    assert found["spindle_speed"] == {"spindle_speed", "spindle_current"}
    assert "draught" not in set().union(*found.values())


def test_what_never_moved_belongs_to_the_axis_of_its_name_and_has_its_range():
    load = two_axes()
    found = {a.name: a for a in actuators_of(load, [seen(load)])}
    x = found["x"]
    assert (x.leader, set(x.followers)) == ("x_speed", {"x_current", "x_motor_speed"})
    top = x.at(np.array([0.0, x.top]))
    assert top["x_motor_speed"] == pytest.approx([0.0, 30.0])
    assert top["x_current"] == pytest.approx([0.0, 15.0])
    assert {"x", "y"} < set(found)


def test_every_experiment_is_as_long_and_stays_within_the_declared_ranges():
    load = study().probed.base.load_model
    run = runs()[longest_of(runs())]
    actuators = actuators_of(load, [r.run.signals for r in study().runs])
    made = experiments_of(load, run, ["front", "housing"], actuators, ["shaft"])
    assert {e.name for e in made} >= {
        "again",
        "x to and fro",
        "spindle_speed in steps",
        "long rest",
        "warm start",
        "sensor",
    }
    stroke = next(a for a in load.axes if a.name == "x")
    for e in made:
        loads = e.run.loads
        assert loads.time[-1] - loads.time[0] == pytest.approx(run.loads.time[-1] - run.loads.time[0], abs=60.0)
        values = signal_values(e.run, load.signals)
        for s in load.signals:
            if s.name == stroke.position:
                assert stroke.low <= values[s.name].min() <= values[s.name].max() <= stroke.high
            else:
                assert s.low - 1e-9 <= values[s.name].min() <= values[s.name].max() <= s.high + 1e-9, (e.name, s.name)
        assert np.array_equal(e.run.tcp.position, run.tcp.position)
    by_name = {e.name: signal_values(e.run, load.signals) for e in made}
    x, spindle = by_name["x to and fro"], by_name["spindle_speed in steps"]
    assert np.ptp(x["x_position"]) > 0.9 * (stroke.high - stroke.low)
    assert not x["spindle_speed"].any()
    assert not spindle["x_speed"].any()
    top = spindle["spindle_speed"].max()
    assert np.unique(spindle["spindle_speed"] / top) == pytest.approx([0.0, 0.25, 0.5, 1.0])
    assert not any(v.any() for name, v in by_name["warm start"].items() if name.endswith("speed"))
    warm = next(e for e in made if e.name == "warm start").run
    assert warm.initial_temperature > run.loads.columns["shop_air"][0] + 1.0


def test_a_peak_current_is_written_as_it_is_logged():
    load = study().probed.base.load_model
    peak = replace(load, signals=tuple(replace(s, kind="peak") if s.unit == "A" else s for s in load.signals))
    run = runs()[0]
    read = []
    for own in (load, peak):
        actuators = actuators_of(own, [r.run.signals for r in study().runs])
        made = {e.name: e for e in experiments_of(own, run, [], actuators, [])}
        name = next(n for n in made if n.startswith("spindle_current") or n == "long rest")
        read.append(signal_values(made[name].run, own.signals)["spindle_current"])
    assert read[0] == pytest.approx(read[1])
    assert read[0].max() > 0.0

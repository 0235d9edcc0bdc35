"""The stored trials: what is hidden, where and how large, in machines that the full model goes through the runs of.

A trial is another machine (`twin.inject.truth.other_machine`, of its own seed) in the three runs of an experiment on
models/five_axis; `python -m benchmarks.hidden_store` makes their truths. Those below are made to a purpose, parameters
and noise drawn; `twin.inject.stored.drawn` has those of which place, kind, size and time are drawn as well.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from functools import lru_cache

from twin.inject.damage.channels import Damage
from twin.inject.experiment import HOUR, RUNS, Experiment
from twin.inject.hidden import Hidden
from twin.inject.stored.drawn import drawn_recipes
from twin.inject.stored.recipe import Recipe, effect
from twin.inject.stored.windows import bell, hours, telegraph
from twin.machine.effects.effect import Effect

RUN_1, RUN_2, SEALED = RUNS
DOOR = hours(RUN_1, (3.0, 6.0), (8.0, 9.5)) + hours(RUN_2, (2.0, 5.0), (8.5, 10.0)) + hours(SEALED, (4.0, 7.0))
CUTTING = hours(RUN_1, (4.3, 6.4), (9.4, 10.6)) + hours(RUN_2, (0.5, 1.8), (9.0, 10.9)) + hours(SEALED, (4.0, 5.4))
BROKEN = hours(RUN_2, (6.0, 13.0)) + hours(SEALED, (0.0, 13.0))
SUN = bell(RUN_1, 3.0, 8.0, 1.0) + bell(RUN_2, 0.0, 4.0, 0.6) + bell(SEALED, 1.0, 6.0, 0.85)


@lru_cache(maxsize=2)
def table(experiment: Experiment) -> Mapping[str, Recipe]:
    """All stored trials by name, the most important first: truths are made in this order."""
    recipes = (*_machines(), *_logs(experiment.machine.signals), *drawn_recipes(experiment).values())
    return {r.name: r for r in recipes}


def simulated(experiment: Experiment) -> tuple[str, ...]:
    """Those of which the machine is another one: they have a truth of their own."""
    return tuple(name for name, r in table(experiment).items() if r.seed and not r.truth)


def _machines() -> tuple[Recipe, ...]:
    """Something hidden in the machine."""
    heating, cooling = telegraph(7)
    heat = effect("heat_source", "bed.left", 14.0, "W")
    zone = effect("zone", "environment.enclosure", 2.5, "K", windows=DOOR)
    return (
        _in_machine("heat_source", 101, heat),
        # of joints that carry little heat, such as the bearing of B, nothing shows: the flange has that of the spindle
        _in_machine("joint", 102, effect("joint", "contacts.spindle_flange", 0.08, "1", windows=BROKEN)),
        _in_machine("coolant", 103, effect(
            "coolant", "table.top", 60.0, "W/(m^2*K)", windows=CUTTING, settings={"temperature": 14.0}
        )),
        _in_machine("zone", 104, zone),
        _in_machine("forced_convection", 105, effect(
            "forced_convection", "column.front", 30.0, "W/(m^2*K)", signal="x_speed", exponent=0.8
        )),
        _in_machine("sun", 106, effect("sun", "column.left", 80.0, "W", windows=SUN)),
        _in_machine("film_gain", 107, effect("film_gain", "films.headstock", 3.0, "1")),
        _in_machine("loss_law", 108, effect("loss_law", "sources.x_motor", 2.2, "1")),
        # a bearing of X or Z gives some 2 W in the mean, too little to be missed: a motor's heat is elsewhere
        _in_machine("misplaced_source", 109, effect(
            "misplaced_source", "sources.z_motor", math.nan, "", settings={"surface": "bed.stem_left"}
        )),
        _in_machine("expansion", 115, effect("expansion", "parts.column", 1.6, "1")),
        _in_machine("capacity", 111, effect(
            "capacity", "column.top", 60e3, "J/K", settings={"conductance": 200.0}
        )),
        # friction of a power 8/3 in place of 5/3, with as much heat on the whole: nearly the same history
        _in_machine("pair", 112, effect(
            "loss_law", "sources.spindle_bearing", 600.0, "W", signal="spindle_speed", exponent=8.0 / 3.0,
            settings={"gain": 0.0},
        )),
        _in_machine("two", 113, effect("heat_source", "column.back", 25.0, "W"), zone),
        # a thin film to 62 degC or to -18 degC gives 25 W of either sign, for bed.back (0.75 m^2) stays near 22 degC
        Recipe("outside", (Hidden("", "bed.back", "telegraph", 25.0, "W"),), 114, tuple(
            effect("coolant", "bed.back", 25.0 / (0.75 * 40.0), "W/(m^2*K)", windows=w, settings={"temperature": T})
            for w, T in ((heating, 62.0), (cooling, -18.0))
        )),
        Recipe("null_law", (), 115),
        Recipe(
            "initial_state", (Hidden("initial_state", "", "always", math.nan, "K"),), 116,
            before={RUN_1: 3.0, RUN_2: 2.0, SEALED: 2.5},
        ),
        _in_machine("below_limit", 117, effect("heat_source", "bed.left", 0.7, "W")),
        _in_machine("scale_expansion", 115, effect(
            "scale_expansion", "axes.y", 10e-6, "1/K", settings={"fixed_at": 0.0}
        )),  # of one machine: expansion, scale_expansion and null_law share their temperatures
    )  # fmt: skip


def _logs(signals: Iterable[str]) -> tuple[Recipe, ...]:
    """Faults of a log, and what the artefact has wrong; signals: of the machine, a clock is late for all of them."""
    return (
        Recipe("null_0", ()),
        # peak values under the name of rms
        _in_log("signal_peak", Damage("signal", "signals.x_current", math.sqrt(2.0), "factor"), "1"),
        Recipe(
            "clock", (Hidden("signal", f"runs.{RUN_2}", "clock", 360.0, "s"),), truth="null_0",
            damages=tuple((RUN_2, Damage("signal", f"signals.{name}", 360.0, "clock")) for name in signals),
        ),
        _in_log("sensor_offset", Damage("sensor", "sensors.column_back", 1.0, "offset"), "K"),
        _in_log("sensor_drift", Damage("sensor", "sensors.carriage", 0.6, "drift"), "K"),  # in 12 h
        _in_log("sensor_swapped", Damage(
            "sensor", "sensors.x_bearing", math.nan, "swapped", other="sensors.x_motor"
        ), ""),
        _in_log("sensor_stuck", Damage(
            "sensor", "sensors.quill_top", 4.0 * HOUR, "stuck", start=5.0 * HOUR
        ), "s", RUNS[:1]),
        _in_log("slip", Damage("slip", "tcp.dy", 6e-6, "play"), "m"),
        Recipe(
            "not_thermal", (Hidden("not_thermal", "tcp.dx", "step", 10e-6, "m"),), truth="null_0",
            damages=tuple(
                (run, Damage("not_thermal", "tcp.dx", 10e-6, "step", start=start))
                for run, start in ((RUN_2, 5.2 * HOUR), (SEALED, 0.0))
            ),
        ),
        _in_log("measurement", Damage("measurement", "tcp.dz", 8e-6, "drift"), "m"),
        # nothing is done to the data: it is diagnosed with an artefact of few states
        Recipe("coarse_model", (Hidden("coarse_model", "artefact", "always", math.nan, ""),), truth="null_0"),
        Recipe(
            "effect_and_sensor",
            (
                Hidden("heat_source", "bed.left", "always", 14.0, "W"),
                Hidden("sensor", "sensors.column_right", "drift", 0.8, "K"),
            ),
            101, damages=(("", Damage("sensor", "sensors.column_right", 0.8, "drift")),), truth="heat_source",
        ),
    )  # fmt: skip


def _in_machine(name: str, seed: int, *effects: Effect) -> Recipe:
    hidden = [
        Hidden(e.family, e.place, e.history, e.amplitude, e.unit, e.windows, e.signal, e.exponent, e.settings)
        for e in effects
    ]
    return Recipe(name, tuple(hidden), seed, effects)


def _in_log(name: str, damage: Damage, unit: str, runs: tuple[str, ...] = ("",)) -> Recipe:
    settings: dict[str, float | str] = {"other": damage.other} if damage.other else {}
    hidden = Hidden(damage.family, damage.place, damage.history, damage.size, unit, settings=settings)
    return Recipe(name, (hidden,), damages=tuple((run, damage) for run in runs), truth="null_0")

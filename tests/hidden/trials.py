"""The trials that tests diagnose: what is hidden, where, how large, and what a diagnosis should say of it.

A trial is another machine (`benchmarks.hidden_truth.other_text` of its own seed) through the three runs of
`tests.hidden.load.RUNS`. `benchmarks.hidden_store` steps the full model through these trials and writes
tests/hidden/truth/NAME.npz. Those below are made to a purpose, parameters and noise drawn; `tests.hidden.drawn` has
those of which place, kind, size and time are drawn as well.

    runs, expected = trial("heat_source")
"""

from __future__ import annotations

import math

from tests.hidden.drawn import DRAWN
from tests.hidden.load import MODEL, RUNS, TRUTH, load
from tests.hidden.trial import (
    HOUR,
    Expected,
    Trial,
    bell,
    cause_of,
    hours,
    in_log,
    in_machine,
    telegraph,
)
from twin.inject.damage.channels import Damage
from twin.inject.damage.kinds import damaged
from twin.logs.run import Run
from twin.machine.load import load_machine

RUN_1, RUN_2, SEALED = RUNS


def trial(name: str) -> tuple[tuple[Run, ...], Expected]:
    """The runs of a trial as they were logged and measured, in the order of RUNS, and what is expected of them."""
    found = TRIALS[name]
    runs = []
    for run in load(found.file, found.noise)[0]:
        for where, damage in found.damages:
            if where in ("", run.folder.name):
                run = damaged(run, damage)
        runs.append(run)
    return tuple(runs), found.expected


def stored() -> tuple[str, ...]:
    """The trials whose truth lies in the repository."""
    return tuple(name for name, found in TRIALS.items() if (TRUTH / f"{found.file}.npz").exists())


DOOR = hours(RUN_1, (3.0, 6.0), (8.0, 9.5)) + hours(RUN_2, (2.0, 5.0), (8.5, 10.0)) + hours(SEALED, (4.0, 7.0))
CUTTING = hours(RUN_1, (4.3, 6.4), (9.4, 10.6)) + hours(RUN_2, (0.5, 1.8), (9.0, 10.9)) + hours(SEALED, (4.0, 5.4))
BROKEN = hours(RUN_2, (6.0, 13.0)) + hours(SEALED, (0.0, 13.0))
SUN = bell(RUN_1, 3.0, 8.0, 1.0) + bell(RUN_2, 0.0, 4.0, 0.6) + bell(SEALED, 1.0, 6.0, 0.85)
_HEATING, _COOLING = telegraph(7)
_LOGGED = tuple(load_machine(MODEL / "machine.toml").signals)  # a clock is late for all of them
_HEAT = cause_of("heat_source", "bed.left", 14.0, "W")
_ZONE = cause_of("zone", "environment.enclosure", 2.5, "K", windows=DOOR)

# The most important first: `benchmarks.hidden_store` makes them in this order.
_MACHINE = (
    in_machine("heat_source", 101, _HEAT),
    # of joints that carry little heat, such as the bearing of B, nothing shows: the flange has that of the spindle
    in_machine("joint", 102, cause_of("joint", "contacts.spindle_flange", 0.08, "1", windows=BROKEN)),
    in_machine("coolant", 103, cause_of(
        "coolant", "table.top", 60.0, "W/(m^2*K)", windows=CUTTING, settings={"temperature": 14.0}
    )),
    in_machine("zone", 104, _ZONE),
    in_machine("forced_convection", 105, cause_of(
        "forced_convection", "column.front", 30.0, "W/(m^2*K)", signal="x_speed", exponent=0.8
    )),
    in_machine("sun", 106, cause_of("sun", "column.left", 80.0, "W", windows=SUN)),
    in_machine("film_gain", 107, cause_of("film_gain", "films.headstock", 3.0, "1")),
    in_machine("loss_law", 108, cause_of("loss_law", "sources.x_motor", 2.2, "1"),
                verdicts=("named", "out_of_tolerance")),
    # a bearing of X or Z gives some 2 W in the mean, too little to be missed: a motor's heat is elsewhere
    in_machine("misplaced_source", 109, cause_of(
        "misplaced_source", "sources.z_motor", math.nan, "", settings={"surface": "bed.stem_left"}
    )),
    in_machine("expansion", 115, cause_of("expansion", "parts.column", 1.6, "1")),
    in_machine("capacity", 111, cause_of(
        "capacity", "column.top", 60e3, "J/K", settings={"conductance": 200.0}
    )),
    # friction of a power 8/3 in place of 5/3, with as much heat on the whole: nearly the same history
    in_machine("pair", 112, cause_of(
        "loss_law", "sources.spindle_bearing", 600.0, "W", signal="spindle_speed", exponent=8.0 / 3.0,
        settings={"gain": 0.0},
    ), verdicts=("named", "ambiguous")),
    in_machine("two", 113, cause_of("heat_source", "column.back", 25.0, "W"), _ZONE),
    # a thin film to 62 degC or to -18 degC gives 25 W of either sign, for bed.back (0.75 m^2) stays near 22 degC
    Trial("outside", Expected(("unknown",), "", "bed.back", 25.0, "W", "telegraph"), 114, tuple(
        cause_of("coolant", "bed.back", 25.0 / (0.75 * 40.0), "W/(m^2*K)", windows=w, settings={"temperature": T})
        for w, T in ((_HEATING, 62.0), (_COOLING, -18.0))
    )),
    Trial("null_law", Expected(("nothing",), "", "", math.nan, "", ""), 115),
    Trial(
        "initial_state", Expected(("named",), "initial_state", "", math.nan, "K", "always"), 116,
        before={RUN_1: 3.0, RUN_2: 2.0, SEALED: 2.5},
    ),
    in_machine("below_limit", 117, cause_of("heat_source", "bed.left", 0.7, "W"), verdicts=("nothing",)),
    in_machine("scale_expansion", 115, cause_of(
        "scale_expansion", "axes.y", 10e-6, "1/K", settings={"fixed_at": 0.0}
    )),  # of one machine: expansion, scale_expansion and null_law share their temperatures
)  # fmt: skip

_LOG = (
    Trial("null_0", Expected(("nothing",), "", "", math.nan, "", "")),
    # peak values under the name of rms
    in_log("signal_peak", Damage("signal", "signals.x_current", math.sqrt(2.0), "factor"), "1", "signal"),
    Trial(
        "clock", Expected(("signal",), "signal", f"runs.{RUN_2}", 360.0, "s", "clock"), truth="null_0",
        damages=tuple((RUN_2, Damage("signal", f"signals.{name}", 360.0, "clock")) for name in _LOGGED),
    ),
    in_log("sensor_offset", Damage("sensor", "sensors.column_back", 1.0, "offset"), "K", "sensor"),
    in_log("sensor_drift", Damage("sensor", "sensors.carriage", 0.6, "drift"), "K", "sensor"),  # in 12 h
    in_log("sensor_swapped", Damage(
        "sensor", "sensors.x_bearing", math.nan, "swapped", other="sensors.x_motor"
    ), "", "sensor", places=("sensors.x_motor",)),
    in_log("sensor_stuck", Damage(
        "sensor", "sensors.quill_top", 4.0 * HOUR, "stuck", start=5.0 * HOUR
    ), "s", "sensor", RUNS[:1]),
    in_log("slip", Damage("slip", "tcp.dy", 6e-6, "play"), "m", "named"),
    Trial(
        "not_thermal", Expected(("named",), "not_thermal", "tcp.dx", 10e-6, "m", "step"), truth="null_0",
        damages=tuple(
            (run, Damage("not_thermal", "tcp.dx", 10e-6, "step", start=start))
            for run, start in ((RUN_2, 5.2 * HOUR), (SEALED, 0.0))
        ),
    ),
    in_log("measurement", Damage("measurement", "tcp.dz", 8e-6, "drift"), "m", "named"),
    Trial(
        "coarse_model", Expected(("named",), "coarse_model", "artefact", math.nan, "", "always"), truth="null_0",
        states=12,
    ),
    Trial(
        "effect_and_sensor",
        Expected(
            ("named", "sensor"), "heat_source", "bed.left", 14.0, "W", "always", (("sensor", "sensors.column_right"),)
        ),
        101, damages=(("", Damage("sensor", "sensors.column_right", 0.8, "drift")),), truth="heat_source",
    ),
)  # fmt: skip

TRIALS: dict[str, Trial] = {t.name: t for t in (*_MACHINE, *_LOG, *DRAWN)}
SIMULATED = tuple(t.name for t in (*_MACHINE, *DRAWN) if not t.truth)

"""The trials that tests diagnose: what is hidden, where, how large, and what a diagnosis should say of it.

A trial is another machine (`benchmarks.hidden_truth.other_text` of its own seed) through the three runs of
`tests.hidden.load.RUNS`. What is hidden in the machine is a `Cause`, put into its text as `twin hide` does it
(`hidden_text`); signals of its history are felt and not logged. `benchmarks.hidden_store` steps the full model through
these trials and writes tests/hidden/truth/NAME.npz. What is hidden in the log is done to a stored truth on reading, by
`twin.diagnose.damage`: such trials need no file of their own.

    runs, expected = trial("heat_source")

numpy and twin alone; no mesh, no full model.
"""

from __future__ import annotations

import hashlib
import json
import math
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from tests.hidden.load import MODEL, RUNS, TRUTH, load
from twin.diagnose.damage import damaged
from twin.diagnose.damage_access import Damage
from twin.diagnose.diagnosis import Cause, Verdict, Window
from twin.diagnose.edits import extended_description, loads_with
from twin.logs.read import read_run
from twin.logs.run import Run
from twin.machine.load import load_machine

HOUR, END = 3600.0, 13.0 * 3600.0  # s; END: after the last row of every run
RUN_1, RUN_2, SEALED = RUNS


@dataclass(frozen=True)
class Expected:
    """What a diagnosis should say. A place "" is one that nobody can name; size and place of a fault of a log are those
    of `twin.diagnose.damage`."""

    verdicts: tuple[Verdict, ...]  # any of them is right
    family: str  # of the first cause, "" where nothing is to be found
    place: str
    size: float  # SI, in `unit`; nan where there is none
    unit: str
    history: str  # in words, or the kind of a family that has several: "drift", "clock"
    further: tuple[tuple[str, str], ...] = ()  # (family, place) of other causes
    families: tuple[str, ...] = ()  # names that are right as well, where nature confounds them
    places: tuple[str, ...] = ()  # likewise


@dataclass(frozen=True)
class Trial:
    """One row of the table. Without causes and `other` the truth is that of a file which another trial made."""

    name: str
    expected: Expected
    seed: int = 0  # of the other machine
    causes: tuple[Cause, ...] = ()  # in the machine
    damages: tuple[tuple[str, Damage], ...] = ()  # (run, or "" for all; what is done to its log)
    before: Mapping[str, float] = field(default_factory=dict)  # h of work before the start of a run
    truth: str = ""  # file, of the trial's own name where empty
    states: int = 0  # the artefact that it is diagnosed with keeps so few; 0: any

    @property
    def noise(self) -> int:
        """The seed of its measurement noise."""
        return zlib.crc32(self.name.encode())

    @property
    def file(self) -> str:
        return self.truth or self.name


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


def hidden_text(text: str, found: Trial) -> tuple[str, dict[str, dict[str, np.ndarray]]]:
    """The text of a machine with the causes of a trial in it, and per run the signals (n,) that it feels unlogged."""
    edit = extended_description(text, found.causes, "hidden")
    felt: dict[str, dict[str, np.ndarray]] = {}
    for name in RUNS if edit.signals else ():
        loads = loads_with(read_run(MODEL / "runs" / name), edit.signals).loads
        felt[name] = {signal: loads.columns[signal] for signal in edit.signals}
    return edit.text, felt


def about(found: Trial) -> dict[str, object]:
    """What is said of a trial in its file, as JSON can say it."""
    e = found.expected
    hidden = {"family": e.family, "place": e.place, "size": None if math.isnan(e.size) else e.size, "unit": e.unit}
    return {
        "seed": found.seed,
        "hidden": {**hidden, "history": e.history, "further": [list(f) for f in e.further]} if found.causes else None,
        "before": dict(found.before),
        "made_of": _digest(found),
    }


def _digest(found: Trial) -> str:
    """Of everything that decides what the machine does: a file of another table is out of date."""
    causes = [
        [c.family, c.place, repr(c.amplitude), c.unit, c.signal, c.exponent, sorted(c.settings.items()),
         [[w.run, w.start, w.end, w.level] for w in c.windows]]
        for c in found.causes
    ]  # fmt: skip
    told = json.dumps([found.seed, causes, sorted(found.before.items())])
    return hashlib.sha256(told.encode()).hexdigest()[:16]


def stored() -> tuple[str, ...]:
    """The trials whose truth lies in the repository."""
    return tuple(name for name, found in TRIALS.items() if (TRUTH / f"{found.file}.npz").exists())


def _cause(
    family: str, place: str, amplitude: float, unit: str, signal: str = "", exponent: float = 1.0,
    windows: tuple[Window, ...] = (), settings: Mapping[str, float | str] = {},
) -> Cause:  # fmt: skip
    return Cause(
        family=family, place=place, parameter="", amplitude=amplitude, ci95=(amplitude, amplitude), unit=unit,
        statistic=math.inf, threshold=0.0, history=signal or ("windows" if windows else "always"), signal=signal,
        exponent=exponent, windows=windows, settings=settings,
    )  # fmt: skip


def _in_machine(
    name: str, seed: int, cause: Cause, *further: Cause, verdicts: tuple[Verdict, ...] = ("named",)
) -> Trial:  # fmt: skip
    expected = Expected(
        verdicts, cause.family, cause.place, cause.amplitude, cause.unit, cause.history,
        tuple((c.family, c.place) for c in further),
    )  # fmt: skip
    return Trial(name, expected, seed, (cause, *further))


def _in_log(
    name: str, damage: Damage, unit: str, verdict: Verdict, runs: tuple[str, ...] = ("",),
    families: tuple[str, ...] = (), places: tuple[str, ...] = (),
) -> Trial:  # fmt: skip
    history = damage.history
    expected = Expected((verdict,), damage.family, damage.place, damage.size, unit, history, (), families, places)
    return Trial(name, expected, damages=tuple((run, damage) for run in runs), truth="null_0")


def _hours(run: str, *stretches: tuple[float, float]) -> tuple[Window, ...]:
    return tuple(Window(run, a * HOUR, b * HOUR) for a, b in stretches)


def _bell(run: str, start: float, end: float, level: float) -> tuple[Window, ...]:
    """A sine squared between two hours, in steps of 10 min."""
    edges = np.arange(start, end + 1e-9, 1.0 / 6.0)
    height = level * np.sin(math.pi * (edges + 1.0 / 12.0 - start) / (end - start)) ** 2
    return tuple(
        Window(run, a * HOUR, b * HOUR, float(h)) for a, b, h in zip(edges[:-1], edges[1:], height[:-1], strict=True)
    )


def _telegraph(seed: int) -> tuple[tuple[Window, ...], tuple[Window, ...]]:
    """Stretches of one and of the other sign: it turns at random, every 50 min in the mean."""
    rng = np.random.default_rng(seed)
    signs: tuple[list[Window], list[Window]] = ([], [])
    for run in RUNS:
        at, which = 0.0, int(rng.integers(2))
        while at < END:
            until = min(at + rng.exponential(50.0 * 60.0), END)
            signs[which].append(Window(run, at, until))
            at, which = until, 1 - which
    return tuple(signs[0]), tuple(signs[1])


DOOR = _hours(RUN_1, (3.0, 6.0), (8.0, 9.5)) + _hours(RUN_2, (2.0, 5.0), (8.5, 10.0)) + _hours(SEALED, (4.0, 7.0))
CUTTING = _hours(RUN_1, (4.3, 6.4), (9.4, 10.6)) + _hours(RUN_2, (0.5, 1.8), (9.0, 10.9)) + _hours(SEALED, (4.0, 5.4))
BROKEN = _hours(RUN_2, (6.0, 13.0)) + _hours(SEALED, (0.0, 13.0))
SUN = _bell(RUN_1, 3.0, 8.0, 1.0) + _bell(RUN_2, 0.0, 4.0, 0.6) + _bell(SEALED, 1.0, 6.0, 0.85)
_HEATING, _COOLING = _telegraph(7)
_LOGGED = tuple(load_machine(MODEL / "machine.toml").signals)  # a clock is late for all of them
_HEAT = _cause("heat_source", "bed.left", 14.0, "W")
_ZONE = _cause("zone", "environment.enclosure", 2.5, "K", windows=DOOR)

# The most important first: `benchmarks.hidden_store` makes them in this order.
_MACHINE = (
    _in_machine("heat_source", 101, _HEAT),
    # b_bearing and the rails carry so little heat that nothing shows: the flange has that of the spindle
    _in_machine("joint", 102, _cause("joint", "contacts.spindle_flange", 0.08, "1", windows=BROKEN)),
    _in_machine("coolant", 103, _cause(
        "coolant", "table.top", 60.0, "W/(m^2*K)", windows=CUTTING, settings={"temperature": 14.0}
    )),
    _in_machine("zone", 104, _ZONE),
    _in_machine("forced_convection", 105, _cause(
        "forced_convection", "column.front", 30.0, "W/(m^2*K)", signal="x_speed", exponent=0.8
    )),
    _in_machine("sun", 106, _cause("sun", "column.left", 80.0, "W", windows=SUN)),
    _in_machine("film_gain", 107, _cause("film_gain", "films.headstock", 3.0, "1")),
    _in_machine("loss_law", 108, _cause("loss_law", "sources.x_motor", 2.2, "1"),
                verdicts=("named", "out_of_tolerance")),
    # a bearing of X or Z gives some 2 W in the mean, too little to be missed: a motor's heat is elsewhere
    _in_machine("misplaced_source", 109, _cause(
        "misplaced_source", "sources.z_motor", math.nan, "", settings={"surface": "bed.stem_left"}
    )),
    _in_machine("expansion", 115, _cause("expansion", "parts.column", 1.6, "1")),
    _in_machine("capacity", 111, _cause(
        "capacity", "column.top", 60e3, "J/K", settings={"conductance": 200.0}
    )),
    # friction of a power 8/3 in place of 5/3, with as much heat on the whole: nearly the same history
    _in_machine("pair", 112, _cause(
        "loss_law", "sources.spindle_bearing", 600.0, "W", signal="spindle_speed", exponent=8.0 / 3.0,
        settings={"gain": 0.0},
    ), verdicts=("named", "ambiguous")),
    _in_machine("two", 113, _cause("heat_source", "column.back", 25.0, "W"), _ZONE),
    # a thin film to 62 degC or to -18 degC gives 25 W of either sign, for bed.back (0.75 m^2) stays near 22 degC
    Trial("outside", Expected(("unknown",), "", "bed.back", 25.0, "W", "telegraph"), 114, tuple(
        _cause("coolant", "bed.back", 25.0 / (0.75 * 40.0), "W/(m^2*K)", windows=w, settings={"temperature": T})
        for w, T in ((_HEATING, 62.0), (_COOLING, -18.0))
    )),
    Trial("null_law", Expected(("nothing",), "", "", math.nan, "", ""), 115),
    Trial(
        "initial_state", Expected(("named",), "initial_state", "", math.nan, "K", "always"), 116,
        before={RUN_1: 3.0, RUN_2: 2.0, SEALED: 2.5},
    ),
    _in_machine("below_limit", 117, _cause("heat_source", "bed.left", 0.7, "W"), verdicts=("nothing",)),
    _in_machine("scale_expansion", 115, _cause(
        "scale_expansion", "axes.y", 10e-6, "1/K", settings={"fixed_at": 0.0}
    )),  # of one machine: expansion, scale_expansion and null_law share their temperatures
)  # fmt: skip

_LOG = (
    Trial("null_0", Expected(("nothing",), "", "", math.nan, "", "")),
    # peak values under the name of rms
    _in_log("signal_peak", Damage("signal", "signals.x_current", math.sqrt(2.0), "factor"), "1", "signal"),
    Trial(
        "clock", Expected(("signal",), "signal", f"runs.{RUN_2}", 360.0, "s", "clock"), truth="null_0",
        damages=tuple((RUN_2, Damage("signal", f"signals.{name}", 360.0, "clock")) for name in _LOGGED),
    ),
    _in_log("sensor_offset", Damage("sensor", "sensors.column_back", 1.0, "offset"), "K", "sensor"),
    _in_log("sensor_drift", Damage("sensor", "sensors.carriage", 0.6, "drift"), "K", "sensor"),  # in 12 h
    _in_log("sensor_swapped", Damage(
        "sensor", "sensors.x_bearing", math.nan, "swapped", other="sensors.x_motor"
    ), "", "sensor", places=("sensors.x_motor",)),
    _in_log("sensor_stuck", Damage(
        "sensor", "sensors.quill_top", 4.0 * HOUR, "stuck", start=5.0 * HOUR
    ), "s", "sensor", RUNS[:1]),
    _in_log("slip", Damage("slip", "tcp.dy", 6e-6, "play"), "m", "named"),
    Trial(
        "not_thermal", Expected(("named",), "not_thermal", "tcp.dx", 10e-6, "m", "step"), truth="null_0",
        damages=tuple(
            (run, Damage("not_thermal", "tcp.dx", 10e-6, "step", start=start))
            for run, start in ((RUN_2, 5.2 * HOUR), (SEALED, 0.0))
        ),
    ),
    _in_log("measurement", Damage("measurement", "tcp.dz", 8e-6, "drift"), "m", "named"),
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

TRIALS: dict[str, Trial] = {t.name: t for t in (*_MACHINE, *_LOG)}
SIMULATED = tuple(t.name for t in _MACHINE)

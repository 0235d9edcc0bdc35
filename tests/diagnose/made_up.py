"""Diagnoses of every verdict from random arrays that fit each other: what a report must be able to show."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from twin.diagnose.result.diagnosis import Cause, Diagnosis, Gain, Limit, Pull, Rival, Series, Unknown, Verdict, Window
from twin.diagnose.result.place import Network, Scene, Shell, Support
from twin.diagnose.result.plan import Apart, Foresight, Plan, Proposal, Separation
from twin.logs.trace import Trace

FAMILIES = ("heat_source", "film_gain", "forced_convection", "joint", "zone", "sensor", "signal", "coolant", "sun")


def heat(**changes: object) -> Cause:
    rivals = (
        Rival("loss_law", "sources.x_motor", "x_current^2", 71.0, "W", 402.0, 0.97, "a sensor on bed.x_motor"),
        Rival("film_gain", "films.bed", "always", 0.62, "1", 120.0, -0.41),
    )
    cause = Cause(
        "heat_source", "bed.x_motor", "sources.found_1", 84.97, (80.2, 89.7), "W", 431.2, 21.4, "x_current^2",
        "x_current", 2.0, (), {}, rivals,
    )  # fmt: skip
    return replace(cause, **changes)


SENSOR = Cause("sensor", "sensors.x_nut", "", 0.81, (0.7, 0.92), "K/day", 312.0, 18.0, "drift")
SIGNAL = Cause("signal", "signals.x_current", "signals.x_current.factor", 0.5, (0.48, 0.52), "1", 220.0, 19.0, "factor")
SCALE = Cause("scale_expansion", "scales.x", "scales.found_1", 1.13e-5, (1.05e-5, 1.21e-5), "1/K", 90.0, 20.0)
STRAINED = Cause("loss_law", "sources.x_motor", "", 1.62, (1.55, 1.7), "1", 158.0, 6.25)  # freed of its tolerance
STEP = Cause(
    "not_thermal", "tcp.y", "", 12.4e-6, (11.9e-6, 12.9e-6), "m", 150.0, 22.0, "step",
    windows=(Window("run_1", 14400.0, 28800.0), Window("run_2", 0.0, 3600.0, 0.5)),
)  # fmt: skip


def series(run: str, rng: np.random.Generator, sensors: int = 6, bins: int = 60, sealed: bool = False) -> Series:
    time = 300.0 * np.arange(1, bins + 1)
    current = np.where((time % 14400) < 7200, 6.0, 0.0)
    speed = np.where((time % 20000) < 4000, -0.3, 0.0)
    warm = np.convolve(current**2 / 36, np.exp(-np.arange(bins) / 20) / 20)[:bins]
    shape = np.exp(-np.arange(sensors) / 3)
    delivered = 3.0 * warm[:, None] * shape + 0.05 * rng.standard_normal((bins, sensors))
    noise = 0.05 * rng.standard_normal((bins, sensors))
    tcp = 1e-6 * rng.standard_normal((bins // 6, 3))
    return Series(
        run=run,
        time=time,
        sensors=tuple(f"sensor_{k}" for k in range(sensors)),
        delivered=delivered,
        recalibrated=0.4 * delivered + noise,
        extended=noise,
        tcp_time=time[5::6],
        tcp_delivered=tcp + 1e-5 * warm[5::6, None],
        tcp_recalibrated=tcp + 4e-6 * warm[5::6, None],
        tcp_extended=tcp,
        loads={"x_current": current, "x_speed": speed, "ambient": 20.0 + np.sin(time / 9000), "idle": 0 * time},
        sealed=sealed,
    )


def made_gains(run: str = "sealed_run", sensors: int = 6) -> tuple[Gain, ...]:
    temperatures = tuple(
        Gain(run, f"sensor_{k}", "K", 1.2 / (k + 1), 0.6 / (k + 1), 0.05, (0.5 / (k + 1) - 0.15, 0.7 / (k + 1)), k < 4)
        for k in range(sensors)
    )
    tcp = tuple(Gain(run, f"d{a}", "m", 9e-6, 4e-6, 1.1e-6, (2e-6, 4e-6), a != "z") for a in "xyz")
    return temperatures + tcp


_HOURS = 300.0 * np.arange(1.0, 21.0)
TRACES = (
    Trace("run_1", "sensor_0", "degC", _HOURS, np.where(_HOURS < 3000.0, 21.1, 850.0),
          np.where(_HOURS < 3000.0, 21.1, np.nan), np.full(20, 21.0), "'sensor_0' rests at 850 degC in run_1"),
    Trace("run_1", "dx", "m", _HOURS, 1e-9 * _HOURS, 1e-9 * _HOURS, 2e-9 * _HOURS),
)  # fmt: skip
SUPPORT = Support((("sensor_0", 0.7), ("sensor_3", 0.2), ("dx", 0.1)), 1.85)
BOX = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
FACES = np.array([[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6],
                  [0, 6, 4], [1, 5, 7], [1, 7, 3]])  # fmt: skip
SIDES = tuple(f"bed.{side}" for side in ("x_min", "x_max", "y_min", "y_max", "z_min", "z_max"))  # two triangles each
SHELL = Scene(
    Shell(BOX, FACES, np.zeros(12, dtype=int), np.repeat(np.arange(6), 2), SIDES), 2, ("bed.y_min",),
    {"sensor_0": (0.5, 0.0, 0.5), "sensor_3": (1.0, 0.5, 0.5), "sensor_4": (0.5, 0.5, 1.0)}, "bed.y_min",
)  # fmt: skip
NETWORK = Scene(
    Network(("head", "column", "bed", "screw"), ("screw",), (("head", "column", False), ("column", "bed", False),
            ("screw", "head", True))),
    2, (), {"sensor_0": "head", "x_nut": "screw"}, "sensors.x_nut",
)  # fmt: skip


def diagnosis(verdict: Verdict, seed: int = 0) -> Diagnosis:
    rng = np.random.default_rng(seed)
    causes: dict[str, tuple[Cause, ...]] = {
        "named": (heat(), SCALE),
        "ambiguous": (heat(),),
        "out_of_tolerance": (STRAINED,),
        "unknown": (),
        "sensor": (SENSOR,),
        "signal": (SIGNAL,),
        "nothing": (),
        "too_poor": (),
    }
    t = 1800.0 * np.arange(20)
    power = 40.0 * np.sin(t / 9000) ** 2
    ranked = tuple(
        Rival(
            FAMILIES[k % len(FAMILIES)],
            f"bed.face_{k}",
            "x_speed",
            90 / (k + 1),
            "W",
            430 / (k + 1) ** 2,
            0.98**k,
            ci95=(90 / (k + 1) - 8.507, 90 / (k + 1) + 8.507),
        )
        for k in range(10)
    )
    cosine = np.corrcoef(rng.standard_normal((10, 30)))
    quiet = verdict == "nothing"
    strained = (
        Pull("films.bed.gain", 1.0, 3.0, 0.4, 4.6, "1"),
        Pull("sources.x_motor.gain", 1.0, 1.62, 0.2, 2.2, "1", freed=True),
    )
    return Diagnosis(
        machine="five_axis",
        verdict=verdict,
        causes=causes[verdict],
        pulls=tuple(
            Pull(f"films.part_{k}.gain", 1.0, 1.0 + 0.1 * v, 0.4, v, "1") for k, v in enumerate(rng.standard_normal(18))
        )
        + (strained if verdict == "out_of_tolerance" else ()),
        detection_limits=(
            Limit("heat_source", "bed.left", 11.6, 4.2, 61.0, "W"),
            Limit("film_gain", "films.bed", 0.21, 0.1, 0.8, "1"),
            Limit("forced_convection", "films.bed", 3.4, 1.1, 12.0, "W/(m^2 K)"),
            Limit("sensor", "sensors.bed", 0.31, 0.1, 0.9, "K/day"),
            Limit("not_thermal", "tcp.x", 2.3e-6, 2e-6, 4e-6, "m"),
        ),
        unknown=Unknown(
            "column", "column.top", 96.0, 24.0,
            {"run_1": (tuple(t), tuple(power), tuple(np.full(20, 6.0)))}, (("hydraulics", 0.83), ("x_speed", -0.1)),
        ) if verdict == "unknown" else None,
        gain=() if quiet else made_gains(),
        ranked=ranked,
        cosine=cosine,
        nulls={family: 8.0 + 2.5 * rng.gumbel(size=60) for family in (*FAMILIES, "unknown")},
        thresholds=dict.fromkeys((*FAMILIES, "unknown"), 21.4) | {"loss_law": 36.0}
        | {c.family: c.threshold for c in causes[verdict] if c is not STRAINED},
        observed={family: 5.0 + k for k, family in enumerate(FAMILIES)}
        | ({} if quiet else {"heat_source": 431.2, "film_gain": 120.0}),
        whiteness=tuple((f"sensor_{k}", 0.95 - 0.02 * k, 0.2 * rng.standard_normal()) for k in range(6)),
        series=(series("run_1", rng), series("sealed_run", rng, sealed=True)),
        notes=("sensor_5 has 4 bins with too few samples: left out",),
        seed=seed,
        catalogue="1",
        provenance={"artefact": "0123abc", "runs": ["run_1", "sealed_run"], "seconds": 412.0},
        support=SUPPORT if causes[verdict] else None,
        scene=NETWORK if verdict == "sensor" else SHELL if causes[verdict] else None,
        traces=TRACES,
        channels=({"run": "run_1", "channel": "sensor_0", "unit": "K", "rms": 0.1, "kept": 0.5, "leaps": 1,
                   "wrong": "'sensor_0' rests at 850 degC in run_1"},),
    )  # fmt: skip


def planned() -> Plan:
    """Of two suspicions and a pair."""
    proposals = (
        Proposal("sensor at bed.left", "the longest run again, with a temperature sensor at bed.left", 5.0, 8.0),
        Proposal("again", "the longest run again", 20.0, 2.0),
    )
    apart = Apart("heat_source bed.left", "film_gain bed.left", 4.0, 10.0, (Separation("again", "the same", 8.0),))
    return Plan(
        (
            Foresight("heat_source", "bed.left", "W", 40.0, 20.0, 500.0, 36.0, False, proposals),
            Foresight("loss_law", "sources.motor", "1", 9.0, 8.0, 5.0, 36.0, False, proposals[1:]),
        ),
        (apart,),
        ("the same noise",),
    )

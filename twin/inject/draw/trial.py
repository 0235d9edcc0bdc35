"""Trials with something hidden in them, drawn by family, size and seed, of the reduced other machine.

    trial = draw(experiment, "heat_source", 1.0, 7)     # some seconds
    trial.runs                                          # what a user would hand to `twin diagnose`

Every trial, a null one too, has its own parameters (uniform, half widths OFF), noise, and air near the machine that
drifts by AIR without being logged. Everything is drawn from numpy generators of the seed and the family's name.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from twin.inject.draw import exchange, heat, readings
from twin.inject.draw.parts import Part, together
from twin.inject.experiment import NOISE, START, STEP, STEPS, TCP_NOISE, Experiment
from twin.inject.hidden import Trial
from twin.inject.truth.behaviour import Behaviour, Clean, clean_runs
from twin.inject.truth.other_films import FILMS
from twin.inject.truth.other_machine import OFF
from twin.inject.truth.reduced import Reduced, reduced
from twin.logs.run import Run, Table, Tcp
from twin.machine.parameters import parameters
from twin.rom.drive import Drive

AIR, AIR_TIME = 0.15, 1500.0  # K, s: the air that the machine feels beside the air that is logged
Make = Callable[[Experiment, np.random.Generator, float], Part]


def two(experiment: Experiment, rng: np.random.Generator, factor: float) -> Part:
    """A heat source, and something of another family in the machine."""
    other = MACHINE[rng.integers(len(MACHINE))]
    return together([heat.heat_source(experiment, rng, factor), FAMILIES[other](experiment, rng, factor)])


def effect_and_sensor(experiment: Experiment, rng: np.random.Generator, factor: float) -> Part:
    """Something in the machine, and a sensor that is off or drifts."""
    names = ("heat_source", *MACHINE)
    own = FAMILIES[names[rng.integers(len(names))]](experiment, rng, factor)
    return together([own, readings.fault(experiment, rng, ("offset", "drift")[rng.integers(2)], factor)])


MACHINE = ("film_gain", "loss_law", "zone", "coolant", "expansion", "joint")  # what goes with a heat source
FAMILIES: dict[str, Make] = {
    "film_gain": exchange.film_gain,
    "forced_convection": exchange.forced_convection,
    "heat_source": heat.heat_source,
    "loss_law": heat.loss_law,
    "joint": exchange.joint,
    "zone": exchange.zone,
    "sun": heat.sun,
    "coolant": exchange.coolant,
    "sensor": readings.sensor,
    "signal": readings.signal,
    "scale_expansion": readings.scale_expansion,
    "expansion": exchange.expansion,
    "slip": readings.slip,
    "capacity": exchange.capacity,
    "initial_state": exchange.initial_state,
    "measurement": readings.measurement,
    "misplaced_source": heat.misplaced_source,
    "not_thermal": readings.not_thermal,
    # not in the catalogue
    "null": lambda _experiment, _rng, _factor: Part(()),
    "null_law": exchange.null_law,
    "outside": heat.outside,
    "pair": heat.pair,
    "two": two,
    "effect_and_sensor": effect_and_sensor,
}
NULLS = ("null", "null_law")


def generator(family: str, seed: int, what: str) -> np.random.Generator:
    return np.random.default_rng([seed, zlib.crc32(family.encode()), zlib.crc32(what.encode())])


def part_of(experiment: Experiment, family: str, factor: float, seed: int) -> Part:
    """What is hidden in a trial. Raises KeyError for unknown families, ValueError for a factor that is not positive."""
    if not factor > 0.0:
        raise ValueError(f"a size of {factor:g} times the nominal one")
    return FAMILIES[family](experiment, generator(family, seed, "hidden"), factor)


def values_of(experiment: Experiment, family: str, seed: int) -> dict[str, float]:
    """Parameters of the other machine [SI] by path: as described, times the gains of its film laws, times a draw."""
    rng = generator(family, seed, "parameters")
    result = {}
    for p in parameters(experiment.machine):
        if p.kind in OFF:
            gain = FILMS[p.path.split(".")[1]].gain if p.kind == "film" else 1.0
            result[p.path] = p.nominal * gain * (1.0 + rng.uniform(-OFF[p.kind], OFF[p.kind]))
    return result


def draw(experiment: Experiment, family: str, factor: float, seed: int, hidden: bool = True) -> Trial:
    """The trial of a family at a factor of its nominal size; not hidden: the same machine, air and noise without it."""
    known = reduced(experiment)
    part = part_of(experiment, family, factor, seed) if hidden else Part(())
    values = values_of(experiment, family, seed)
    for path, more in part.factors.items():
        values[path] *= more
    air = together([_air(generator(family, seed, "air")), part])
    clean = clean_runs(experiment, values, air.behaviour)
    noise = generator(family, seed, "noise")
    made = []
    for r, (logged, did) in enumerate(zip(experiment.runs, clean, strict=True)):
        run = part.readings(r, _measured(known, logged, did), did)
        made.append(part.logs(r, _noisy(run, noise)))
    return Trial(family, seed, part.hidden, tuple(made), factor, values)


def _air(rng: np.random.Generator) -> Part:
    """The air that every environment really has: an Ornstein-Uhlenbeck process beside the logged one."""
    keep = np.exp(-STEP / AIR_TIME)
    white = rng.standard_normal((3, STEPS, 2))
    drift = np.empty_like(white)
    drift[:, 0] = white[:, 0]
    for k in range(1, STEPS):
        drift[:, k] = keep * drift[:, k - 1] + np.sqrt(1.0 - keep**2) * white[:, k]

    def loads(r: int, drive: Drive) -> Drive:
        return replace(drive, environment=drive.environment + AIR * drift[r])

    return Part((), Behaviour(loads=loads))


def _measured(known: Reduced, logged: Run, did: Clean) -> Run:
    """What the machine did as a run without noise, with the loads as they were."""
    columns = dict(zip(known.model.sensors, did.temperatures.T, strict=True))
    for name, environment in known.model.ambient_sensors:
        signal = known.model.load_model.environments[environment].signal
        columns[name] = np.interp(did.time, logged.loads.time, logged.loads.columns[signal])
    return replace(
        logged,
        temperatures=Table(did.time, columns, dict.fromkeys(columns, "degC")),
        tcp=Tcp(did.tcp_time, known.model.pose_axes, did.positions, did.tcp, np.full(len(did.tcp), TCP_NOISE)),
        synthetic=("loads", "temperatures", "tcp"),
        initial_temperature=START,
    )


def _noisy(run: Run, rng: np.random.Generator) -> Run:
    assert run.temperatures is not None
    assert run.tcp is not None
    columns = {k: v + NOISE * rng.standard_normal(len(v)) for k, v in run.temperatures.columns.items()}
    shown = run.tcp.displacement + TCP_NOISE * rng.standard_normal(run.tcp.displacement.shape)
    return replace(
        run,
        temperatures=Table(run.temperatures.time, columns, run.temperatures.units),
        tcp=replace(run.tcp, displacement=shown),
    )

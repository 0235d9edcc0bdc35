"""Hidden exchange: films, joints, air, coolant, capacities, initial states, expansions that the twin has wrong.

Functions take the experiment, a generator and the factor of the nominal size.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from twin.inject.draw.histories import on, one_of, signal, windows_of
from twin.inject.draw.parts import Part, cooling, more_film
from twin.inject.experiment import HOUR, RUNS, STEP, STEPS, Experiment
from twin.inject.five_axis import BODIES, JOINTS, LARGE, OUTER, PARTS, SPEEDS, WETTED
from twin.inject.hidden import Hidden
from twin.inject.truth.behaviour import Behaviour
from twin.inject.truth.reduced import Reduced, place_column, reduced
from twin.machine.effects.effect import Window
from twin.rom.apply import with_values
from twin.rom.drive import Drive
from twin.rom.model import MachineModel
from twin.rom.parameter import Parameter


def film_gain(experiment: Experiment, rng: np.random.Generator, factor: float) -> Part:
    """A group of films times 3, or 15 W/(m^2 K) more on a large face."""
    if rng.random() < 0.5:
        name = one_of(rng, ("bed", "bed_inside", "column", "headstock", "headstock_ends", "carriage", "axis_motors"))
        gain = 3.0**factor
        return Part((Hidden("film_gain", f"films.{name}", "always", gain, "1"),), factors={f"films.{name}.gain": gain})
    place, more = one_of(rng, LARGE), 15.0 * factor
    hidden = Hidden("film_gain", place, "always", more, "W/(m^2*K)")
    return cooling(hidden, [np.full(STEPS, more)] * 3, OUTER[place])


def forced_convection(experiment: Experiment, rng: np.random.Generator, factor: float) -> Part:
    """12 W/(m^2 K) at 0.4 m/s on one face of a moving part, or on all of them."""
    at, exponent = 12.0 * factor, 0.7
    if rng.random() < 0.5:
        place = one_of(rng, [p for p in LARGE if p.partition(".")[0] in SPEEDS])
        name = SPEEDS[place.partition(".")[0]]
        film = [at * (signal(experiment, r, name) / 0.4) ** exponent for r in range(3)]
        hidden = Hidden(
            "forced_convection", place, f"{name}^{exponent}", at / 0.4**exponent, "W/(m^2*K)", (), name, exponent
        )
        return cooling(hidden, film, OUTER[place])
    group, name = [("column", "x_speed"), ("headstock", "y_speed"), ("carriage", "z_speed")][rng.integers(3)]

    def loads(r: int, drive: Drive) -> Drive:
        return more_film(
            drive, list(experiment.machine.films).index(group), at * (signal(experiment, r, name) / 0.4) ** exponent
        )

    hidden = Hidden(
        "forced_convection", f"films.{group}", f"{name}^{exponent}", at / 0.4**exponent, "W/(m^2*K)", (), name, exponent
    )
    return Part((hidden,), Behaviour(loads=loads))


def joint(experiment: Experiment, rng: np.random.Generator, factor: float) -> Part:
    """A joint conducts 0.15 of what it should: always, or since some hour of the second run and ever after."""
    name, left = one_of(rng, JOINTS), 0.15**factor
    onset = STEP * round(rng.uniform(2.0, 8.0) * HOUR / STEP)
    windows = (Window(RUNS[1], onset, STEP * STEPS), Window(RUNS[2], 0.0, STEP * STEPS)) if rng.random() < 0.5 else ()
    since = "always" if not windows else f"from {onset / HOUR:.1f} h of {RUNS[1]} on"
    gates = on(windows) if windows else [np.ones(STEPS)] * 3
    fixed = [k for k, c in experiment.machine.contacts.items() if c.kind == "fixed"]

    def loads(r: int, drive: Drive) -> Drive:
        factors = 1.0 + (left - 1.0) * gates[r]
        if name in fixed:
            theta = drive.theta.copy()
            theta[:, len(experiment.machine.films) + fixed.index(name)] *= factors
            return replace(drive, theta=theta)
        pairs = [
            c for c, contact in experiment.machine.contacts.items() if contact.kind == "moving" for _ in contact.pairs
        ]
        conductance = drive.conductance.copy()
        conductance[:, [k for k, c in enumerate(pairs) if c == name]] *= factors[:, None]
        return replace(drive, conductance=conductance)

    return Part((Hidden("joint", f"contacts.{name}", since, left, "1", windows),), Behaviour(loads=loads))


def zone(experiment: Experiment, rng: np.random.Generator, factor: float) -> Part:
    """2 K/m upwards in the air, or 2.5 K in windows of 3 h that the air's sensor does not see."""
    e = int(rng.integers(2))
    name = list(experiment.machine.environment)[e]
    if rng.random() < 0.5:
        slope = 2.0 * factor

        def shape(model: MachineModel) -> MachineModel:
            return _with_gradient(reduced(experiment), model, e, slope)

        return Part((Hidden("zone", f"environment.{name}", "gradient", slope, "K/m"),), Behaviour(shape=shape))
    windows, warmer = windows_of(rng, 3.0), 2.5 * factor
    gates = on(windows)

    def loads(r: int, drive: Drive) -> Drive:
        environment = drive.environment.copy()
        environment[:, e] += warmer * gates[r]
        return replace(drive, environment=environment)

    return Part((Hidden("zone", f"environment.{name}", "in windows", warmer, "K", windows),), Behaviour(loads=loads))


HEIGHT = 1.0  # m, at which the air's temperature is measured


def _with_gradient(known: Reduced, model: MachineModel, environment: int, slope: float) -> MachineModel:
    bodies = []
    for body, height in zip(model.bodies, known.heights, strict=True):
        H = np.zeros((body.n, len(body.theta)))
        for column, k in enumerate(body.theta):
            if k < height.shape[1]:
                H[:, column] = height[:, k]
        bodies.append(replace(body, H=H))
    load = model.load_model
    air = tuple(
        replace(e, gradient=slope, height=HEIGHT) if i == environment else e for i, e in enumerate(load.environments)
    )
    return replace(model, bodies=tuple(bodies), load_model=replace(load, environments=air))


def coolant(experiment: Experiment, rng: np.random.Generator, factor: float) -> Part:
    """60 W/(m^2 K) to a liquid of 14 degC, in windows of 2 h."""
    place, film = one_of(rng, WETTED), 60.0 * factor
    windows = windows_of(rng, 2.0)
    hidden = Hidden("coolant", place, "in windows", film, "W/(m^2*K)", windows, settings={"temperature": 14.0})
    return cooling(hidden, [film * g for g in on(windows)], 14.0)


def capacity(experiment: Experiment, rng: np.random.Generator, factor: float) -> Part:
    """60 kJ/K at a face, as warm as it."""
    place, more = one_of(rng, LARGE), 6e4 * factor

    def shape(model: MachineModel) -> MachineModel:
        where, mean = place_column(model, place)
        body = model.bodies[where]
        E = body.E + more * np.outer(mean, mean)
        bodies = list(model.bodies)
        bodies[where] = replace(body, E=E, energy=E @ body.one)
        return replace(model, bodies=tuple(bodies))

    return Part((Hidden("capacity", place, "always", more, "J/K"),), Behaviour(heats=(place,), shape=shape))


def initial_state(experiment: Experiment, rng: np.random.Generator, factor: float) -> Part:
    """A body is 1.5 K warmer at the start of a run than stated."""
    body, r, warmer = one_of(rng, BODIES), int(rng.integers(2)), 1.5 * factor
    hidden = Hidden("initial_state", f"runs.{RUNS[r]}", "offset", warmer, "K", settings={"body": body})
    return Part((hidden,), Behaviour(warm={(r, body): warmer}))


def expansion(experiment: Experiment, rng: np.random.Generator, factor: float) -> Part:
    """A part grows 1.6 times as much as its material says."""
    name, growth = one_of(rng, PARTS), 1.0 + 0.6 * factor

    def shape(model: MachineModel) -> MachineModel:
        own = Parameter("parts.x.expansion", "expansion", (name,), 1.0, "1", 0.1, 10.0, 1.0)
        return with_values(model, [own], {own.path: growth})

    return Part((Hidden("expansion", f"parts.{name}", "always", growth, "1"),), Behaviour(shape=shape))


def null_law(experiment: Experiment, rng: np.random.Generator, _: float) -> Part:
    """Nothing is hidden, and every film depends otherwise on speed once more."""
    more = rng.uniform(-0.15, 0.15, len(experiment.machine.films))

    def shape(model: MachineModel) -> MachineModel:
        load = model.load_model
        films = list(load.films)
        for k, by in enumerate(more):
            use = films[k].use
            if "exponent" in use.parameters:
                values = {**use.parameters, "exponent": use.parameters["exponent"] + float(by)}
                films[k] = replace(films[k], use=replace(use, parameters=values))
        return replace(model, load_model=replace(load, films=tuple(films)))

    return Part((), Behaviour(shape=shape, laws=True))

"""Hidden heat: sources that the twin does not have, has elsewhere, or with another law.

Functions take the experiment, a generator and the factor of the nominal size. Where the catalogue has a formula, the
truth has another: an exponent, a bell's shape, a history of its own.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from twin.inject.draw.histories import followed, on, one_of, signal, telegraph, windows_of
from twin.inject.draw.parts import Part, heating
from twin.inject.experiment import HOUR, RUNS, STEP, STEPS, Experiment
from twin.inject.five_axis import BEARINGS, DRIVES, ELSEWHERE, OUTER, SIDES
from twin.inject.hidden import Hidden
from twin.inject.truth.behaviour import Behaviour
from twin.inject.truth.reduced import place_column
from twin.machine.effects.effect import Window
from twin.rom.drive import Drive
from twin.rom.model import MachineModel


def heat_source(experiment: Experiment, rng: np.random.Generator, factor: float) -> Part:
    """12 W while it works, at an outer face: always, with a drive, or in a window of 3 h."""
    place, watts = one_of(rng, OUTER), 12.0 * factor
    kind = one_of(rng, ("always", "signal", "window"))
    if kind == "window":
        windows = windows_of(rng, 3.0)
        hidden = Hidden("heat_source", place, "in windows", watts, "W", windows)
        return heating(hidden, [watts * g for g in on(windows)])
    if kind == "signal":
        name = one_of(rng, ("spindle_speed", "x_speed", "y_speed", "z_speed"))
        truth, told = (1.8, 5.0 / 3.0) if name == "spindle_speed" else (1.1, 1.0)
        histories, top, mean = followed(experiment, name, truth)
        hidden = Hidden(
            "heat_source", place, f"{name}^{told:.2f}", watts / mean, "W", (), name, told, {"reference": top}
        )
        return heating(hidden, [watts / mean * h for h in histories])
    return heating(Hidden("heat_source", place, "always", watts, "W"), [np.full(STEPS, watts)] * 3)


def sun(experiment: Experiment, rng: np.random.Generator, factor: float) -> Part:
    """150 W/m^2, 60 W at most, at the top of a bell of 4 to 6 h on one side; another height every day."""
    place = one_of(rng, SIDES)
    watts = min(150.0 * SIDES[place], 60.0) * factor
    length, middle = rng.uniform(4.0, 6.0) * HOUR, rng.uniform(3.5, 8.5) * HOUR
    t = STEP * (np.arange(STEPS) + 0.5)
    day = 1.0 + rng.uniform(-0.3, 0.3, 3)
    bell = np.cos(np.pi * np.clip((t - middle) / length, -0.5, 0.5)).clip(0.0) ** 1.5
    windows = tuple(
        Window(run, middle - length / 2, middle + length / 2, float(d)) for run, d in zip(RUNS, day, strict=True)
    )
    return heating(Hidden("sun", place, "a bell a day", watts, "W", windows), [watts * d * bell for d in day])


def loss_law(experiment: Experiment, rng: np.random.Generator, factor: float) -> Part:
    """A source times 2.2, or a bearing by n^2.3 with twice its power at top speed."""
    if rng.random() < 0.7:
        name, gain = one_of(rng, DRIVES), 1.0 + 1.2 * factor
        return Part(
            (Hidden("loss_law", f"sources.{name}", "always", gain, "1"),), factors={f"sources.{name}.gain": gain}
        )
    name, exponent = one_of(rng, BEARINGS), 2.3
    column = BEARINGS[name]
    top = max(float(signal(experiment, r, column).max()) for r in (0, 1))

    def loads(r: int, drive: Drive) -> Drive:
        k = drive.losses.index.index(list(experiment.machine.sources).index(name))
        value = drive.losses.value.copy()
        warm = int(np.searchsorted(drive.losses.grid, 35.0))
        share = signal(experiment, r, column) / top
        fastest = int(share.argmax())
        at_top = value[fastest, k, warm] / max(share[fastest], 1e-9)  # friction grows about linearly near the top
        value[:, k] = ((1.0 + factor) * at_top * share**exponent)[:, None]
        return replace(drive, losses=replace(drive.losses, value=value))

    hidden = Hidden(
        "loss_law",
        f"sources.{name}",
        f"{column}^{exponent}",
        1.0 + factor,
        "1",
        (),
        column,
        exponent,
        {"reference": top},
    )
    return Part((hidden,), Behaviour(loads=loads))


def misplaced_source(experiment: Experiment, rng: np.random.Generator, factor: float) -> Part:
    """The heat of a motor or bearing enters another face of its part: all of it, half of it at half size."""
    name, share = one_of(rng, ELSEWHERE), min(factor, 1.0)
    place = one_of(rng, ELSEWHERE[name])
    k = list(experiment.machine.sources).index(name)

    def shape(model: MachineModel) -> MachineModel:
        where, there = place_column(model, place)
        body = model.bodies[where]
        B = body.B.copy()
        own = body.sources.index(k)
        B[:, own] = (1.0 - share) * B[:, own] + share * there
        bodies = list(model.bodies)
        bodies[where] = replace(body, B=B)
        return replace(model, bodies=tuple(bodies))

    hidden = Hidden("misplaced_source", f"sources.{name}", "always", share, "1", settings={"surface": place})
    return Part((hidden,), Behaviour(heats=(place,), shape=shape))


def pair(experiment: Experiment, rng: np.random.Generator, factor: float) -> Part:
    """At the spindle's bearing, with n^(8/3) or n^(5/3): what hardly any data distinguish."""
    exponent = (8.0 / 3.0, 5.0 / 3.0)[rng.integers(2)]
    histories, top, mean = followed(experiment, "spindle_speed", exponent)
    watts = 25.0 * factor / mean
    told = {"reference": top, "rival": 13.0 / 3.0 - exponent}
    hidden = Hidden(
        "heat_source", "spindle.neck", f"spindle_speed^{exponent:.2f}", watts, "W", (), "spindle_speed", exponent, told
    )
    return heating(hidden, [watts * h for h in histories])


def outside(experiment: Experiment, rng: np.random.Generator, factor: float) -> Part:
    """No entry of the catalogue: 25 W that switch, in and out, by slow ramps to levels of a random telegraph."""
    place = one_of(rng, OUTER)
    watts = [25.0 * factor * telegraph(rng, STEP * np.arange(STEPS), np.full(STEPS, STEP)) for _ in RUNS]
    return heating(Hidden("outside", place, "a random telegraph with ramps, both signs", 25.0 * factor, "W"), watts)

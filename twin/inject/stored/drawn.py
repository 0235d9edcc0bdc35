"""Trials of which a seed draws all: place, kind, size, times, parameters of the machine, and noise; one per family.

What is hidden is that of the campaign (`twin.inject.draw`) at 1 to 2 times its nominal size. Here the full model is
stepped through it, of another machine for each seed, where the campaign has one reduced machine for all; faults of a
log are done to the stored truth of one machine.
Nobody chose a seed: they are numbered in the order of the families. A signal's clock and a stuck sensor need thresholds
of their own (`twin.inject.stored.table` has both), so the next seed after the last is taken there.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from itertools import count

import numpy as np

from twin.inject.damage.channels import Damage
from twin.inject.draw.trial import part_of
from twin.inject.experiment import HOUR, RUNS, Experiment
from twin.inject.hidden import Hidden
from twin.inject.stored.recipe import Recipe, effect
from twin.inject.stored.windows import bell
from twin.machine.effects.effect import Effect
from twin.machine.explain import explain, load_of

FIRST = 301  # seed
FAMILIES = (
    "heat_source", "film_gain", "forced_convection", "loss_law", "joint", "zone", "sun", "coolant", "capacity",
    "expansion", "scale_expansion", "misplaced_source", "initial_state", "signal", "sensor", "slip", "measurement",
    "not_thermal",
)  # fmt: skip
IN_LOG = ("sensor", "slip", "measurement", "not_thermal")
OTHERWISE = ("clock", "stuck")  # kinds that are not drawn here
LONGEST = 12.0 * HOUR  # of a run


def drawn(experiment: Experiment, family: str, seed: int) -> Recipe:
    """How a trial of a family is made whose place, kind, size and time the seed draws."""
    rng = np.random.default_rng([seed, zlib.crc32(family.encode())])
    hidden = part_of(experiment, family, 2.0 ** float(rng.uniform()), seed).hidden
    (one,) = hidden
    recipe = Recipe(f"drawn_{family}", hidden, seed)
    if family in IN_LOG:
        return replace(recipe, seed=0, damages=_damages(experiment, one), truth="null_0")
    if family == "signal":  # the log stays, the machine had other loads
        return replace(recipe, loads={one.signal: one.size})
    if family == "initial_state":
        body, run = str(one.settings["body"]), one.place.partition(".")[2]
        return replace(recipe, warm={(run, body): one.size})
    return replace(recipe, effects=(_effect(experiment, one),))


def _effect(experiment: Experiment, hidden: Hidden) -> Effect:
    """For the description: a bell in steps of 10 min, a law's power where the campaign says a multiple of it."""
    windows, amplitude, unit, settings = hidden.windows, hidden.size, hidden.unit, dict(hidden.settings)
    if hidden.family == "sun":
        windows = tuple(b for w in windows for b in bell(w.run, w.start / HOUR, w.end / HOUR, w.level))
    if hidden.family == "loss_law" and hidden.signal:
        at_top = {hidden.signal: f"{settings['reference']} 1/s", "surface": "35 degC"}
        (power,) = explain(experiment.machine, hidden.place, load_of(experiment.machine, at_top)).value
        amplitude, unit, settings = hidden.size * float(power), "W", {**settings, "gain": 0.0}
    return effect(hidden.family, hidden.place, amplitude, unit, hidden.signal, hidden.exponent, windows, settings)


def _damages(experiment: Experiment, hidden: Hidden) -> tuple[tuple[str, Damage], ...]:
    """Per run, "" for all: drifts and steps begin and end where the campaign has them."""
    kind, size, about = hidden.history, hidden.size, hidden.settings
    if hidden.family == "slip":
        return (("", Damage("slip", hidden.place, size, "play")),)
    if kind == "drift":  # a damage grows to its size by the end
        return (("", Damage(hidden.family, hidden.place, size * LONGEST, kind)),)
    if kind == "step":
        return tuple((w.run, Damage(hidden.family, hidden.place, size, kind, start=w.start)) for w in hidden.windows)
    if kind == "load":  # a damage has its size where the column is largest
        tops = [float(np.abs(log.loads.columns[hidden.signal]).max()) for log in experiment.runs]
        return tuple(
            (run, Damage(hidden.family, hidden.place, size * top, kind, hidden.signal))
            for run, top in zip(RUNS, tops, strict=True)
        )
    place = f"{hidden.place}:{about['axis']}" if kind == "frame" else hidden.place
    follows = "air_column" if kind == "detached" else ""
    return (("", Damage(hidden.family, place, size, kind, follows, str(about.get("other", "")))),)


@lru_cache(maxsize=2)
def drawn_recipes(experiment: Experiment) -> Mapping[str, Recipe]:
    """By name, one per family."""
    result = {}
    more = count(FIRST + len(FAMILIES))
    for seed, family in enumerate(FAMILIES, FIRST):
        while part_of(experiment, family, 1.0, seed).hidden[0].history in OTHERWISE:
            seed = next(more)
        recipe = drawn(experiment, family, seed)
        result[recipe.name] = recipe
    return result

"""Trials of which a seed draws all: place, kind, size, times, parameters of the machine, and noise; one per family.

What is hidden is that of the campaign (`benchmarks.hidden_draw.part_of`) at 1 to 2 times its nominal size. Here the
full model is stepped through it, of another machine for each seed, where the campaign has one reduced machine for all;
faults of a log are done to the stored truth of one machine.
Nobody chose a seed: they are numbered in the order of the families. A signal's clock and a stuck sensor need yardsticks
of their own (`tests.hidden.trials` has both), so the next seed after the last is taken there.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from dataclasses import replace
from itertools import count

import numpy as np

from benchmarks.campaign_match import place_of
from benchmarks.hidden_draw import part_of
from benchmarks.hidden_fast import runs
from benchmarks.hidden_parts import Hidden, described
from tests.hidden.load import RUNS
from tests.hidden.trial import HOUR, Expected, Trial, bell, cause_of
from twin.diagnose.diagnosis import Cause, Verdict
from twin.inject.damage.channels import Damage
from twin.machine.explain import explain, load_of

FIRST = 301  # seed
FAMILIES = (
    "heat_source", "film_gain", "forced_convection", "loss_law", "joint", "zone", "sun", "coolant", "capacity",
    "expansion", "scale_expansion", "misplaced_source", "initial_state", "signal", "sensor", "slip", "measurement",
    "not_thermal",
)  # fmt: skip
IN_LOG = ("sensor", "slip", "measurement", "not_thermal")
OTHERWISE = ("clock", "stuck")  # kinds that are not drawn here
TOLERANCES = ("film_gain", "loss_law", "joint", "expansion")  # families whose factors are those of declared numbers
LONGEST = 12.0 * HOUR  # of a run


def drawn(family: str, seed: int) -> tuple[Trial, Hidden]:
    """A trial, and what is hidden in it in the words of the campaign."""
    rng = np.random.default_rng([seed, zlib.crc32(family.encode())])
    (hidden,) = part_of(family, 2.0 ** float(rng.uniform()), seed).hidden
    expected = Expected(_right(hidden), family, place_of(vars(hidden)), hidden.size, hidden.unit, hidden.history)
    trial = Trial(f"drawn_{family}", expected, seed)
    if family in IN_LOG:
        damages = _damages(hidden)
        expected = replace(expected, history=damages[0][1].history)  # slip has one kind alone, and the campaign no word
        return replace(trial, expected=expected, seed=0, damages=damages, truth="null_0"), hidden
    if family == "signal":  # the log stays, the machine had other loads
        return replace(trial, loads={hidden.signal: hidden.size}), hidden
    if family == "initial_state":
        body, run = str(hidden.settings["body"]), hidden.place.partition(".")[2]
        return replace(trial, warm={(run, body): hidden.size}), hidden
    return replace(trial, causes=(_cause(hidden),)), hidden


def _right(hidden: Hidden) -> tuple[Verdict, ...]:
    if hidden.family in ("sensor", "signal"):
        return ("sensor",) if hidden.family == "sensor" else ("signal",)
    return ("named", "out_of_tolerance") if hidden.family in TOLERANCES and hidden.unit == "1" else ("named",)


def _cause(hidden: Hidden) -> Cause:
    """For the description: a bell in steps of 10 min, a law's power where the campaign says a multiple of it."""
    windows, amplitude, unit, settings = hidden.windows, hidden.size, hidden.unit, dict(hidden.settings)
    if hidden.family == "sun":
        windows = tuple(b for w in windows for b in bell(w.run, w.start / HOUR, w.end / HOUR, w.level))
    if hidden.family == "loss_law" and hidden.signal:
        at_top = {hidden.signal: f"{settings['reference']} 1/s", "surface": "35 degC"}
        (power,) = explain(described(), hidden.place, load_of(described(), at_top)).value
        amplitude, unit, settings = hidden.size * float(power), "W", {**settings, "gain": 0.0}
    return cause_of(hidden.family, hidden.place, amplitude, unit, hidden.signal, hidden.exponent, windows, settings)


def _damages(hidden: Hidden) -> tuple[tuple[str, Damage], ...]:
    """Per run, "" for all: drifts and steps begin and end where the campaign has them."""
    kind, size, about = hidden.history, hidden.size, hidden.settings
    if hidden.family == "slip":
        return (("", Damage("slip", hidden.place, size, "play")),)
    if kind == "drift":  # a damage grows to its size by the end
        return (("", Damage(hidden.family, hidden.place, size * LONGEST, kind)),)
    if kind == "step":
        return tuple((w.run, Damage(hidden.family, hidden.place, size, kind, start=w.start)) for w in hidden.windows)
    if kind == "load":  # a damage has its size where the column is largest
        tops = {
            run: float(np.abs(log.loads.columns[hidden.signal]).max()) for run, log in zip(RUNS, runs(), strict=True)
        }
        return tuple(
            (run, Damage(hidden.family, hidden.place, size * top, kind, hidden.signal)) for run, top in tops.items()
        )
    place = f"{hidden.place}:{about['axis']}" if kind == "frame" else hidden.place
    follows = "air_column" if kind == "detached" else ""
    return (("", Damage(hidden.family, place, size, kind, follows, str(about.get("other", "")))),)


def _all() -> Mapping[str, tuple[Trial, Hidden]]:
    result = {}
    more = count(FIRST + len(FAMILIES))
    for seed, family in enumerate(FAMILIES, FIRST):
        while part_of(family, 1.0, seed).hidden[0].history in OTHERWISE:
            seed = next(more)
        trial, hidden = drawn(family, seed)
        result[trial.name] = (trial, hidden)
    return result


_BOTH = _all()
DRAWN: tuple[Trial, ...] = tuple(t for t, _ in _BOTH.values())
HIDDEN: Mapping[str, Hidden] = {name: hidden for name, (_, hidden) in _BOTH.items()}

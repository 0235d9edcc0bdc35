"""How a stored trial is made: another machine, what is hidden in it, and what is done to its log.

What is hidden in the machine is written into its text as `twin hide` does it (`hidden_text`); signals of its history
are felt and not logged. What is hidden in the log is done to a stored truth on reading, by `twin.inject.damage`: such
trials need no file of their own.
"""

from __future__ import annotations

import hashlib
import json
import math
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from twin.inject.damage.channels import Damage
from twin.inject.damage.kinds import damaged
from twin.inject.experiment import RUNS, Experiment
from twin.inject.hidden import Hidden, Trial
from twin.inject.judge.match import place_of
from twin.inject.stored.files import measured, read
from twin.machine.effects.edits import extended_description, loads_with
from twin.machine.effects.effect import Effect, Window


@dataclass(frozen=True)
class Recipe:
    """One row of the table. Where nothing is done to the machine, `truth` names the file of another trial."""

    name: str
    hidden: tuple[Hidden, ...]  # the one that counts first; family "": none of the catalogue, place "": of no name
    seed: int = 0  # of the other machine
    effects: tuple[Effect, ...] = ()  # in the machine
    damages: tuple[tuple[str, Damage], ...] = ()  # (run, or "" for all; what is done to its log)
    before: Mapping[str, float] = field(default_factory=dict)  # h of work before the start of a run
    warm: Mapping[tuple[str, str], float] = field(default_factory=dict)  # (run, body) -> K warmer at its start
    loads: Mapping[str, float] = field(default_factory=dict)  # signal -> what it really was, in parts of what is logged
    truth: str = ""  # file, of the trial's own name where empty

    @property
    def noise(self) -> int:
        """The seed of its measurement noise."""
        return zlib.crc32(self.name.encode())

    @property
    def file(self) -> str:
        return f"{self.truth or self.name}.npz"


def effect(
    family: str, place: str, amplitude: float, unit: str, signal: str = "", exponent: float = 1.0,
    windows: tuple[Window, ...] = (), settings: Mapping[str, float | str] = {},
) -> Effect:  # fmt: skip
    """An effect whose history is told by what it follows."""
    history = signal or ("windows" if windows else "always")
    return Effect(family, place, amplitude, unit, history, signal, exponent, windows, settings)


def trial_of(experiment: Experiment, recipe: Recipe, folder: Path) -> Trial:
    """The runs of a stored trial as they were logged and measured; folder: where truths lie."""
    runs = []
    for truth in read(experiment, folder / recipe.file)[0]:
        run = measured(experiment, truth, recipe.noise)
        for where, damage in recipe.damages:
            if where in ("", run.folder.name):
                run = damaged(run, damage)
        runs.append(run)
    return Trial(recipe.name, recipe.seed, recipe.hidden, tuple(runs))


def hidden_text(
    experiment: Experiment, text: str, recipe: Recipe
) -> tuple[str, dict[str, dict[str, np.ndarray]]]:  # fmt: skip
    """The text of a machine with the effects of a recipe in it, and per run the signals (n,) that it feels and the log
    lacks or has otherwise."""
    edit = extended_description(text, recipe.effects, "hidden")
    felt: dict[str, dict[str, np.ndarray]] = {}
    for name in RUNS if edit.signals or recipe.loads else ():
        columns = loads_with(experiment.run(name), edit.signals).loads.columns
        felt[name] = {signal: columns[signal] for signal in edit.signals}
        felt[name] |= {signal: factor * columns[signal] for signal, factor in recipe.loads.items()}
    return edit.text, felt


def about(recipe: Recipe) -> dict[str, object]:
    """What is said of a trial in its file, as JSON can say it."""
    told = None
    if recipe.effects or recipe.warm or recipe.loads:
        h, *further = recipe.hidden
        told = {
            "family": h.family, "place": place_of(vars(h)), "size": None if math.isnan(h.size) else h.size,
            "unit": h.unit, "history": h.history, "further": [[f.family, f.place] for f in further],
        }  # fmt: skip
    return {
        "seed": recipe.seed,
        "hidden": told,
        "before": dict(recipe.before),
        **({"warm": [[*key, by] for key, by in recipe.warm.items()]} if recipe.warm else {}),
        "made_of": _digest(recipe),
    }


def _digest(recipe: Recipe) -> str:
    """Of everything that decides what the machine does: a file of another table is out of date."""
    effects = [
        [e.family, e.place, repr(e.amplitude), e.unit, e.signal, e.exponent, sorted(e.settings.items()),
         [[w.run, w.start, w.end, w.level] for w in e.windows]]
        for e in recipe.effects
    ]  # fmt: skip
    more = [sorted([*key, by] for key, by in recipe.warm.items()), sorted(recipe.loads.items())]
    told = json.dumps([recipe.seed, effects, sorted(recipe.before.items()), *(m for m in more if m)])
    return hashlib.sha256(told.encode()).hexdigest()[:16]

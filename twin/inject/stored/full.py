"""Truths of stored trials by the full model: trials whose effects move the tool and heat nothing share temperatures."""

from __future__ import annotations

from collections.abc import Sequence

from twin.build.full_model import assemble
from twin.inject.experiment import RUNS, Experiment
from twin.inject.stored.files import Truth
from twin.inject.stored.recipe import Recipe, hidden_text
from twin.inject.stored.table import simulated, table
from twin.inject.truth.other_machine import other_machine, other_text
from twin.inject.truth.side_by_side import driven, truths_of

COLD = ("expansion", "scale_expansion")  # families that change no temperature


def made(experiment: Experiment, recipes: Sequence[Recipe]) -> list[tuple[Truth, ...]]:
    """What the machines of recipes really do in RUNS, without noise; several recipes have the same temperatures.

    Needs gmsh, for the other mesh; some minutes.
    """
    texts = [hidden_text(experiment, other_text(experiment, r.seed), r) for r in recipes]
    models = [assemble(other_machine(experiment, text)) for text, _ in texts]
    felt, first = texts[0][1], recipes[0]
    warm = {run: {body: by for (where, body), by in first.warm.items() if where == run} for run in RUNS}
    several = [
        driven(models[0], experiment.run(run), felt.get(run, {}), first.before.get(run, 0.0), warm[run]) for run in RUNS
    ]
    return truths_of(models, several)


def together(experiment: Experiment, name: str) -> list[Recipe]:
    """The recipe of a name and those that have its temperatures."""
    recipes = table(experiment)
    first = recipes[name]
    alike = [recipes[n] for n in simulated(experiment) if recipes[n].seed == first.seed and n != name]
    return [first, *(r for r in alike if all(e.family in COLD for e in (*first.effects, *r.effects)))]

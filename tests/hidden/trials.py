"""The stored trials of models/five_axis (`twin.inject.stored.table`), and what a diagnosis should say of each."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from twin.diagnose.result.diagnosis import Verdict
from twin.inject.experiment import Experiment
from twin.inject.hidden import Hidden, Trial
from twin.inject.stored.recipe import trial_of
from twin.inject.stored.table import simulated, table

TRUTH = Path(__file__).parent / "truth"
MODEL = Path(__file__).parents[2] / "models" / "five_axis"
EXPERIMENT = Experiment(MODEL)
TRIALS = table(EXPERIMENT)
SIMULATED = simulated(EXPERIMENT)
DRAWN = tuple(name for name in TRIALS if name.startswith("drawn_"))

TOLERANCES = ("film_gain", "loss_law", "joint", "expansion")  # families whose factors are those of declared numbers
VERDICTS: dict[str, tuple[Verdict, ...]] = {  # that are right of a trial, where its family alone does not say it
    "null_0": ("nothing",),
    "null_law": ("nothing",),
    "below_limit": ("nothing",),
    "coarse_model": ("nothing",),  # a note, no cause
    "outside": ("unknown",),
    "loss_law": ("named", "out_of_tolerance"),
    "pair": ("named", "ambiguous"),
    "effect_and_sensor": ("named", "sensor"),
}
PLACES = {"sensor_swapped": ("sensors.x_motor",)}  # that are right as well
STATES = {"coarse_model": 12}  # the artefact that a trial is diagnosed with keeps so few


@dataclass(frozen=True)
class Expected:
    """What a diagnosis should say; size and place of a fault of a log are those of `twin.inject.damage`."""

    verdicts: tuple[Verdict, ...]  # any of them is right
    causes: tuple[Hidden, ...]  # the first one counts; none where nothing is to be found
    places: tuple[str, ...]  # that are right for the first one


def expected(name: str) -> Expected:
    causes = TRIALS[name].hidden
    places = (causes[0].place if causes else "", *PLACES.get(name, ()))
    return Expected(VERDICTS.get(name) or _verdicts(name, causes[0]), causes, places)


def _verdicts(name: str, hidden: Hidden) -> tuple[Verdict, ...]:
    if hidden.family == "sensor":
        return ("sensor",)
    if hidden.family == "signal":
        return ("signal",)
    declared = name in DRAWN and hidden.family in TOLERANCES and hidden.unit == "1"
    return ("named", "out_of_tolerance") if declared else ("named",)


def trial(name: str) -> Trial:
    """The runs of a trial as they were logged and measured."""
    return trial_of(EXPERIMENT, TRIALS[name], TRUTH)


def stored() -> tuple[str, ...]:
    """The trials whose truth lies in the repository."""
    return tuple(name for name, found in TRIALS.items() if (TRUTH / found.file).exists())

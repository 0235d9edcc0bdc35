"""A film coefficient is wrong: of a described film as a whole, or of one surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.diagnose.evidence.batch import Batch, Hypothesis
from twin.diagnose.faults.context import Context, alone
from twin.diagnose.faults.elements import Elements
from twin.diagnose.faults.fault import Curve, Family, Fault, Unit, coarse, place_number
from twin.diagnose.model.bank import Nominal
from twin.diagnose.model.integration import INNER
from twin.diagnose.model.slots import Slots
from twin.diagnose.model.study import Study


@dataclass(frozen=True)
class Film(Fault):
    """More film on a surface, or less, to the air that it is in."""

    def fill(self, slots: Slots, s: int, unit: Unit, k: int, study: Study, elements: Elements) -> None:
        p, probed = place_number(study, unit.place), study.probed
        run = study.runs[k].run
        air = run.drive.environment[:, environment_at(study, p)] - probed.base.reference_temperature
        slots.A[s], slots.M[s], slots.gate[:, s] = probed.A[p], probed.M[p], coarse(unit, k)
        slots.rise[:, :, s] = air.reshape(-1, INNER)

    def lowest(self, study: Study, nominal: Sequence[Nominal], h: Hypothesis) -> np.ndarray:
        """Less than the described film cannot lack at a surface."""
        result, probed = super().lowest(study, nominal, h), study.probed
        if not h.batch.sign:
            film = next(p.film for p in probed.places if p.name == h.name)
            own = [f for f, described in enumerate(probed.base.load_model.films) if described.name == film]  # or none
            result[0] = -max(float(nominal[k].total[:, own].max(initial=0.0)) for k in study.fitted)
        return result


@dataclass(frozen=True)
class Group(Fault):
    """All of a described film."""

    def fill(self, slots: Slots, s: int, unit: Unit, k: int, study: Study, elements: Elements) -> None:
        films = [f.name for f in study.probed.base.load_model.films]
        slots.film[:, s, films.index(unit.place)] = coarse(unit, k)


def environment_at(study: Study, p: int) -> int:
    """Number of the environment that the film of place p is in."""
    load, film = study.probed.base.load_model, study.probed.places[p].film
    return next((f.environment for f in load.films if f.name == film), load.surroundings)


GROUP = Group(
    "film_gain", "group", "1", "films.", least=0.2, own=0.12, curve=Curve.RELATIVE, conducts=True, bent=True,
    faint=True, largest=9.0,  # still air 2 to 5, a strong draught 20 to 50 W/(m^2 K): a factor of ten
)  # fmt: skip
SURFACE = Film(
    "film_gain", "film", "W/(m^2*K)", least=1.0, own=0.12, bent=True,
    largest=100.0,  # W/(m^2 K): air at some 20 m/s
)  # fmt: skip
FAULTS = (GROUP, SURFACE)


def batches(context: Context) -> list[Batch]:
    """Films as a whole, and surfaces of their own."""
    outer = {p.name for p in context.outer}
    surfaces = [(p, [c]) for p, h, c in context.named("film") if h == "always" and p in outer]
    one = (alone(context, "always"),)
    groups = [(p, [c]) for p, h, c in context.named("group") if h == "always"]
    return [fault.batch(rows, one) for fault, rows in ((GROUP, groups), (SURFACE, surfaces)) if rows]


FAMILY = Family(
    1, "film_gain", "Film coefficient wrong",
    "A surface exchanges more or less heat with the air than its film law says: cover, dirt, draught, wrong law.",
    "eta (-A_f x + M_f (T_air - T_ref))",
    "residual goes with surface minus air, changes sign when the machine is colder than the air; time constants move",
    "1 W/(m^2 K) on a surface, 20 % of a film", "either", "every film and every surface with one, always",
    "machine", batches, what="heat transfer other than declared", times="times the declared", declared=True,
)  # fmt: skip

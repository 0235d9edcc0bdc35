"""A film coefficient is wrong: of a described film as a whole, or of one surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.diagnose.evidence.batch import Batch, Hypothesis
from twin.diagnose.faults.context import Context, alone, always, of_stretches, of_whole_runs
from twin.diagnose.faults.elements import environment_at
from twin.diagnose.faults.fault import Curve, Family, Fault, Slot
from twin.diagnose.model.bank import Nominal
from twin.diagnose.model.study import Study


@dataclass(frozen=True)
class Film(Fault):
    """More film on a surface, or less, to the air that it is in."""

    def fill(self, slot: Slot) -> None:
        p, probed = slot.place, slot.study.probed
        slot.film(probed.A[p], probed.M[p], environment_at(slot.study, p))

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

    def fill(self, slot: Slot) -> None:
        films = [f.name for f in slot.study.probed.base.load_model.films]
        slot.slots.film[:, slot.s, films.index(slot.unit.place)] = slot.shape


GROUP = Group(
    "film_gain", "group", "1", "films.", least=0.2, own=0.12, curve=Curve.RELATIVE, conducts=True, bent=True,
    faint=True, grows=False, largest=9.0,  # still air 2 to 5, a strong draught 20 to 50 W/(m^2 K): a factor of ten
)  # fmt: skip
SURFACE = Film(
    "film_gain", "film", "W/(m^2*K)", least=1.0, own=0.12, bent=True,
    largest=100.0,  # W/(m^2 K): air at some 20 m/s
)  # fmt: skip
FAULTS = (GROUP, SURFACE)


def batches(context: Context) -> list[Batch]:
    """Films as a whole, always and in whole runs, and surfaces of their own.

    Not from any hour on: that is free enough to imitate how a law is wrong (of the tests' network the largest statistic
    without a cause was 72 then, and is 21).
    """
    outer, since = {p.name for p in context.outer}, of_stretches([always(context), *of_whole_runs(context)])
    surfaces = [(p, c) for p, c in context.rows(SURFACE) if p in outer]
    return [*GROUP.batches(context.blocks(GROUP), since), *SURFACE.batches(surfaces, (alone(context, "always"),))]


FAMILY = Family(
    1, "film_gain", "Film coefficient wrong",
    "A surface exchanges more or less heat with the air than its film law says: cover, dirt, draught, wrong law.",
    "eta (-A_f x + M_f (T_air - T_ref))",
    "residual goes with surface minus air, changes sign when the machine is colder than the air; time constants move",
    "1 W/(m^2 K) on a surface, 20 % of a film", "either",
    "every film, always and in whole runs; every surface with one, always", "machine", batches,
    what="wrong film coefficient", times="times the declared", declared=True,
)  # fmt: skip

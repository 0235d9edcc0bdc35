"""Cooling by air that motion drives, and the description does not have."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from twin.diagnose.evidence.batch import Batch
from twin.diagnose.faults.context import Context, logs
from twin.diagnose.faults.fault import Family, Fault, Slot, as_found
from twin.diagnose.faults.film_gain import Film
from twin.diagnose.model.study import Study
from twin.diagnose.result.diagnosis import Cause
from twin.diagnose.result.spot import Of, Spot
from twin.machine.effects.effect import Effect


@dataclass(frozen=True)
class GroupFilm(Fault):
    """More of a described film, on all of its surfaces."""

    def fill(self, slot: Slot) -> None:
        system, films = slot.study.probed.system, slot.study.probed.base.load_model.films
        f = [film.name for film in films].index(slot.unit.place)
        slot.film(np.asarray(system.A[0])[f], np.asarray(system.M)[:, f], films[f].environment)


FAULTS = (
    GroupFilm(
        "forced_convection", "group_film", "W/(m^2*K)", "films.", 1, 1.0, own=0.12, bent=True,
        largest=200.0,  # W/(m^2 K): air at a rotor's 50 m/s
    ),
    Film("forced_convection", "film", "W/(m^2*K)", "", 1, 1.0, own=0.12, bent=True, largest=200.0),
)  # fmt: skip


def batches(context: Context) -> list[Batch]:
    """Films and surfaces, with every speed."""
    speeds = list(context.elements.histories.speeds)
    histories, result = logs(context, speeds, len(speeds)), []
    for fault in FAULTS:
        places = dict.fromkeys(p for p, h, _ in context.named(fault.kind) if h in speeds)
        rows = [(p, [context.index[fault.kind, p, speed] for speed in speeds]) for p in places]
        result += fault.batches(rows, histories)
    return result


def edit(cause: Cause, study: Study) -> Effect:
    """At 1 m/s, and of a film on all of its surfaces."""
    effect = as_found(cause, study)
    settings = dict(effect.settings)
    amplitude = cause.amplitude / float(settings.pop("reference", 1.0)) ** cause.exponent
    spot = Spot.read(cause.place)
    if spot.of is Of.FILM:
        places = [p for p in study.probed.places if p.film == spot.name]
        settings["surfaces"] = ",".join(".".join(s) for p in places for s in p.surfaces or ((p.name,),))
    return replace(effect, amplitude=amplitude, settings=settings)


FAMILY = Family(
    2, "forced_convection", "Forced convection missing",
    "A moving part, or one that a moving part blows on, is cooled only while it moves.",
    "a |v|^0.6 (-A_f x + M_f (T_air - T_ref))",
    "cools only while an axis or the spindle turns", "1 W/(m^2 K) at top speed", "positive",
    "every film and surface with every logged speed", "machine", batches,
    what="missing forced convection", edit=edit,
)  # fmt: skip

"""An encoder scale grows with a part, and the description does not know."""

from __future__ import annotations

from dataclasses import replace

from twin.diagnose.faults.context import Singly
from twin.diagnose.faults.fault import Family, Fault, as_found
from twin.diagnose.model.study import Study
from twin.diagnose.result.diagnosis import Cause
from twin.machine.effects.effect import Effect

FAULTS = (
    Fault(  # of an axis, as warm as a part: at axes.AXIS<PART
        "scale_expansion", "scale", "1/K", least=3e-7, own=0.12, read=True, lasts=True, partner="part",
        largest=5e-5,  # 1/K: twice that of aluminium
    ),
)  # fmt: skip


def edit(cause: Cause, study: Study) -> Effect:
    """As warm as a surface of its part."""
    effect = as_found(cause, study)
    settings = dict(effect.settings)
    part = str(settings.pop("part"))
    settings["surface"] = next((p.name for p in study.probed.places if part in p.members and p.surfaces), part)
    return replace(effect, settings=settings)


FAMILY = Family(
    11, "scale_expansion", "Scale expansion undescribed",
    "An encoder scale, or a screw as scale, expands with its part: the error grows with the position.",
    "-a (T_scale - T_ref) position", "TCP error linear in an axis position, with a part's temperature",
    "0.3 um/(m K)", "either", "every axis with every part", "machine", Singly(FAULTS),
    what="undescribed scale expansion", edit=edit,
)  # fmt: skip

"""A joint or contact conducts otherwise than described, always or since an event."""

from __future__ import annotations

from dataclasses import dataclass

from twin.diagnose.evidence.batch import Batch
from twin.diagnose.faults.context import Context, always, lasting, of_stretches
from twin.diagnose.faults.elements import Elements
from twin.diagnose.faults.fault import Curve, Family, Fault, Unit, coarse
from twin.diagnose.model.slots import Slots
from twin.diagnose.model.study import Study

RANGE = 9.0  # conductances of joints scatter by a decade with pressure and roughness


@dataclass(frozen=True)
class Joint(Fault):
    """A joint between faces that do not move."""

    def fill(self, slots: Slots, s: int, unit: Unit, k: int, study: Study, elements: Elements) -> None:
        joints = [j.name for j in study.probed.base.load_model.joints]
        slots.joint[:, s, joints.index(unit.place)] = coarse(unit, k)


@dataclass(frozen=True)
class Contact(Fault):
    """A contact that moves."""

    def fill(self, slots: Slots, s: int, unit: Unit, k: int, study: Study, elements: Elements) -> None:
        slots.contact[:, s, study.probed.base.load_model.contacts.index(unit.place)] = coarse(unit, k)


FAULTS = tuple(
    of(
        "joint", kind, "1", "contacts.", least=0.3, curve=Curve.RELATIVE, conducts=True, bent=True, grows=False,
        largest=RANGE,
    )
    for of, kind in ((Joint, "joint"), (Contact, "contact"))
)  # fmt: skip


def batches(context: Context) -> list[Batch]:
    """Every contact: always, and from every hour on."""
    histories = of_stretches([always(context), *lasting(context)])
    blocks, result = context.elements.block_of, []
    for fault in FAULTS:
        rows = [(p, list(c)) for (k, p), c in blocks.items() if k == fault.kind]
        if rows:
            result.append(fault.batch(rows, histories))
    return result


FAMILY = Family(
    5, "joint", "Joint conductance wrong or lost",
    "A joint or guide conducts otherwise than described, perhaps since an event: preload lost, oil film gone.",
    "-kappa g(t) d d^T x", "residuals of opposite sign on both sides", "30 % of a conductance", "either",
    "every contact; always, and from every hour on", "machine", batches,
    what="a joint that conducts otherwise than declared", times="times the declared", declared=True,
)  # fmt: skip

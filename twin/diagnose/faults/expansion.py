"""A part grows more or less per kelvin than its material says."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from twin.diagnose.evidence.batch import Batch
from twin.diagnose.faults.context import Context, alone, single
from twin.diagnose.faults.fault import Curve, Family, Fault, as_found
from twin.diagnose.model.study import Study
from twin.diagnose.result.diagnosis import Cause
from twin.machine.effects.effect import Effect

NODES = "tcp.expansion."  # prefix of lumped machines, whose nodes have no faces


@dataclass(frozen=True)
class Part(Fault):
    """A part, or a node."""

    def bare(self, name: str) -> str:
        return name.removeprefix(NODES).removeprefix(self.prefix)


PART = Part(
    "expansion", "expansion", "1", "parts.", least=0.05, curve=Curve.RELATIVE, read=True, lasts=True,
    largest=1.0,  # aluminium for cast iron
)  # fmt: skip
GAIN = Fault(
    "expansion", "gain", "1", least=0.05, own=0.1, curve=Curve.LOGARITHM, parameter=True, read=True,
    largest=float(np.log(2.0)),
)  # fmt: skip
FAULTS = (PART, GAIN)


def batches(context: Context) -> list[Batch]:
    """Every part, every material."""
    gains = [(p, c) for p, c in context.rows(GAIN) if p.endswith(".expansion")]
    faces = any(p.surfaces for p in context.study.probed.places)
    part = PART if faces else replace(PART, prefix=NODES)
    return [*single(context, part), *GAIN.batches(gains, (alone(context, "always"),))]


def edit(cause: Cause, study: Study) -> Effect:
    return replace(as_found(cause, study), place=cause.place.removesuffix(".expansion"))


FAMILY = Family(
    12, "expansion", "Expansion coefficient wrong",
    "A part grows more or less per kelvin than its material says: other alloy, other reference temperature.",
    "a C_part x", "displacements scale while temperatures fit", "5 %", "either",
    "every part, every material, every node", "machine", batches,
    what="wrong expansion coefficient", times="times the declared", declared=True, edit=edit,
)  # fmt: skip

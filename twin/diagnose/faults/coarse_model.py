"""The artefact does not follow its own full model: a note (`twin.diagnose.evidence.coarse`), never a cause."""

from __future__ import annotations

from twin.diagnose.faults.context import Singly
from twin.diagnose.faults.fault import Family, Fault

FAULTS: tuple[Fault, ...] = ()  # it is computed, and not searched

FAMILY = Family(
    16, "coarse_model", "Reduced model or time step too coarse",
    "The artefact does not follow its own full model on this input: a note, never a cause.",
    "none: more states, a shorter step", "the artefact differs from the full model; the full model fits",
    "the noise of one reading (rms)", "-", "the artefact's runtime against the larger model of the diagnosis",
    "reading", Singly(FAULTS), what="a model too coarse",
)  # fmt: skip

"""A described source emits otherwise than its law says, in size or in shape."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from twin.diagnose.evidence.batch import Batch
from twin.diagnose.faults.context import Context, alone, most_heat, single
from twin.diagnose.faults.fault import Curve, Family, Fault, as_found
from twin.diagnose.model.study import Study
from twin.diagnose.result.diagnosis import Cause
from twin.machine.effects.effect import Effect
from twin.rom.parameter import Parameter

GAIN = Fault(
    "loss_law", "gain", "1", least=0.15, own=0.1, curve=Curve.LOGARITHM, parameter=True, read=True,
    largest=float(np.log(5.0)),  # friction of a bearing with preload and lubricant
)  # fmt: skip
SHAPE = Fault("loss_law", "source", "W", "sources.", least=1.0, replaces=True)
FAULTS = (GAIN, SHAPE)


def batches(context: Context) -> list[Batch]:
    """Gains of sources, and other shapes at their places."""
    gains = [(path.removesuffix(".gain"), c) for path, c in context.rows(GAIN) if path.startswith("sources.")]
    shapes = single(context, SHAPE, most_heat(context))
    return [*GAIN.batches(gains, (alone(context, "always"),)), *shapes]


def is_source(parameter: Parameter) -> bool:
    """Whether a declared parameter is what a source emits."""
    return parameter.kind == "source"


def edit(cause: Cause, study: Study) -> Effect:
    """A shape of its own is beside what calibration leaves of the described source."""
    effect = as_found(cause, study)
    return replace(effect, settings={**effect.settings, "gain": 1.0}) if cause.signal else effect


FAMILY = Family(
    4, "loss_law", "Loss law or coefficient wrong",
    "Friction, winding resistance, preload or wear differ from the described law, in size or in shape.",
    "(a - 1) P_j(t), or b_j s_alt(t) beside any share of P_j(t)",
    "goes with the power of one drive; or bends with its speed",
    "15 % of a source", "either", "every source: its gain, and other exponents of its speed", "machine",
    batches, what="a loss other than declared", times="times the declared", declared=True, edit=edit,
)  # fmt: skip

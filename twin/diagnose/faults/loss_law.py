"""A described source emits otherwise than its law says, in size or in shape."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from twin.diagnose.evidence.batch import Batch, Hypothesis
from twin.diagnose.evidence.nulls import power_of
from twin.diagnose.faults.context import Context, alone, most_heat, of_stretches, single, to_the_end
from twin.diagnose.faults.fault import Curve, Family, Fault, Slot, as_found
from twin.diagnose.model.bank import Nominal
from twin.diagnose.model.study import Study
from twin.diagnose.result.diagnosis import Cause
from twin.errors import DescriptionError
from twin.machine.effects.effect import Effect
from twin.rom.parameter import Parameter


@dataclass(frozen=True)
class Warm(Fault):
    """A source that emits more, or less, the warmer its own surface is."""

    def fill(self, slot: Slot) -> None:
        probed = slot.study.probed
        (body,) = probed.base.bodies
        j = [source.name for source in probed.base.load_model.sources].index(slot.unit.place)
        b = body.B[:, body.sources.index(j)]  # mean temperature: what spreads heat over a surface, transposed
        slot.slots.A[slot.s] = -np.outer(b, b)
        slot.slots.gate[:, slot.s] = power_of(slot.study, slot.k, j) * slot.shape


@dataclass(frozen=True)
class Since(Fault):
    """A source that emits more, or less, from an event on, or until it has run in."""

    def lowest(self, study: Study, nominal: Sequence[Nominal], h: Hypothesis) -> np.ndarray:
        """Not less than nothing."""
        return np.full(h.batch.q, -1.0)


GAIN = Fault(
    "loss_law", "gain", "1", least=0.15, own=0.1, curve=Curve.LOGARITHM, parameter=True, read=True,
    largest=float(np.log(5.0)),  # friction of a bearing with preload and lubricant
)  # fmt: skip
SHAPE = Fault("loss_law", "source", "W", "sources.", least=1.0, replaces=True)
WARM = Warm(
    "loss_law", "warm", "1/K", "sources.", least=0.003, own=0.15, bent=True, called="with its own temperature",
    largest=0.05,  # 1/K: viscosity of a mineral oil at room temperature (ISO 3448 grades, index 100)
)  # fmt: skip
SINCE, WEAR = (
    Since(
        "loss_law", kind, "1", "sources.", least=0.3, own=0.1, curve=Curve.RELATIVE, grows=False, beside=True,
        largest=4.0,  # more than described: as much as a gain may be
    )
    for kind in ("loss", "wear")
)  # fmt: skip
FAULTS = (GAIN, SHAPE, WARM, SINCE, WEAR)


def batches(context: Context) -> list[Batch]:
    """Gains of sources, always and from every hour on; other shapes at their places; what follows their own warmth, and
    what runs in."""
    gains = [(path.removesuffix(".gain"), c) for path, c in context.rows(GAIN) if path.startswith("sources.")]
    since = SINCE.batches(context.blocks(SINCE), of_stretches(to_the_end(context)))
    shapes = single(context, SHAPE, most_heat(context))
    return [
        *GAIN.batches(gains, (alone(context, "always"),)),
        *shapes,
        *single(context, WARM),
        *since,
        *single(context, WEAR),
    ]


def is_source(parameter: Parameter) -> bool:
    """Whether a declared parameter is what a source emits."""
    return parameter.kind == "source"


def edit(cause: Cause, study: Study) -> Effect:
    """A shape of its own is beside what calibration leaves of the described source.

    Raises DescriptionError for what follows the source's own temperature or runs in.
    """
    if cause.history != "always" and not (cause.signal or cause.windows):
        raise DescriptionError(
            f"no law takes '{cause.history}' beside any other", cause.place,
            "bearing_friction_warm and motor_winding follow a temperature; calibrate again what has run in",
        )  # fmt: skip
    effect = as_found(cause, study)
    return replace(effect, settings={**effect.settings, "gain": 1.0}) if cause.signal else effect


FAMILY = Family(
    4, "loss_law", "Loss law or coefficient wrong",
    "Friction, winding resistance, preload or wear differ from the described law, in size or in shape; or since an "
    "event; or friction falls with the temperature of its lubricant, grows with a preload, or runs in.",
    "(a - 1) g(t) P_j(t); b_j s_alt(t) beside any share of P_j(t); a P_j(t) b_j b_j^T x; a P_j(t) exp(-h/tau)",
    "goes with the power of one drive; or bends with its speed; or goes with the warmth of its own surface",
    "15 % of a source, 30 % from an hour on, 0.3 %/K", "either",
    "every source: its gain, always, from every hour on, less with its hours; other exponents; its own temperature",
    "machine",
    batches, what="wrong loss law or coefficient", times="times the declared", declared=True, edit=edit,
)  # fmt: skip

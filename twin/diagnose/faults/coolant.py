"""A liquid of its own temperature wets a surface: a film, and the heat that it takes or brings."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from twin.diagnose.evidence.batch import Batch, History, Hypothesis
from twin.diagnose.faults.context import Context, logged, windows_of
from twin.diagnose.faults.fault import Described, Family, Fault, Slot, Unit, as_found
from twin.diagnose.faults.heat_source import HEAT
from twin.diagnose.model.bank import Nominal
from twin.diagnose.model.study import Study
from twin.diagnose.result.diagnosis import Cause
from twin.diagnose.result.numbers import size_words
from twin.machine.effects.effect import Effect

WET = 60.0  # W/(m^2 K), the film of a coolant, and how far it may be from that
DRY = 35.0  # W/(m^2 K), of its film: less than the discrepancy in 95 of 100 cases is no film of a warm liquid
FROZEN = 0.0  # degC, below which no medium flows over a machine
WARMER = 0.3  # standard deviation of what its heat changes by from the middle of a window to its end
MEDIUM = 0.15  # relative standard deviation of its film where its temperature is told, which follows from the heat


@dataclass(frozen=True)
class Wetted(Fault):
    """Its film alone: a liquid keeps its temperature while the air's drifts, and heat tells by how much."""

    def fill(self, slot: Slot) -> None:
        slot.slots.A[slot.s] = slot.study.probed.A[slot.place]  # to the reference temperature: no rise
        slot.slots.gate[:, slot.s] = slot.shape


@dataclass(frozen=True)
class Coolant(Fault):
    """A film and its heat; of a brief one the data determine the heat well and the film badly."""

    def units(self, h: Hypothesis, shapes: Callable[[int], tuple[np.ndarray, ...]]) -> tuple[Unit, ...]:
        columns, weights = h.combination()
        half = weights.shape[1] // 2
        return Unit(FILM, h.name, int(columns[0]), shapes(0)), Unit(HEAT, h.name, int(columns[half]), shapes(1))

    def prior(self, q: int) -> tuple[np.ndarray, np.ndarray]:
        mean, inverse = super().prior(q)
        mean[0], inverse[0] = WET, WET**-2
        return mean, inverse

    def lowest(self, study: Study, nominal: Sequence[Nominal], h: Hypothesis) -> np.ndarray:
        result = super().lowest(study, nominal, h)
        result[0] = h.batch.smallest
        return result

    def limited(self, study: Study, name: str, a: np.ndarray) -> np.ndarray:
        """A film no less than what takes its heat to a medium that is not FROZEN: plain cold at a large face beside it
        imitates a coolant, from far below that."""
        area = next(p.area for p in study.probed.places if p.name == name)
        above = study.probed.base.reference_temperature - FROZEN
        return np.array([max(a[0], -a[1] / (area * above)) if above > 0.0 else a[0], a[1]])

    def vanished(self, a: np.ndarray) -> bool:
        """Warm, and no film worth the name: that is heat."""
        return bool(a[0] <= DRY and a[1] > 0.0)

    def left_open(self, units: Sequence[Unit], a: np.ndarray) -> list[Unit]:
        """A coolant that becomes warmer: its film shows in how its heat declines, and so would this."""
        shapes = tuple(WARMER * float(a[1]) * _ramp(s) for s in units[1].shapes)
        return [replace(units[1], shapes=shapes)]

    def uncertain(self, value: float) -> float:
        return self.own * max(value, WET)

    def described(self, study: Study, d: Described, a: np.ndarray, covariance: np.ndarray) -> Described:
        """With the temperature [degC] of the medium, and its standard deviation [K].

        T_ref + Q / (h A) of the film h and the heat Q at the reference temperature.
        """
        if len(a) < 2 or not d.size[0] > 0:
            return d
        h, Q = map(float, a)
        area = next(p.area for p in study.probed.places if p.name == d.place)
        slope = np.array([-Q / (h**2 * area), 1.0 / (h * area)])
        variance = float(slope @ covariance @ slope) + (slope[0] * MEDIUM * d.size[0]) ** 2
        temperature = study.probed.base.reference_temperature + Q / (h * area)
        return replace(d, settings={"temperature": temperature, "temperature_sigma": float(np.sqrt(variance))})


def _ramp(shape: np.ndarray) -> np.ndarray:
    """(n,) from 1 to -1 over every stretch of a shape, times the shape."""
    result = np.zeros(len(shape))
    on = np.concatenate([[False], shape != 0.0, [False]])
    for start, end in zip(np.flatnonzero(on[1:] & ~on[:-1]), np.flatnonzero(~on[1:] & on[:-1]), strict=True):
        result[start:end] = np.linspace(1.0, -1.0, end - start) * shape[start:end]
    return result


FILM = Wetted("coolant", "wetted", "W/(m^2*K)")
COOLANT = Coolant(
    "coolant", "coolant", "W/(m^2*K)", "", 1, 5.0, bent=True, wets=True, leaves=0.01,
    own=0.3,  # at least of WET: in campaigns films between 30 and 120 W/(m^2 K) came out some 20 too small
    largest=5000.0,  # W/(m^2 K): water under pressure in a jet
)  # fmt: skip
FAULTS = (COOLANT,)


def batches(context: Context) -> list[Batch]:
    """A film to a medium of its own temperature, in every window, and while a logged signal is on."""
    blocks, heat = context.elements.block_of, context.elements.heat_blocks
    histories = [History(name, np.kron(np.eye(2), w), windows=windows) for name, w, windows in windows_of(context)]
    rows = [(p.name, [*blocks["film", p.name], *heat[p.name]]) for p in context.outer]
    return [*COOLANT.batches(rows, histories), *_switched(context)]


def _switched(context: Context) -> list[Batch]:
    """With every logged signal that is on or off."""
    index, names = context.index, context.elements.histories.switches
    rows = [(p.name, [index[kind, p.name, name] for kind in ("film", "heat") for name in names]) for p in context.outer]
    own = [logged(context, name, np.kron(np.eye(2), row)) for name, row in zip(names, np.eye(len(names)), strict=True)]
    return COOLANT.batches(rows, own)


def said(cause: Cause) -> list[str]:
    settings = cause.settings
    if "temperature" not in settings:
        return []
    medium, half = float(settings["temperature"]), 1.96 * float(settings.get("temperature_sigma", math.nan))
    return [f"to a medium of {size_words(medium, (medium - half, medium + half), 'degC')}"]


def edit(cause: Cause, study: Study) -> Effect:
    effect = as_found(cause, study)
    return replace(effect, settings={k: v for k, v in effect.settings.items() if k != "temperature_sigma"})


FAMILY = Family(
    8, "coolant", "Coolant or chips on a surface",
    "A liquid of its own temperature wets a surface while a valve is open.",
    "g(t) h (-A_p x + M_p (T_medium - T_ref))", "sharp onset and end; pulls the surface to one temperature",
    "5 W/(m^2 K)", "positive", "every surface with a film; every window of hours, every logged switch", "machine",
    batches,
    what="coolant or chips", said=said, edit=edit,
)  # fmt: skip

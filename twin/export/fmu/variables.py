"""The variables of an FMU: names that every tool accepts, in the order of their value references."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from twin.export.c.text import identifier
from twin.rom.artefact import Artefact
from twin.rom.load_model import Signal

Causality = Literal["input", "output", "parameter", "independent"]


@dataclass(frozen=True)
class Variable:
    """A scalar real variable."""

    name: str
    causality: Causality
    variability: Literal["continuous", "discrete", "fixed", "tunable"]
    unit: str
    description: str
    start: float | None = None
    listed: bool = True  # in the model description


def variables_of(artefact: Artefact, step: float, poses: bool, time: bool) -> tuple[Variable, ...]:
    """All variables by their value reference. poses, time: whether those are listed."""
    model, load = artefact.model, artefact.model.load_model
    positions = {a.position for a in load.axes}
    found = [
        Variable(identifier(s.column), "input", "continuous" if s.name in positions else "discrete", s.unit,
                 f"{s.name} as logged" + ("; holds" if s.name not in positions else ", at the step's start"),
                 start_of(s, model.reference_temperature)) for s in load.signals
    ]  # fmt: skip
    column = {s.name: s.column for s in load.signals}
    unit = {s.name: s.unit for s in load.signals}
    found += [
        Variable(f"{identifier(column[a.position])}_rate", "input", "discrete", f"{unit[a.position]}/s",
                 f"change of {column[a.position]} within the step, by its length", 0.0) for a in load.axes
    ]  # fmt: skip
    T_ref = float(model.reference_temperature)
    found.append(Variable("T_initial", "parameter", "fixed", "degC", "temperature of the machine at the start", T_ref))
    found.append(Variable("step", "parameter", "fixed", "s", "inner step, as certified", step))
    for kind, entries in (("source", load.sources), ("film", load.films)):
        found += [Variable(f"gain_{kind}_{identifier(e.name)}", "parameter", "tunable", "1",
                           f"factor of {'the loss' if kind == 'source' else 'the convection'} {e.name}", e.gain)
                  for e in entries]  # fmt: skip
    sensors = model.all_sensors
    found += [Variable(f"T_{identifier(s)}", "output", "discrete", "degC", f"sensor {s}") for s in sensors]
    for c in "xyz":
        found.append(Variable(f"tcp_{c}", "output", "discrete", "m", "TCP error, tool minus work side"))
    found.append(Variable("flags", "output", "discrete", "1", "how many flags the last inner step has"))
    found.append(Variable("time", "independent", "continuous", "s", "time", listed=time))
    digits = len(str(max(len(model.poses), 1)))
    for p, pose in enumerate(model.poses):
        at = ", ".join(f"{a} {1e3 * v:g} mm" for a, v in zip(model.pose_axes, pose, strict=True))
        found += [Variable(f"tcp_p{p + 1:0{digits}d}_{c}", "output", "discrete", "m", f"TCP error at {at}",
                           listed=poses) for c in "xyz"]  # fmt: skip
    return _distinct(found)


def start_of(signal: Signal, reference: float) -> float:
    """A value within the certified range: the default, else zero or the reference temperature, as near as it may be."""
    if signal.default is not None:
        return signal.default * (math.sqrt(2.0) if signal.kind == "peak" else 1.0) / signal.factor
    wanted = reference if signal.unit == "degC" else 0.0
    return float(np.clip(wanted, signal.low, signal.high))


def _distinct(variables: list[Variable]) -> tuple[Variable, ...]:
    """The same with names that differ: some tools do not tell capitals from small letters."""
    from dataclasses import replace

    taken: set[str] = set()
    result = []
    for v in variables:
        name, k = v.name, 1
        while name.lower() in taken:
            k += 1
            name = f"{v.name}_{k}"
        taken.add(name.lower())
        result.append(replace(v, name=name))
    return tuple(result)

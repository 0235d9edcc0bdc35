"""The two tables: the families of the catalogue, and the faults that these consist of."""

from __future__ import annotations

from twin.diagnose.evidence.batch import Batch, Hypothesis
from twin.diagnose.faults import (
    capacity,
    coarse_model,
    coolant,
    expansion,
    film_gain,
    forced_convection,
    heat_source,
    initial_state,
    joint,
    loss_law,
    measurement,
    misplaced_source,
    missing_joint,
    missing_member,
    not_thermal,
    scale_expansion,
    sensor,
    signal,
    slip,
    sun,
    zone,
)
from twin.diagnose.faults.fault import Family, Fault
from twin.rom.parameter import Parameter

_FILES = (
    film_gain, forced_convection, heat_source, loss_law, joint, zone, sun, coolant, sensor, signal, scale_expansion,
    expansion, slip, capacity, initial_state, coarse_model, measurement, misplaced_source, not_thermal, missing_member,
    missing_joint,
)  # fmt: skip
FAMILIES: tuple[Family, ...] = tuple(file.FAMILY for file in _FILES)
FAULTS: dict[tuple[str, str], Fault] = {(f.family, f.kind): f for file in _FILES for f in file.FAULTS}
OF_KIND: dict[str, Fault] = {f.kind: f for f in reversed(FAULTS.values())}  # the first of each


def fault_of(of: Hypothesis | Batch) -> Fault:
    """The fault that a hypothesis is; of a user's own family that of its kind. Raises KeyError for no kind."""
    batch = of.batch if isinstance(of, Hypothesis) else of
    return FAULTS.get((batch.family, batch.kind)) or OF_KIND[batch.kind]


def family_of(name: str) -> Family | None:
    """The entry of a name; None of a user's own."""
    return next((f for f in FAMILIES if f.name == name), None)


def what(name: str) -> str:
    """What a family is in words: one name for it in sentences, tables and notes."""
    entry = family_of(name)
    return (entry and entry.what) or name.replace("_", " ")


# Of kinds of declared parameters, see `twin.rom.parameter`
_OF_PARAMETER = {
    "source": loss_law, "film": film_gain, "contact": joint, "joint": joint, "capacity": capacity,
    "expansion": expansion, "environment": zone,
}  # fmt: skip


def family_of_parameter(parameter: Parameter) -> str:
    """The family that a declared parameter out of its tolerance is named by."""
    return _OF_PARAMETER[parameter.kind].FAMILY.name

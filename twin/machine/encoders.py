"""Does an axis' encoder make sense? What can be told without meshes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from twin.errors import Problem
from twin.machine.bodies import bodies_of, body_of, split_surface
from twin.machine.description import Axis, Machine
from twin.machine.kinematics import displacement, linear_axes, moved_bodies

_OF_A_SCALE = ("scale", "reader", "fixed_at", "expansion")


def encoder_problems(name: str, axis: Axis) -> Iterator[Problem]:
    """Keys that contradict each other or are missing. Whether the surfaces exist is asked elsewhere."""
    encoder, where = axis.encoder, f"axes.{name}.encoder"
    if axis.kind == "rotary":
        if "encoder" in axis.model_fields_set:
            remedy = "remove it: encoders are modelled on linear axes"
            yield Problem("an encoder on a rotary axis", where, remedy)
    elif encoder.kind == "rotary":
        for key in _OF_A_SCALE:
            if key in encoder.model_fields_set:
                remedy = "write kind = 'linear' for a scale, or remove the key: a rotary encoder reads the screw"
                yield Problem(f"'{key}' of a rotary encoder", f"{where}.{key}", remedy)
    else:
        examples = {
            "scale": "the surface the scale lies on: scale = 'bed.side'",
            "reader": "the surface across the guide that carries the reading head: reader = 'slide.side'",
            "expansion": "of the scale's material: expansion = '8e-6 1/K' (glass), '10.6e-6 1/K' (steel tape), or 0.0",
        }
        for key, remedy in examples.items():
            if key not in encoder.model_fields_set or getattr(encoder, key) is None:
                yield Problem(f"a linear encoder without '{key}'", where, f"give {remedy}")


def scale_problems(machine: Machine) -> Iterator[Problem]:
    """Scales and readers on the wrong sides, and guides that hinder the shift. For a description that is sound else."""
    axes = linear_axes(machine)
    for name in axes:
        encoder = machine.axes[name].encoder
        if encoder.kind != "linear" or encoder.scale is None or encoder.reader is None:
            continue
        where = f"axes.{name}.encoder"
        bodies = bodies_of(machine)
        scale, reader = (body_of(bodies, split_surface(s)[0]).name for s in (encoder.scale, encoder.reader))
        moved = moved_bodies(machine, name)
        if (scale in moved) == (reader in moved):
            yield Problem(
                f"'{encoder.scale}' and '{encoder.reader}' {'both move' if scale in moved else 'both stand still'}"
                f" when axis '{name}' moves",
                where,
                "the scale lies on one side of the guide, the reader on the other",
            )
            continue
        for other in axes:
            between = displacement(machine, reader, {other: 1.0}) - displacement(machine, scale, {other: 1.0})
            if other != name and np.any(between != 0.0):
                yield Problem(
                    f"axis '{other}' moves '{encoder.reader}' along '{encoder.scale}' too",
                    where,
                    f"put both next to the guide of axis '{name}', with no other axis between them",
                )
        yield from _held_by_guides(machine, name, where)


def _held_by_guides(machine: Machine, axis: str, where: str) -> Iterator[Problem]:
    """The scale's correction is exact where the drive alone holds the carried side along the axis."""
    holds = {
        name: contact.stiffness
        for name, contact in machine.contacts.items()
        if contact.kind == "moving" and contact.axis == axis and contact.stiffness.axial > 0
    }
    guides = [name for name, k in holds.items() if k.normal > 0 or k.lateral > 0]
    if guides and len(holds) > 1:
        yield Problem(
            f"guides hold axis '{axis}' along its direction as well as its drive: "
            + ", ".join(f"contacts.{g}.stiffness.axial" for g in guides),
            where,
            "set axial = 0 there: with a linear scale the drive alone must hold the carried side along the axis",
        )

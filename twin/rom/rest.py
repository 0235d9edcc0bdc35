"""A machine at rest before its run: in equilibrium with its surroundings as the first step has them, without any heat.

A machine that stood overnight is not at one temperature: every part is at that of the air, water or hall around it. The
state is found by the model's own integrator, which damps what is fast to nothing (L-stable): a few steps so long that
nothing is left of where they began. Solving A x = b once was rejected: films and losses that follow temperatures would
need an iteration of their own.
"""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np

from twin.rom.drive import Drive
from twin.rom.following import Following

STEPS = 4  # coefficients that follow the surface settle within three, as the tests show
LENGTH = 1e9  # s, 30 years: far above any time constant of a machine


def rest_before(drive: Drive) -> Drive:
    """Four long steps with the loads of the first step of `drive` and without heat; they end when it begins."""

    def first(value: Any) -> Any:
        if isinstance(value, Following):
            return replace(
                value, value=value.value[:1].repeat(STEPS, axis=0), outside=value.outside[:1].repeat(STEPS, axis=0)
            )
        return value[:1].repeat(STEPS, axis=0) if isinstance(value, np.ndarray) else value

    held = {f.name: first(getattr(drive, f.name)) for f in fields(drive)}
    cold: Following = held["losses"]
    heat = {
        "power": np.zeros_like(held["power"]),
        "contact_heat": np.zeros_like(held["contact_heat"]),
        "losses": replace(cold, value=np.zeros_like(cold.value)),
    }
    return Drive(**held | heat | {"time": drive.time[0] + LENGTH * np.arange(-STEPS, 1.0)})


def with_rest(drive: Drive) -> Drive:
    """The drive with `rest_before` in front: its first STEPS steps."""
    rest = rest_before(drive)

    def joined(before: Any, after: Any) -> Any:
        if isinstance(after, Following):
            return replace(
                after,
                value=np.concatenate([before.value, after.value]),
                outside=np.concatenate([before.outside, after.outside]),
            )
        return np.concatenate([before, after]) if isinstance(after, np.ndarray) else after

    both = {f.name: joined(getattr(rest, f.name), getattr(drive, f.name)) for f in fields(drive)}
    return Drive(**both | {"time": np.concatenate([rest.time[:-1], drive.time])})

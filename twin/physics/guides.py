"""Friction heat of linear guides [W]. Arguments are numbers or arrays in SI units."""

from __future__ import annotations

import jax.numpy as jnp


def guide_friction(speed, friction, load, seal_drag):
    """Q_f = (mu F_m + f_d) |v|. Source: paper 004 eq (6); mu = 0.001 .. 0.002 for ball guides.

    speed [m/s], friction [1], load F_m [N], seal_drag f_d [N].
    """
    return (friction * load + seal_drag) * jnp.abs(speed)


def guide_preload(speed, friction, dynamic_rating, preload_class, load, seal_drag, carriages):
    """Friction of preloaded roller guides: P = N [mu (2 F_pr + F_load/3) + f_d] |v|, F_pr = class C.

    speed [m/s], friction mu (4e-4 for roller guides), dynamic_rating C [N] of a carriage, preload_class F_pr/C
    (Schaeffler RUE-E: V1 0.04, V2 0.08, V3 0.10, V4 0.13, V5 0.15), load F_load [N] on a carriage, seal_drag f_d [N]
    of a carriage, carriages N.
    Source: paper 002 eqs (1)-(3) with erratum E-002-6: eq (3) is printed as F_pr = 0.13 F_load, a preload that would
    vanish without load; 0.13 is the class of the dynamic rating. Paper 004 eq (6) adds the seals.
    """
    force = 2.0 * preload_class * dynamic_rating + load / 3.0
    return carriages * (friction * force + seal_drag) * jnp.abs(speed)


def guide_preload_holds(speed, friction, dynamic_rating, preload_class, load, seal_drag, carriages):
    """F_load <= 3 F_pr: beyond it eq (2) is less than the load itself, the unloaded row has lifted off."""
    return load <= 3.0 * preload_class * dynamic_rating

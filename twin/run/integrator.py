"""The one integrator in JAX: equal steps of a tableau with loads held, and the derivative of the solve in them.

Who integrates says what E, S and the forcing are, and how S is solved; the runtime, the window model of a calibration,
the tangent of the state filter and the probed model of a diagnosis all go through these two functions.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import twin.run.jax_setup  # noqa: F401  isort: skip

import jax
import jax.numpy as jnp
from jax import lax

from twin.rom.tableau import Feedback, Tableau, stages

Solve = Callable[[jax.Array, jax.Array], tuple[jax.Array, jax.Array]]
Sums = tuple[jax.Array, jax.Array, jax.Array, jax.Array]


def integrate(
    tableau: Tableau,
    steps: int,
    solve: Solve,
    capacity: Callable[[jax.Array], jax.Array],
    z: jax.Array,
    forcing: jax.Array,
    feedback: Feedback | None = None,
) -> Sums:
    """The state (N,) after equal steps from z, as `twin.rom.tableau.stages` makes each of them; and three sums over the
    steps of the stages' weighted values: their own states (N,), those that their solves have seen, and the powers (k,)
    of the feedback (none: k = 0).
    """
    weights, ahead = jnp.asarray(tableau.weights), jnp.asarray(tableau.ahead)

    def told(state: jax.Array) -> tuple[jax.Array, jax.Array]:
        return (jnp.zeros_like(z), jnp.zeros(0)) if feedback is None else feedback(state)

    def chain(_: int, sums: Sums) -> Sums:
        """The stages in a loop, which compiles once for all of them."""

        def stage(k: jax.Array, carry: tuple[jax.Array, ...]) -> tuple[jax.Array, ...]:
            earlier, before, after, own, seen, power = carry
            more, powers = told(before + ahead[k] * (before - earlier))
            at, saw = solve(capacity(before) + forcing + more, before)
            w = weights[k]
            after = after + w / tableau.diagonal * (at - before)
            return before, at, after, own + w * at, seen + w * saw, power + w * powers

        z, own, seen, power = sums
        made = lax.fori_loop(0, len(weights), stage, (z, z, z, own, seen, power))
        return made[2], made[3], made[4], made[5]

    def one(_: int, sums: Sums) -> Sums:
        z, own, seen, power = sums
        after, made = stages(tableau, solve, capacity, z, forcing, feedback)
        for weight, (at, saw, powers) in zip(tableau.weights, made, strict=True):
            own, seen = own + weight * at, seen + weight * saw
            power = power if feedback is None else power + weight * powers
        return after, own, seen, power

    step = chain if tableau.chain else one
    nothing = jax.eval_shape(told, z)[1]
    first = (z, jnp.zeros_like(z), jnp.zeros_like(z), jnp.zeros(nothing.shape, nothing.dtype))
    return step(0, first) if steps == 1 else lax.fori_loop(0, steps, step, first)


@partial(jax.custom_jvp, nondiff_argnums=(0, 1))
def solved(
    solve: Callable[[Any, jax.Array, jax.Array], jax.Array],
    change: Callable[[Any, Any, jax.Array], jax.Array],
    fixed: Any,
    moving: Any,
    right: jax.Array,
    near: jax.Array,
) -> jax.Array:
    """x = S^-1 right (N,), with the derivative that the implicit function theorem gives: x' = S^-1 (right' - S' x).

    The factor is never differentiated: through a Cholesky factorisation the same digits cost twenty times as much
    (measured at 100 states).

    solve: (fixed, right, near) -> x, from a state nearby where it iterates. moving: what S depends on and derivatives
    are wanted by; fixed: the factor, and all else, whose derivatives are not looked at. change: (fixed, moving', x) ->
    S' x. Both functions hold no arrays of their own.
    """
    return solve(fixed, right, near)


@solved.defjvp
def _derivative(solve: Any, change: Any, at: tuple, d: tuple) -> tuple[jax.Array, jax.Array]:
    fixed, _, right, near = at
    _, d_moving, d_right, d_near = d
    x = solve(fixed, right, near)
    return x, solve(fixed, d_right - change(fixed, d_moving, x), d_near)

"""The reduced machine with uncertain parameters: one step of its state together with directions around it.

Parameters u are what `twin.calibrate.fit.effects` calls them: ln(value / nominal) of factors, value - nominal of
shifts. A direction is a column (dz, du) of a square root of a covariance matrix; it goes through the step's derivative.
With S of `twin.run.matrix` and theta, forcing read at the step's start,

    S dz_new = rate dz + d forcing - sum_k d theta_k A_k z_new

is the implicit step differentiated (`twin.run.integrator.solved`): all columns share the step's factor. Losses, films,
joints and air temperatures may be uncertain; capacities, moving contacts and expansions are taken as they are.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import twin.run.jax_setup  # noqa: F401  isort: skip

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from twin.rom.drive import Drive
from twin.rom.load_model import LoadModel
from twin.rom.parameter import Parameter
from twin.run.block_factor import BlockFactor
from twin.run.integrator import integrate, solved
from twin.run.matrix import by_factor, terms_of
from twin.run.stepping import Inputs, State, feedback_of, forcing_of, inputs_of, kept_or_new, loads_of, without_factor
from twin.run.system import Array, Layout, System

KINDS = ("source", "film", "joint", "environment")  # of parameters that the tangent knows


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Acts:
    """What n parameters act on: exponents of factors, and shifts in K."""

    source: Array  # (n_sources, n)
    contact_source: Array  # (n_contact_sources, n)
    film: Array  # (n_films, n)
    joint: Array  # (n_joints, n)
    environment: Array  # (n_environments, n)


def acts_of(load: LoadModel, parameters: Sequence[Parameter]) -> Acts:
    """The arrays of parameters whose kind is one of KINDS. Raises KeyError for a target that the model lacks."""
    names = {
        "source": [s.name for s in load.sources],
        "film": [f.name for f in load.films],
        "joint": [j.name for j in load.joints],
        "environment": [e.name for e in load.environments],
    }
    acts = {kind: np.zeros((len(of_kind), len(parameters))) for kind, of_kind in names.items()}
    for k, p in enumerate(parameters):
        for target in p.targets:
            if target not in names[p.kind]:
                raise KeyError(f"{p.path}: the model has no {p.kind} '{target}'")
            acts[p.kind][names[p.kind].index(target), k] = 1.0
    contact_source = acts["source"][list(load.contact_sources)]
    return Acts(acts["source"], contact_source, acts["film"], acts["joint"], acts["environment"])


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class UncertainLoads:
    """Step inputs at nominal parameters, with the heat of every contact source on its own; stacked or of one step."""

    inputs: Inputs
    contact_heat: Array  # (n_contact_sources, n_ports) W


def separate_loads(load: LoadModel, drive: Drive, substeps: int) -> UncertainLoads:
    """The drive as stacked step inputs (n_steps, ...)."""
    return UncertainLoads(inputs_of(load, drive, substeps), drive.contact_heat)


def _applied(layout: Layout, acts: Acts, loads: UncertainLoads, u: Array) -> Inputs:
    """The inputs of a step at parameters u (n,)."""
    source, film, joint = jnp.exp(acts.source @ u), jnp.exp(acts.film @ u), jnp.exp(acts.joint @ u)
    inputs, n = loads.inputs, layout.n_films
    theta = jnp.asarray(inputs.theta)
    return replace(
        inputs,
        theta=jnp.concatenate([theta[:n] * film, theta[n:] * joint]),
        film_table=jnp.asarray(inputs.film_table) * film[np.array(layout.following_films, dtype=int), None],
        environment=inputs.environment + acts.environment @ u,
        power=inputs.power * source,
        power_table=jnp.asarray(inputs.power_table) * source[np.array(layout.following_losses, dtype=int), None],
        port_heat=jnp.exp(acts.contact_source @ u) @ loads.contact_heat,
    )


@partial(jax.jit, static_argnums=0)
def cold(layout: Layout, system: System, z: jax.Array, loads: UncertainLoads) -> State:
    """The state to begin with: its factor is empty, and the next step must make one."""
    return without_factor(layout, system, z, loads.inputs)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class _Fixed:
    """What derivatives of a solve take as it is."""

    factor: BlockFactor
    rest: tuple[jax.Array, ...]  # per body: what the factor lacks
    A: tuple[Array, ...]  # per body (n_terms, n, n)


def _twice(layout: Layout) -> Callable[[_Fixed, jax.Array, jax.Array], jax.Array]:
    """The runtime's solve: what the factor lacks acts on the state before, then on the state so found."""

    def solve(fixed: _Fixed, right: jax.Array, near: jax.Array) -> jax.Array:
        for _ in range(2):
            near = by_factor(layout, fixed.factor, fixed.rest, right, near)
        return near

    return solve


def _change(layout: Layout) -> Callable[[_Fixed, jax.Array, jax.Array], jax.Array]:
    """sum_k theta_k' A_k x."""

    def change(fixed: _Fixed, d_theta: jax.Array, x: jax.Array) -> jax.Array:
        parts = zip(layout.terms, fixed.A, jnp.split(x, layout.offsets[1:-1]), strict=True)
        return jnp.concatenate([d_theta[np.array(terms, dtype=int)] @ (A @ xb) for terms, A, xb in parts])

    return change


@partial(jax.jit, static_argnums=0)
def tangent_step(
    layout: Layout,
    system: System,
    acts: Acts,
    state: State,
    u: jax.Array,
    dz: jax.Array,
    du: jax.Array,
    loads: UncertainLoads,
) -> tuple[State, jax.Array]:
    """One step of the state at parameters u (n,), and of directions dz (N, r) with du (n, r): new state, new dz."""

    def after(z: jax.Array, u: jax.Array) -> tuple[jax.Array, tuple[BlockFactor, jax.Array]]:
        inputs = _applied(layout, acts, loads, u)
        seen = loads_of(layout, system, z, inputs)
        theta = lax.stop_gradient(seen.theta)
        factor, held = kept_or_new(layout, system, state, loads.inputs, theta)
        rest = tuple(terms_of(layout, system, b, theta - held) for b in range(len(layout.sizes)))
        fixed = _Fixed(factor, rest, tuple(jnp.asarray(A) for A in system.A))

        def solve(right: jax.Array, near: jax.Array) -> tuple[jax.Array, jax.Array]:
            x = solved(_twice(layout), _change(layout), fixed, seen.theta, right, near)
            return x, x

        forcing = forcing_of(layout, system, seen)
        feedback = feedback_of(layout, system, inputs, jnp.asarray(seen.power))
        capacity = lambda x: jnp.asarray(inputs.rate * x)  # noqa: E731
        z, *_ = integrate(inputs.tableau, inputs.substeps, solve, capacity, z, forcing, feedback)
        return z, (factor, held)

    z, derivative, (factor, held) = jax.linearize(after, state.z, u, has_aux=True)
    return State(z, factor, held), jax.vmap(derivative, in_axes=1, out_axes=1)(dz, du)

"""The reduced machine with uncertain parameters: one step of its state together with directions around it.

Parameters u are what `twin.calibrate.fit.effects` calls them: ln(value / nominal) of factors, value - nominal of
shifts. A direction is a column (dz, du) of a square root of a covariance matrix; it goes through the step's derivative.
With S of `twin.run.stepping` and theta, forcing read at the step's start,

    S dz_new = rate dz + d forcing - sum_k d theta_k A_k z_new

is the implicit step differentiated: the factor is never differentiated, all columns share it. Losses, films, joints and
air temperatures may be uncertain; capacities, moving contacts and expansions are taken as they are.
"""

from __future__ import annotations

from collections.abc import Sequence
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
from twin.run.block_factor import solve
from twin.run.stepping import Inputs, State, factor_of, inputs_of, loads_of
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
    shape = jax.eval_shape(partial(factor_of, layout), system, loads.inputs, jnp.asarray(loads.inputs.theta))
    factor = jax.tree.map(lambda a: jnp.zeros(a.shape, a.dtype), shape)
    return State(z, factor, jnp.zeros(jnp.asarray(loads.inputs.theta).shape))


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
    borders, n = layout.offsets[1:-1], layout.n_films

    def read(z: jax.Array, u: jax.Array) -> tuple[jax.Array, jax.Array]:
        """theta (n_theta,) and forcing (N,) at the step's start."""
        inputs = _applied(layout, acts, loads, u)
        seen = loads_of(layout, system, z, inputs)
        port_heat = [P @ inputs.port_heat[np.array(p, dtype=int)] for P, p in zip(system.P, layout.ports, strict=True)]
        heat = system.M @ (seen.theta[:n] * seen.rise) + system.H @ seen.lift + system.B @ seen.power
        return seen.theta, jnp.asarray(heat + jnp.concatenate(port_heat))

    (theta, forcing), derivative = jax.linearize(read, state.z, u)
    d_theta, d_forcing = jax.vmap(derivative, in_axes=1, out_axes=1)(dz, du)
    inputs = loads.inputs
    anew = inputs.changed | jnp.any(jnp.abs(theta - state.held) > inputs.follow * state.held)
    factor, held = lax.cond(
        anew, lambda: (factor_of(layout, system, inputs, theta), theta), lambda: (state.factor, state.held)
    )
    rest = [
        jnp.tensordot((theta - held)[np.array(terms, dtype=int)], A, 1)
        for terms, A in zip(layout.terms, system.A, strict=True)
    ]

    def less_rest(known: jax.Array, seen: jax.Array) -> jax.Array:
        parts = jnp.split(seen, borders)
        return jnp.concatenate(
            solve(
                factor,
                layout.elimination,
                jnp.split(known - jnp.concatenate([R @ s for R, s in zip(rest, parts, strict=True)]), borders),
                layout.symmetric,
            )
        )

    columns = jax.vmap(less_rest, in_axes=1, out_axes=1)

    def per_term(z: jax.Array) -> jax.Array:
        """A_k z (N, n_theta)."""
        rows = []
        for b, part in enumerate(jnp.split(z, borders)):
            own = jnp.zeros((len(theta), layout.sizes[b]))
            for i, k in enumerate(layout.terms[b]):
                own = own.at[k].add(system.A[b][i] @ part)
            rows.append(own.T)
        return jnp.concatenate(rows)

    def substep(_: int, both: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        z, dz = both
        known = inputs.rate * z + forcing
        new = less_rest(known, less_rest(known, z))
        d_known = inputs.rate * dz + d_forcing - per_term(new) @ d_theta
        return new, columns(d_known, columns(d_known, dz))

    z, dz = lax.fori_loop(0, inputs.substeps, substep, (state.z, dz))
    return State(z, factor, held), dz

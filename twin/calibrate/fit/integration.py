"""The window model integrated through a run as a function of the parameters, differentiable in JAX's forward mode.

The step is the runtime's (`twin.run.integrator`) with the runtime's own loads (`twin.run.stepping.loads_of`), and the
exact coefficients of every step in the matrix:

    S(u) z_new = rate E(u) z + f(u),     S(u) = rate E(u) + A0 + sum_k theta_k(u) A_k + sum_c g_c(u) P Gamma_c P^T
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import twin.run.jax_setup  # noqa: F401  isort: skip

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jax.scipy.linalg import cho_solve

from twin.calibrate.fit.effects import Effects, Factors, factors, factors_at
from twin.rom.contact_matrix import ContactEntries, ContactPlaces, entries_by_contact, projected
from twin.rom.drive import Drive
from twin.rom.model import MachineModel
from twin.run.integrator import integrate, solved
from twin.run.stepping import Inputs, feedback_of, inputs_of, loads_of
from twin.run.system import Array, Layout, System


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class WindowLoads:
    """A run as the window model sees it; leading axis n_steps. s contact sources."""

    inputs: Inputs  # of the runtime, without contacts and their heat
    contact_heat: Array  # (n, s, r) W, projected
    contacts: ContactEntries  # each contact on its own


def loads_for(model: MachineModel, drive: Drive, substeps: int) -> WindowLoads:
    """The loads of a run for a model of one body."""
    (body,) = model.bodies
    none = np.zeros((drive.n_steps, 0))
    bare = replace(
        inputs_of(model.load_model, drive, substeps, follow=0.0),
        port_heat=none,
        contacts=ContactEntries(none, none, none),
        changed=none,
    )
    return WindowLoads(bare, drive.contact_heat @ body.P.T, entries_by_contact(model.load_model, drive))


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Rows:
    """Linear read-outs of a trajectory: k measured quantities, each a row at a place in time between two steps."""

    step: Array  # (k,) int: index of the state before
    share: Array  # (k,) of the state after
    row: Array  # (k, 3, r) m/K
    member_row: Array  # (n_e, k, 3, r) m/K: what expansions scale


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class _Fixed:
    """What derivatives of a solve take as it is; q terms of A, n_c of E."""

    factor: jax.Array  # (r, r) of S: its Cholesky factor, or its inverse where derivatives are wanted
    A: jax.Array  # (q, r, r)
    E: jax.Array  # (n_c, r, r)
    rate: jax.Array  # () 1/s


def _by_cholesky(fixed: _Fixed, right: jax.Array, near: jax.Array) -> jax.Array:
    return jnp.asarray(cho_solve((fixed.factor, True), right))


def _by_inverse(fixed: _Fixed, right: jax.Array, near: jax.Array) -> jax.Array:
    return fixed.factor @ right


def _change(fixed: _Fixed, d: tuple[jax.Array, jax.Array], x: jax.Array) -> jax.Array:
    """S' x by coefficients (q,) and capacities (n_c,)."""
    coefficients, capacities = d
    return coefficients @ (fixed.A @ x) + fixed.rate * (capacities @ (fixed.E @ x))


def _step(
    layout: Layout,
    places: ContactPlaces,
    derivative: bool,
    system: System,
    effects: Effects,
    scaled: Factors,
    z: jax.Array,
    loads: WindowLoads,
) -> jax.Array:
    """The state (r,) after one step of the run."""
    inputs = _with(loads.inputs, layout, scaled)
    drive = loads_of(layout, system, z, inputs)
    n = layout.n_films
    K = projected(jnp, places, loads.contacts, jnp.asarray(system.P[0]))
    terms, E_terms = jnp.concatenate([jnp.asarray(system.A[0]), K]), jnp.asarray(effects.E)
    coefficients = jnp.concatenate([drive.theta - jnp.asarray(system.nominal), scaled.contact])
    joints = slice(n, n + len(scaled.joint))  # switched ones differ from their nominal values, which A0 includes
    coefficients = coefficients.at[joints].set(drive.theta[n:] * scaled.joint - jnp.asarray(system.nominal)[n:])
    rate, growth = jnp.asarray(inputs.rate), scaled.capacity - 1.0

    held, held_growth = lax.stop_gradient((coefficients, growth))
    matrix = rate * jnp.eye(z.shape[0]) + jnp.asarray(system.A0[0]) + jnp.tensordot(held, terms, 1)
    matrix = matrix + rate * jnp.tensordot(held_growth, E_terms, 1)
    factor = jnp.linalg.cholesky(matrix)
    if derivative:  # many right-hand sides: products are faster than substitution
        factor = cho_solve((factor, True), jnp.eye(z.shape[0]))
    fixed = _Fixed(factor, terms, E_terms, rate)

    def solve(right: jax.Array, near: jax.Array) -> tuple[jax.Array, jax.Array]:
        how = _by_inverse if derivative else _by_cholesky
        x = solved(how, _change, fixed, (coefficients, growth), right, near)
        return x, x

    def capacity(x: jax.Array) -> jax.Array:
        return rate * (x + jnp.tensordot(growth, E_terms @ x, 1))

    # contact sources bring their heat through ports
    contact = jnp.tensordot(scaled.source[np.array(places.sources, dtype=int)], loads.contact_heat, 1)
    forcing = (
        system.M @ (drive.theta[:n] * drive.rise) + system.H @ drive.lift.ravel() + system.B @ drive.power + contact
    )
    feedback = feedback_of(layout, system, inputs, jnp.asarray(drive.power))
    return integrate(inputs.tableau, inputs.substeps, solve, capacity, z, jnp.asarray(forcing), feedback)[0]


def _with(inputs: Inputs, layout: Layout, scaled: Factors) -> Inputs:
    """The runtime's inputs of a step with powers, films and environments of u."""
    n = layout.n_films
    films, losses = np.array(layout.following_films, dtype=int), np.array(layout.following_losses, dtype=int)
    return replace(
        inputs,
        theta=jnp.asarray(inputs.theta).at[:n].multiply(scaled.film),
        film_table=inputs.film_table * scaled.film[films][:, None],
        environment=inputs.environment + scaled.environment,
        power=inputs.power * scaled.source,
        power_table=inputs.power_table * scaled.source[losses][:, None],
    )


@partial(jax.jit, static_argnums=(0, 1, 2))
def trajectory(
    layout: Layout,
    places: ContactPlaces,
    derivative: bool,
    system: System,
    effects: Effects,
    loads: WindowLoads,
    start: Array,
    u: Array,
) -> jax.Array:
    """States (n + 1, r) from start (r,); u: parameters of the machine, then corrections of the start [K].

    derivative: whether derivatives by u are wanted; without them a step needs no inverse and no correction.
    """
    n = effects.source.shape[1]
    scaled = factors_at(effects, jnp.asarray(u)[:n])
    z0 = jnp.asarray(start) + jnp.asarray(u)[n:] @ jnp.asarray(effects.initial)

    def one(z: jax.Array, now: WindowLoads) -> tuple[jax.Array, jax.Array]:
        after = _step(layout, places, derivative, system, effects, scaled, z, now)
        return after, after

    _, states = lax.scan(one, z0, loads)
    return jnp.concatenate([z0[None], states])


def temperatures(system: System, states: jax.Array) -> jax.Array:
    """degC (n, n_sensors)."""
    return jnp.asarray(system.reference_temperature + states @ jnp.asarray(system.C).T)


def displacements(effects: Effects, rows: Rows, states: jax.Array, u: jax.Array) -> jax.Array:
    """m (k, 3) at the measured times and positions."""
    u = u[: effects.source.shape[1]]
    step = jnp.asarray(rows.step)
    z = states[step] + jnp.asarray(rows.share)[:, None] * (states[step + 1] - states[step])
    result = jnp.einsum("kcr,kr->kc", rows.row, z)
    growth = factors(effects.expansion, u) - 1.0
    result = result + jnp.einsum("e,ekcr,kr->kc", growth, rows.member_row, z)
    per_kelvin = jnp.einsum("cmn,n->cm", effects.component, u)  # m/K
    return result + (z @ jnp.asarray(effects.mean).T) @ per_kelvin.T

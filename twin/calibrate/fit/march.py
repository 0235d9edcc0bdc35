"""The window model stepped through a run as a function of the parameters, differentiable in JAX's forward mode.

The step is the runtime's implicit Euler with the runtime's own loads (`twin.run.stepping.loads_of`), and the exact
coefficients of every step in the matrix:

    S(u) z_new = rate E(u) z + f(u),     S(u) = rate E(u) + A0 + sum_k theta_k(u) A_k + sum_c g_c(u) P Gamma_c P^T

Derivatives by the implicit function theorem: with the inverse of S held fixed (stop_gradient) one Newton correction
z + S^-1 (f - S z) has the exact derivative S^-1 (f' - S' z). Differentiating the factorisation instead costs twenty
times as much for the same digits (measured at 100 states).
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

from twin.calibrate.fit.effects import Effects, Factors, contact_names, factors, factors_at
from twin.rom.drive import Drive
from twin.rom.model import MachineModel
from twin.run.stepping import Inputs, inputs_of, loads_of
from twin.run.system import Array, Layout, System


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Loads:
    """A run as the window model sees it; leading axis n_steps. c contacts, s contact sources."""

    inputs: Inputs  # of the runtime, without contacts and their heat
    contact_heat: Array  # (n, s, r) W, projected
    diagonal: Array  # (n, c, n_ports) W/K: Gamma of each contact by its diagonal,
    neighbour: Array  # (n, c, n_ports) its entries (i, i + 1),
    weight: Array  # (n, n_pairs, n_segments) and minus its entries between pads and rails


@dataclass(frozen=True)
class Places:
    """Where contacts are among the ports. Hashable: the compiled step is specialised on it."""

    contact_of_pair: tuple[int, ...]
    pad: tuple[int, ...]  # per pair: port of the pad,
    first: tuple[int, ...]  # first port and
    count: tuple[int, ...]  # number of segments of its rail
    n_contacts: int
    sources: tuple[int, ...]  # of contacts


def places_of(model: MachineModel) -> Places:
    """The contacts of a model."""
    load = model.load_model
    names = contact_names(model)
    rails = [load.rails[p.rail] for p in load.pairs]
    return Places(
        contact_of_pair=tuple(names.index(p.contact) for p in load.pairs),
        pad=tuple(p.pad_port for p in load.pairs),
        first=tuple(r.first_port for r in rails),
        count=tuple(len(r.stations) for r in rails),
        n_contacts=len(names),
        sources=load.contact_sources,
    )


def loads_for(model: MachineModel, drive: Drive, substeps: int) -> Loads:
    """The loads of a run for a model of one body."""
    (body,) = model.bodies
    names, pairs = contact_names(model), model.load_model.pairs
    own = []
    for name in names:
        mask = np.array([p.contact == name for p in pairs])
        own.append(inputs_of(model.load_model, replace(drive, conductance=drive.conductance * mask), substeps))
    inputs = inputs_of(model.load_model, drive, substeps, follow=0.0)
    n, n_ports = drive.n_steps, len(model.load_model.ports)
    bare = replace(
        inputs,
        port_heat=np.zeros((n, 0)),
        contact_diagonal=np.zeros((n, 0)),
        contact_neighbour=np.zeros((n, 0)),
        contact_weight=np.zeros((n, 0)),
        changed=np.zeros((n, 0)),
    )
    none = np.zeros((n, 0, n_ports))
    return Loads(
        inputs=bare,
        contact_heat=drive.contact_heat @ body.P.T,
        diagonal=np.stack([i.contact_diagonal for i in own], axis=1) if own else none,
        neighbour=np.stack([i.contact_neighbour for i in own], axis=1) if own else none,
        weight=inputs.contact_weight,
    )


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Rows:
    """Linear read-outs of a trajectory: k measured quantities, each a row at a place in time between two steps."""

    step: Array  # (k,) int: index of the state before
    share: Array  # (k,) of the state after
    row: Array  # (k, 3, r) m/K
    member_row: Array  # (n_e, k, 3, r) m/K: what expansions scale


def contacts_of(places: Places, P: Array, loads: Loads) -> jax.Array:
    """P Gamma_c P^T (c, r, r) [1/s in coordinates with E = 1] of one step, at nominal conductances."""
    P = jnp.asarray(P)
    r = P.shape[0]
    if not places.n_contacts:
        return jnp.zeros((0, r, r))
    PG = P * loads.diagonal[:, None, :]  # (c, r, ports)
    beside = loads.neighbour[:, None, :-1]
    PG = PG.at[:, :, :-1].add(P[:, 1:] * beside).at[:, :, 1:].add(P[:, :-1] * beside)
    result = PG @ P.T
    for k, c in enumerate(places.contact_of_pair):
        facing = P[:, places.first[k] : places.first[k] + places.count[k]] @ loads.weight[k, : places.count[k]]
        cross = jnp.outer(facing, P[:, places.pad[k]])
        result = result.at[c].add(-cross - cross.T)
    return result


def _step(
    layout: Layout,
    places: Places,
    derivative: bool,
    system: System,
    effects: Effects,
    scaled: Factors,
    z: jax.Array,
    loads: Loads,
) -> jax.Array:
    """The state (r,) after one step of `substeps` implicit Euler steps."""
    inputs = _with(loads.inputs, layout, scaled)
    drive = loads_of(layout, system, z, inputs)
    n = layout.n_films
    K = contacts_of(places, system.P[0], loads)
    terms = jnp.concatenate([jnp.asarray(system.A[0]), K])
    coefficients = jnp.concatenate([drive.theta - jnp.asarray(system.nominal), scaled.contact])
    joints = slice(n, n + len(scaled.joint))  # switched ones differ from their nominal values, which A0 includes
    coefficients = coefficients.at[joints].set(drive.theta[n:] * scaled.joint - jnp.asarray(system.nominal)[n:])
    rate = jnp.asarray(inputs.rate)

    def E(x: jax.Array) -> jax.Array:
        return x + jnp.tensordot(scaled.capacity - 1.0, jnp.asarray(effects.E) @ x, 1)

    def S(x: jax.Array) -> jax.Array:
        return rate * E(x) + jnp.asarray(system.A0[0]) @ x + coefficients @ (terms @ x)

    fixed = jax.tree.map(lax.stop_gradient, (coefficients, scaled.capacity))
    matrix = rate * jnp.eye(z.shape[0]) + jnp.asarray(system.A0[0]) + jnp.tensordot(fixed[0], terms, 1)
    matrix = matrix + rate * jnp.tensordot(fixed[1] - 1.0, jnp.asarray(effects.E), 1)
    factor = jnp.linalg.cholesky(matrix)
    inverse = cho_solve((factor, True), jnp.eye(z.shape[0])) if derivative else jnp.zeros((0, 0))

    power = drive.power  # contact sources bring theirs through ports
    contact = jnp.tensordot(scaled.source[np.array(places.sources, dtype=int)], loads.contact_heat, 1)
    forcing = system.M @ (drive.theta[:n] * drive.rise) + system.H @ drive.lift + system.B @ power + contact

    def substep(_: int, x: jax.Array) -> jax.Array:
        known = rate * E(x) + forcing
        if not derivative:
            return jnp.asarray(cho_solve((factor, True), known))
        solved = lax.stop_gradient(inverse @ lax.stop_gradient(known))
        return solved + inverse @ (known - S(solved))

    return lax.fori_loop(0, inputs.substeps, substep, z)


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
    places: Places,
    derivative: bool,
    system: System,
    effects: Effects,
    loads: Loads,
    start: Array,
    u: Array,
) -> jax.Array:
    """States (n + 1, r) from start (r,); u: parameters of the machine, then corrections of the start [K].

    derivative: whether derivatives by u are wanted; without them a step needs no inverse and no correction.
    """
    n = effects.source.shape[1]
    scaled = factors_at(effects, jnp.asarray(u)[:n])
    z0 = jnp.asarray(start) + jnp.asarray(u)[n:] @ jnp.asarray(effects.initial)

    def one(z: jax.Array, now: Loads) -> tuple[jax.Array, jax.Array]:
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

"""One time step of the reduced machine: a pure function of state and loads, in double precision.

Implicit Euler in coordinates with E = 1, several substeps of length h = 1/rate with the same loads and one factor:

    S z_new = rate z + sum_k (theta_k M_k (T_out,k - T_ref) + H_k lift_k) + B q + P q_port
              - sum_k (theta_k - held_k) A_k z
    S = rate + A0 + sum_k held_k A_k + P Gamma P^T

Paper 000 eqs (4)-(6) with the films implicit (erratum E-000-3). Gamma, the dwell-time mean of g d d^T over all pads
(`twin.rom.contact`), is tridiagonal on every rail, diagonal on pads, and of rank one between a rail and a pad: it is
assembled by body, never as an n_ports x n_ports product.

theta follows surface temperature and speed in every step (`twin.rom.following`). The factor is kept until a conductance
or a dwell weight changes, or theta leaves the values held in it by a share of FOLLOW. What is left of theta goes to the
right side, first with the state before and once more with the state so found: what then remains is of second order in
the deviation, stable as |theta - held| < held, and the balance counts what was solved.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial

import twin.run.jax_setup  # noqa: F401  isort: skip

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from twin.rom.drive import Drive
from twin.rom.following import FOLLOW, FilmPlan, difference_place, film_state, read_table, temperature_place
from twin.rom.load_model import LoadModel
from twin.run.block_factor import BlockFactor, Blocks, factorise, solve
from twin.run.system import Array, Layout, System


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Inputs:
    """Loads of a step; leading axis n_steps where several steps are stacked."""

    substeps: int = field(metadata={"static": True})

    rate: Array  # () 1/s: substeps per step length
    theta: Array  # (n_theta,) W/(m^2 K): convection of films that read the log alone, then joints
    film_table: Array  # (n_following_films, m) W/(m^2 K) over DIFFERENCES
    radiation: Array  # () 1 or 0
    environment: Array  # (n_environments,) degC
    power: Array  # (n_sources,) W of sources that read the log alone
    power_table: Array  # (n_following_losses, m) W over TEMPERATURES
    port_heat: Array  # (n_ports,) W
    contact_diagonal: Array  # (n_ports,) W/K, diagonal of Gamma
    contact_neighbour: Array  # (n_ports,) W/K, entry (i, i + 1) of Gamma; zero at the end of a rail and for pads
    contact_weight: Array  # (n_pairs, n_segments) W/K: minus the entries of Gamma between pad and rail segments
    changed: Array  # () bool: rate or contacts differ from those of the step before
    follow: Array  # () share by which theta may leave the values in the factor; 0 factorises whenever it changes


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class StepHeat:
    """Heat of a step and what made it. Balance: stored = dt * (sum of power + sum of film)."""

    film: Array  # (n_films,) W, mean over the step, positive into the machine
    gross: Array  # () W: all that films exchange, radiation and convection of one film each counted
    stored: Array  # () J
    power: Array  # (n_sources,) W
    theta: Array  # (n_theta,) W/(m^2 K), radiation included
    surface: Array  # (n_films,) degC: mean temperatures at the step's start, which theta follows
    winding: Array  # (n_following_losses,) degC: likewise of sources whose law follows the temperature of their surface


def inputs_of(load_model: LoadModel, drive: Drive, substeps: int, follow: float = FOLLOW) -> Inputs:
    """The drive as stacked step inputs (n_steps, ...), with the steps marked in which rate or contacts change."""
    n_steps, n_ports = drive.n_steps, len(load_model.ports)
    diagonal, neighbour = np.zeros((2, n_steps, n_ports))
    g = drive.conductance[:, :, None]
    for k, pair in enumerate(load_model.pairs):
        rail = load_model.rails[pair.rail]
        n = len(rail.stations)
        segments = slice(rail.first_port, rail.first_port + n)
        diagonal[:, segments] += g[:, k] * drive.square[:, k, :n]
        diagonal[:, pair.pad_port] += drive.conductance[:, k]
        neighbour[:, segments.start : segments.stop - 1] += g[:, k] * drive.neighbour[:, k, : n - 1]
    rate = substeps / np.diff(drive.time)
    rate = np.where(np.isclose(rate, rate[0], rtol=1e-9, atol=0.0), rate[0], rate)  # rounding of clock times
    weight = g * drive.weight
    changed = np.ones(n_steps, dtype=bool)
    parts = (rate, diagonal, neighbour, weight)
    changed[1:] = np.any([np.any(np.diff(p.reshape(n_steps, -1), axis=0) != 0.0, axis=1) for p in parts], axis=0)
    return Inputs(
        substeps=substeps,
        rate=rate,
        theta=drive.theta,
        film_table=drive.films.value,
        radiation=np.full(n_steps, float(drive.radiation)),
        environment=drive.environment,
        power=drive.power,
        power_table=drive.losses.value,
        port_heat=drive.port_heat,
        contact_diagonal=diagonal,
        contact_neighbour=neighbour,
        contact_weight=weight,
        changed=changed,
        follow=np.full(n_steps, follow),
    )


def system_blocks(layout: Layout, system: System, inputs: Inputs, theta: Array) -> Blocks:
    """Blocks of S = rate + A0 + sum_k theta_k A_k + P Gamma P^T [1/s], by body; theta (n_theta,) whole."""
    blocks: Blocks = {}
    for b, size in enumerate(layout.sizes):
        block = system.A0[b] + _terms(layout, system, b, theta - system.nominal) + inputs.rate * jnp.eye(size)
        ports = np.array(layout.ports[b], dtype=int)
        if len(ports):
            # P Gamma with Gamma tridiagonal: neighbours on a rail have consecutive local ports
            P, beside = jnp.asarray(system.P[b]), inputs.contact_neighbour[ports[:-1]]
            PG = P * inputs.contact_diagonal[ports]
            PG = PG.at[:, :-1].add(P[:, 1:] * beside).at[:, 1:].add(P[:, :-1] * beside)
            block = block + PG @ system.port_rows[b]
        blocks[b, b] = jnp.asarray(block)
    for c in layout.couplings:
        r, p, pads = c.rail_body, c.pad_body, np.array(c.pad_ports)
        facing = [
            (slice(first, first + n), inputs.contact_weight[k, :n])
            for k, first, n in zip(c.pairs, c.rail_first, c.rail_count, strict=True)
        ]
        rail_in = jnp.stack([system.P[r][:, rail] @ w for rail, w in facing], axis=1)
        rail_out = jnp.stack([w @ system.port_rows[r][rail] for rail, w in facing])
        for key, part in (
            ((r, p), rail_in @ jnp.asarray(system.port_rows[p])[pads]),
            ((p, r), jnp.asarray(system.P[p])[:, pads] @ rail_out),
        ):
            blocks[key] = blocks[key] - part if key in blocks else -part
    return blocks


def _terms(layout: Layout, system: System, b: int, theta: Array) -> jax.Array:
    """sum_k theta_k A_k of one body, without a pass over the joints where they are zero, as in most runs.

    Written as a sum, which XLA makes one pass over memory; a product with the stacked A takes three times as long.
    """
    terms, A, size = layout.terms[b], jnp.asarray(system.A[b]), layout.sizes[b]
    theta = jnp.asarray(theta)

    def part(films: bool) -> jax.Array:
        own = [theta[k] * A[i] for i, k in enumerate(terms) if (k < layout.n_films) == films]
        return sum(own, jnp.zeros((size, size)))

    joints = np.array([k for k in terms if k >= layout.n_films], dtype=int)
    if not len(joints):
        return part(True)
    return lax.cond(jnp.any(theta[joints] != 0.0), lambda: part(True) + part(False), lambda: part(True))


def factor_of(layout: Layout, system: System, inputs: Inputs, theta: Array) -> BlockFactor:
    """Factor of the matrix of a step with coefficients theta (n_theta,)."""
    return factorise(system_blocks(layout, system, inputs, theta), layout.elimination, layout.symmetric)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class State:
    """What a step hands to the next one."""

    z: jax.Array  # (N,)
    factor: BlockFactor
    held: jax.Array  # (n_theta,) coefficients in the factor


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class StepLoads:
    """What drives a step, with the laws that follow the state read at its start."""

    theta: jax.Array  # (n_theta,)
    rise: jax.Array  # (n_films,)
    lift: jax.Array  # (n_films,)
    power: jax.Array  # (n_sources,)
    surface: jax.Array  # (n_films,)
    winding: jax.Array  # (n_following_losses,)
    radiated: jax.Array  # (n_films,) W


def loads_of(layout: Layout, system: System, z: jax.Array, inputs: Inputs) -> StepLoads:
    """What drives a step from state z (N,): the laws of the log, and those that follow the state read there."""
    n, T_ref = layout.n_films, system.reference_temperature
    theta, power = jnp.asarray(inputs.theta), jnp.asarray(inputs.power)
    plan = FilmPlan(
        system.film_environment, system.film_radiant, system.film_emissivity, system.film_gradient, system.film_height
    )
    area = jnp.where(system.film_area > 0.0, system.film_area, 1.0)
    surface = T_ref + (system.film_rows @ z) / area
    if layout.following_films:
        own = np.array(layout.following_films)
        air = plan.air(inputs.environment, system.film_moment / area)[own]
        theta = theta.at[own].set(read_table(jnp, inputs.film_table, difference_place(jnp, surface[own] - air)))
    films = film_state(jnp, plan, theta[:n], surface, inputs.environment, inputs.radiation)
    theta = theta.at[:n].set(films.total)
    winding = T_ref + system.source_rows @ z
    if layout.following_losses:
        own = np.array(layout.following_losses)
        power = power.at[own].set(read_table(jnp, inputs.power_table, temperature_place(jnp, winding)))
    return StepLoads(
        theta, films.outer - T_ref, films.lift, power, jnp.asarray(surface), jnp.asarray(winding), area * films.radiated
    )


def step(layout: Layout, system: System, state: State, inputs: Inputs) -> tuple[State, tuple[jax.Array, StepHeat]]:
    """Advance a state by one step of `inputs.substeps` implicit Euler steps: the new one, and z with the heat.

    Pure: jit, scan and vmap apply. The factor is used again where `inputs.changed` is False and theta stays near.
    """
    start, n, borders = state.z, layout.n_films, layout.offsets[1:-1]
    loads = loads_of(layout, system, start, inputs)
    anew = inputs.changed | jnp.any(jnp.abs(loads.theta - state.held) > inputs.follow * state.held)
    factor, held = lax.cond(
        anew,
        lambda: (factor_of(layout, system, inputs, loads.theta), loads.theta),
        lambda: (state.factor, state.held),
    )
    more = loads.theta - held
    far = jnp.any(jnp.abs(more) > inputs.follow / 2 * held)  # nearer, one pass is as good as the step itself
    port_heat = [P @ inputs.port_heat[np.array(p, dtype=int)] for P, p in zip(system.P, layout.ports, strict=True)]
    film_in = system.M @ (loads.theta[:n] * loads.rise) + system.H @ loads.lift
    forcing = film_in + system.B @ loads.power + jnp.concatenate(port_heat)

    def solved(known: jax.Array, seen: jax.Array, rest: tuple[jax.Array, ...]) -> jax.Array:
        if rest:
            known = known - jnp.concatenate([R @ zb for R, zb in zip(rest, jnp.split(seen, borders), strict=True)])
        return jnp.concatenate(solve(factor, layout.elimination, jnp.split(known, borders), layout.symmetric))

    def substeps(rest: tuple[jax.Array, ...]) -> tuple[jax.Array, jax.Array, jax.Array]:
        def substep(_: int, sums: tuple[jax.Array, jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array, jax.Array]:
            z, old, new = sums
            known, seen = jnp.asarray(inputs.rate * z + forcing), z
            after = solved(known, seen, rest)
            if rest:
                seen, after = lax.cond(far, lambda: (after, solved(known, after, rest)), lambda: (seen, after))
            return after, old + seen, new + after

        zero = jnp.zeros_like(start)
        return lax.fori_loop(0, inputs.substeps, substep, (start, zero, zero))

    # sum_k (theta_k - held_k) A_k costs a pass over all A_k: once per step, and not at all where theta is held exactly
    z, old, new = lax.cond(
        jnp.any(more != 0.0),
        lambda: substeps(tuple(_terms(layout, system, b, more) for b in range(len(layout.sizes)))),
        lambda: substeps(()),
    )
    film = loads.theta[:n] * system.film_area * loads.rise + system.film_moment * loads.lift
    film = film - (held[:n] * (system.film_rows @ new) + more[:n] * (system.film_rows @ old)) / inputs.substeps
    gross = jnp.abs(film - loads.radiated).sum() + jnp.abs(loads.radiated).sum()
    heat = StepHeat(film, gross, system.energy @ (z - start), loads.power, loads.theta, loads.surface, loads.winding)
    return State(z, factor, held), (z, heat)


@partial(jax.jit, static_argnums=0)
def advance(layout: Layout, system: System, z: jax.Array, inputs: Inputs) -> tuple[jax.Array, StepHeat]:
    """States (n_steps, N) and heat after each of the stacked steps, from state z (N,). The first step factorises."""
    first = jax.tree.map(lambda a: a[0], inputs)
    shape = jax.eval_shape(partial(factor_of, layout), system, first, first.theta)
    factor = jax.tree.map(lambda a: jnp.zeros(a.shape, a.dtype), shape)
    held = jnp.zeros(first.theta.shape)
    _, (states, heat) = lax.scan(partial(step, layout, system), State(z, factor, held), inputs)
    return states, heat


@jax.jit
def observe(system: System, states: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Sensor temperatures (n, n_sensors) degC and TCP displacements (n, n_poses, 3) m of states (n, N)."""
    temperature = jnp.asarray(system.reference_temperature + states @ system.C.T)
    return temperature, (states @ system.G.T).reshape(len(states), -1, 3)

"""One time step of the reduced machine: a pure function of state and loads, in double precision.

Coordinates with E = 1; several substeps with the same loads and one factor, each by the stages of a tableau
(`twin.rom.tableau`):

    S Z = rate base + sum_k (theta_k M_k (T_out,k - T_ref) + H_k lift_k) + B q + P q_port
          - sum_k (theta_k - held_k) A_k Z
    S = rate + A0 + sum_k held_k A_k + P Gamma P^T        (`twin.run.matrix`)

Paper 000 eqs (4)-(6) with the films implicit (erratum E-000-3).

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

from twin.rom.contact_matrix import ContactEntries, contact_entries
from twin.rom.drive import Drive
from twin.rom.following import FOLLOW
from twin.rom.load_model import LoadModel
from twin.rom.step_loads import StepDrive, StepLoads, Tabulated, source_powers, step_loads
from twin.rom.tableau import SDIRK2_6, Feedback, Tableau
from twin.run.block_factor import BlockFactor
from twin.run.integrator import Sums, integrate
from twin.run.matrix import by_factor, factor_of, terms_of
from twin.run.system import Array, Layout, System


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Inputs:
    """Loads of a step; leading axis n_steps where several steps are stacked."""

    substeps: int = field(metadata={"static": True})
    tableau: Tableau = field(metadata={"static": True})

    rate: Array  # () 1/s: substeps per step length, by the tableau's diagonal
    theta: Array  # (n_theta,) W/(m^2 K): convection of films that read the log alone, then joints
    film_table: Array  # (n_following_films, m) W/(m^2 K) over DIFFERENCES
    radiation: Array  # () 1 or 0
    environment: Array  # (n_environments,) degC
    position: Array  # (axes,) m, mean over the step
    power: Array  # (n_sources,) W of sources that read the log alone
    power_table: Array  # (n_following_losses, m) W over TEMPERATURES
    port_heat: Array  # (n_ports,) W
    contacts: ContactEntries  # of Gamma, all contacts together
    changed: Array  # () bool: rate or contacts differ from those of the step before
    follow: Array  # () share by which theta may leave the values in the factor; 0 factorises whenever it changes


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class StepHeat:
    """Heat of a step and what made it. Balance: stored = dt * (sum of power + sum of film)."""

    film: Array  # (n_films,) W, mean over the step, positive into the machine
    gross: Array  # () W: all that films exchange, radiation and convection of one film each counted
    stored: Array  # () J
    power: Array  # (n_sources,) W, mean over the step
    theta: Array  # (n_theta,) W/(m^2 K), radiation included
    surface: Array  # (n_films,) degC: mean temperatures at the step's start, which theta follows
    winding: Array  # (n_following_losses,) degC: likewise of sources whose law follows the temperature of their surface


def inputs_of(
    load_model: LoadModel, drive: Drive, substeps: int, follow: float = FOLLOW, tableau: Tableau = SDIRK2_6
) -> Inputs:
    """The drive as stacked step inputs (n_steps, ...), with the steps marked in which rate or contacts change."""
    n_steps, contacts = drive.n_steps, contact_entries(load_model, drive)
    rate = substeps / np.diff(drive.time) / tableau.diagonal
    rate = np.where(np.isclose(rate, rate[0], rtol=1e-9, atol=0.0), rate[0], rate)  # rounding of clock times
    changed = np.ones(n_steps, dtype=bool)
    parts = (rate, contacts.diagonal, contacts.neighbour, contacts.weight)
    changed[1:] = np.any([np.any(np.diff(p.reshape(n_steps, -1), axis=0) != 0.0, axis=1) for p in parts], axis=0)
    return Inputs(
        substeps=substeps,
        tableau=tableau,
        rate=rate,
        theta=drive.theta,
        film_table=drive.films.value,
        radiation=np.full(n_steps, float(drive.radiation)),
        environment=drive.environment,
        position=drive.mean_position,
        power=drive.power,
        power_table=drive.losses.value,
        port_heat=drive.port_heat,
        contacts=contacts,
        changed=changed,
        follow=np.full(n_steps, follow),
    )


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class State:
    """What a step hands to the next one."""

    z: jax.Array  # (N,)
    factor: BlockFactor
    held: jax.Array  # (n_theta,) coefficients in the factor


def loads_of(layout: Layout, system: System, z: jax.Array, inputs: Inputs) -> StepLoads:
    """What drives a step from state z (N,): the laws of the log, and those that follow the state read there."""
    n, T_ref = layout.n_films, system.reference_temperature
    theta = jnp.asarray(inputs.theta)
    drive = StepDrive(
        convection=Tabulated(theta[:n], layout.following_films, inputs.film_table),
        joints=theta[n:],
        power=Tabulated(jnp.asarray(inputs.power), layout.following_losses, inputs.power_table),
        port_heat=inputs.port_heat,
        environment=inputs.environment,
        position=inputs.position,
        radiation=inputs.radiation,
    )
    return step_loads(jnp, system.film_plan, drive, system.surfaces(z), T_ref + system.source_rows @ z, T_ref)


def forcing_of(layout: Layout, system: System, loads: StepLoads) -> jax.Array:
    """M theta (T_out - T_ref) + H lift + B q + P q_port (N,)."""
    films = system.M @ (loads.theta[: layout.n_films] * loads.rise) + system.H @ loads.lift.ravel()
    ports = [P @ loads.port_heat[np.array(p, dtype=int)] for P, p in zip(system.P, layout.ports, strict=True)]
    return jnp.asarray(films + system.B @ loads.power + jnp.concatenate(ports))


def feedback_of(layout: Layout, system: System, inputs: Inputs, power: jax.Array) -> Feedback | None:
    """What sources that follow the temperature of their surface add to a forcing with powers (n_sources,) [W].

    None where no source does.
    """
    if not layout.following_losses:
        return None
    index = np.array(layout.following_losses, dtype=int)
    told = Tabulated(jnp.asarray(inputs.power), layout.following_losses, jnp.asarray(inputs.power_table))

    def feedback(z: jax.Array) -> tuple[jax.Array, jax.Array]:
        now = source_powers(jnp, told, system.reference_temperature + system.source_rows @ z)[index]
        return jnp.asarray(system.B[:, index] @ (now - power[index])), now

    return feedback


def kept_or_new(
    layout: Layout, system: System, state: State, inputs: Inputs, theta: jax.Array
) -> tuple[BlockFactor, jax.Array]:
    """The state's factor with the coefficients (n_theta,) in it, or a new one where these are not near enough."""
    anew = inputs.changed | jnp.any(jnp.abs(theta - state.held) > inputs.follow * state.held)
    return lax.cond(
        anew,
        lambda: (factor_of(layout, system, inputs.rate, inputs.contacts, theta), theta),
        lambda: (state.factor, state.held),
    )


def step(layout: Layout, system: System, state: State, inputs: Inputs) -> tuple[State, tuple[jax.Array, StepHeat]]:
    """Advance a state by one step of `inputs.substeps` steps of the tableau: the new one, and z with the heat.

    Pure: jit, scan and vmap apply. The factor is used again where `inputs.changed` is False and theta stays near.
    """
    start, n = state.z, layout.n_films
    loads = loads_of(layout, system, start, inputs)
    factor, held = kept_or_new(layout, system, state, inputs, loads.theta)
    more = loads.theta - held
    far = jnp.any(jnp.abs(more) > inputs.follow / 2 * held)  # nearer, one pass is enough; certified with it
    forcing = forcing_of(layout, system, loads)
    feedback = feedback_of(layout, system, inputs, jnp.asarray(loads.power))

    def substeps(rest: tuple[jax.Array, ...]) -> Sums:
        def solve(right: jax.Array, near: jax.Array) -> tuple[jax.Array, jax.Array]:
            after = by_factor(layout, factor, rest, right, near)
            if not rest:
                return after, near
            again = lambda: (by_factor(layout, factor, rest, right, after), after)  # noqa: E731
            return lax.cond(far, again, lambda: (after, near))

        capacity = lambda z: jnp.asarray(inputs.rate * z)  # noqa: E731
        return integrate(inputs.tableau, inputs.substeps, solve, capacity, start, forcing, feedback)

    # sum_k (theta_k - held_k) A_k costs a pass over all A_k: once per step, and not at all where theta is held exactly
    z, new, old, following = lax.cond(
        jnp.any(more != 0.0),
        lambda: substeps(tuple(terms_of(layout, system, b, more) for b in range(len(layout.sizes)))),
        lambda: substeps(()),
    )
    film = loads.theta[:n] * system.film_area * loads.rise + (system.film_moment * loads.lift).sum(axis=0)
    film = film - (held[:n] * (system.film_rows @ new) + more[:n] * (system.film_rows @ old)) / inputs.substeps
    radiated = system.safe_area * loads.radiated
    gross = jnp.abs(film - radiated).sum() + jnp.abs(radiated).sum()
    power = jnp.asarray(loads.power)
    if feedback is not None:
        power = power.at[np.array(layout.following_losses, dtype=int)].set(following / inputs.substeps)
    heat = StepHeat(film, gross, system.energy @ (z - start), power, loads.theta, loads.surface, loads.winding)
    return State(z, factor, held), (z, heat)


@partial(jax.jit, static_argnums=0)
def without_factor(layout: Layout, system: System, z: jax.Array, first: Inputs) -> State:
    """The state to begin with, before a step of these inputs: its factor is empty, and the step must make one."""
    theta = jnp.asarray(first.theta)
    shape = jax.eval_shape(partial(factor_of, layout), system, first.rate, first.contacts, theta)
    return State(z, jax.tree.map(lambda a: jnp.zeros(a.shape, a.dtype), shape), jnp.zeros(theta.shape))


@partial(jax.jit, static_argnums=0)
def advance(layout: Layout, system: System, z: jax.Array, inputs: Inputs) -> tuple[jax.Array, StepHeat]:
    """States (n_steps, N) and heat after each of the stacked steps, from state z (N,). The first step factorises."""
    first = without_factor(layout, system, z, jax.tree.map(lambda a: a[0], inputs))
    _, (states, heat) = lax.scan(partial(step, layout, system), first, inputs)
    return states, heat


@jax.jit
def observe(system: System, states: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Sensor temperatures (n, n_sensors) degC and TCP displacements (n, n_poses, 3) m of states (n, N)."""
    temperature = jnp.asarray(system.reference_temperature + states @ system.C.T)
    return temperature, (states @ system.G.T).reshape(len(states), -1, 3)

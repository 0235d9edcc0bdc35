"""One time step of the reduced machine: a pure function of state and loads, in double precision.

Implicit Euler in coordinates with E = 1, several substeps of length h = 1/rate with the same loads and one factor:

    S z_new = rate z + sum_k theta_k M_k (T_amb,k - T_ref) + B q + P q_port
    S = rate + A0 + sum_k theta_k A_k + P Gamma P^T

Paper 000 eqs (4)-(6) with the films implicit (erratum E-000-3). Gamma, the dwell-time mean of g d d^T over all pads
(`twin.rom.contact`), is tridiagonal on every rail, diagonal on pads, and of rank one between a rail and a pad: it is
assembled by body, never as an n_ports x n_ports product. The factor is kept until theta, a conductance or a dwell
weight changes.
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
from twin.rom.load_model import LoadModel
from twin.run.block_factor import BlockFactor, Blocks, factorise, solve
from twin.run.system import Array, Layout, System


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Inputs:
    """Loads of a step; leading axis n_steps where several steps are stacked."""

    substeps: int = field(metadata={"static": True})

    rate: Array  # () 1/s: substeps per step length
    theta: Array  # (n_theta,) W/(m^2 K)
    environment: Array  # (n_environments,) degC
    power: Array  # (n_sources,) W
    port_heat: Array  # (n_ports,) W
    contact_diagonal: Array  # (n_ports,) W/K, diagonal of Gamma
    contact_neighbour: Array  # (n_ports,) W/K, entry (i, i + 1) of Gamma; zero at the end of a rail and for pads
    contact_weight: Array  # (n_pairs, n_segments) W/K: minus the entries of Gamma between pad and rail segments
    changed: Array  # () bool: the matrix differs from that of the step before


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class StepHeat:
    """Heat of a step. Balance: stored = dt * (sum of power + sum of film)."""

    film: Array  # (n_films,) W, mean over the step, positive into the machine
    stored: Array  # () J


def inputs_of(load_model: LoadModel, drive: Drive, substeps: int) -> Inputs:
    """The drive as stacked step inputs (n_steps, ...), with the steps marked in which the matrix changes."""
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
    parts = (rate, drive.theta, diagonal, neighbour, weight)
    changed[1:] = np.any([np.any(np.diff(p.reshape(n_steps, -1), axis=0) != 0.0, axis=1) for p in parts], axis=0)
    return Inputs(
        substeps=substeps,
        rate=rate,
        theta=drive.theta,
        environment=drive.environment,
        power=drive.power,
        port_heat=drive.port_heat,
        contact_diagonal=diagonal,
        contact_neighbour=neighbour,
        contact_weight=weight,
        changed=changed,
    )


def system_blocks(layout: Layout, system: System, inputs: Inputs) -> Blocks:
    """Blocks of S = rate + A0 + sum_k theta_k A_k + P Gamma P^T [1/s], by body."""
    blocks: Blocks = {}
    for b, size in enumerate(layout.sizes):
        theta = inputs.theta[np.array(layout.terms[b], dtype=int)]
        block = system.A0[b] + jnp.tensordot(theta, system.A[b], axes=1) + inputs.rate * jnp.eye(size)
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


def factor_of(layout: Layout, system: System, inputs: Inputs) -> BlockFactor:
    """Factor of the matrix of a step."""
    return factorise(system_blocks(layout, system, inputs), layout.elimination, layout.symmetric)


def step(
    layout: Layout, system: System, state: tuple[jax.Array, BlockFactor], inputs: Inputs
) -> tuple[tuple[jax.Array, BlockFactor], tuple[jax.Array, StepHeat]]:
    """Advance (z, factor) by one step of `inputs.substeps` implicit Euler steps: the new pair, and z with the heat.

    Pure: jit, scan and vmap apply. The factor of the state is used where `inputs.changed` is False.
    """
    start, factor = state
    factor = lax.cond(inputs.changed, lambda: factor_of(layout, system, inputs), lambda: factor)
    borders = layout.offsets[1:-1]
    rise = inputs.environment[system.film_environment] - system.reference_temperature
    port_heat = [P @ inputs.port_heat[np.array(p, dtype=int)] for P, p in zip(system.P, layout.ports, strict=True)]
    forcing = system.M @ (inputs.theta * rise) + system.B @ inputs.power + jnp.concatenate(port_heat)

    def substep(_: int, pair: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        z, total = pair
        right = jnp.split(inputs.rate * z + forcing, borders)
        z = jnp.concatenate(solve(factor, layout.elimination, right, layout.symmetric))
        return z, total + z

    z, total = lax.fori_loop(0, inputs.substeps, substep, (start, jnp.zeros_like(start)))
    film = inputs.theta * (system.film_area * rise - system.film_rows @ (total / inputs.substeps))
    return (z, factor), (z, StepHeat(film[: layout.n_films], system.energy @ (z - start)))


@partial(jax.jit, static_argnums=0)
def advance(layout: Layout, system: System, z: jax.Array, inputs: Inputs) -> tuple[jax.Array, StepHeat]:
    """States (n_steps, N) and heat after each of the stacked steps, from state z (N,). The first step factorises."""
    shape = jax.eval_shape(partial(factor_of, layout), system, jax.tree.map(lambda a: a[0], inputs))
    factor = jax.tree.map(lambda a: jnp.zeros(a.shape, a.dtype), shape)
    _, (states, heat) = lax.scan(partial(step, layout, system), (z, factor), inputs)
    return states, heat


@jax.jit
def observe(system: System, states: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Sensor temperatures (n, n_sensors) degC and TCP displacements (n, n_poses, 3) m of states (n, N)."""
    temperature = jnp.asarray(system.reference_temperature + states @ system.C.T)
    return temperature, (states @ system.G.T).reshape(len(states), -1, 3)

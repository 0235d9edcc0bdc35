"""The window model stepped through a run with hypotheses switched on: states and exact derivatives.

As `twin.calibrate.fit.integration`, with two differences. A step is a two-stage SDIRK step (Alexander, SIAM J. Numer.
Anal. 14, 1977: second order, L-stable, one matrix for both stages), as implicit Euler of 60 s is a tenth of a kelvin
off beside nuts and motors. And K slots hold what the description lacks, each times an amplitude a_k that is
differentiated like a parameter:

    (E + sum a_k E_k) x' = -(A(theta law (1 + sum a_k film_k), joints, contacts) + sum a_k gate_k A_k) x
                           + (B + sum a_k B_k) P + ... + sum a_k (gate_k rise_k M_k + forcing_k),
    T_air + sum a_k environment_k,      law = (rise / usual)^e exp(w wind + m wind_exponent)
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from itertools import repeat

import twin.run.jax_setup  # noqa: F401  isort: skip

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from twin.calibrate.fit.effects import Effects, Factors, factors_at
from twin.calibrate.fit.integration import Rows, displacements, temperatures
from twin.diagnose.model.ports_first import PortsFirst, packed, unpacked, within
from twin.diagnose.model.probed_loads import ProbedLoads
from twin.diagnose.model.slots import Slots
from twin.diagnose.model.solve import Fixed, by_factor, change_of, products_of
from twin.rom.contact_matrix import ContactPlaces, dense, scaled
from twin.rom.step_loads import Tabulated, film_loads, source_powers
from twin.rom.tableau import SDIRK2
from twin.run.integrator import integrate, solved
from twin.run.system import Array, Layout

BLOCK = 16  # steps whose factors are kept at once
IN_CACHE = 1e6  # bytes that a processor reads again in no time: terms of more are read once per block
LITTLE = 0.5  # K, of a surface above its air: the room's own draught is left below it


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class _Known:
    """A step that has been made, for its derivatives."""

    factor: jax.Array  # (r, r) Cholesky factor of its matrix
    solutions: tuple[jax.Array, jax.Array]  # (q + n_contacts, r) `products_of` its two stages
    bases: tuple[jax.Array, ...]  # (c, r) of the terms of E with what each of the stages begins at


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Operators:
    """What stays during a trajectory, in the coordinates of `twin.diagnose.model.ports_first`; t = r (r + 1) / 2."""

    A: jax.Array  # (p, t): terms of films, of joints unless these are still, then of slots
    still: jax.Array  # (t,): A0 with the terms of still joints
    E: jax.Array  # (r, r), many: its derivatives left out
    packed_E: jax.Array  # (t,)
    terms: jax.Array  # (q, r, r), many: all that is added to A0, then of E: of the model's capacities, then of slots
    factors: jax.Array  # (c,) of the terms of E
    B: jax.Array  # (r, n_sources)
    reads: jax.Array  # (l, r): temperatures that sources follow
    M: jax.Array  # (K, r) of slots

    @classmethod
    def of(
        cls, layout: Layout, many: bool, still: jax.Array | None, machine: PortsFirst, effects: Effects, slots: Slots,
        f: Factors, a: jax.Array,
    ) -> Operators:  # fmt: skip
        """At factors f and amplitudes a. still: (n_joints,) W/K of joints over their nominal ones in all steps."""
        n, T, system = layout.n_films, machine.ports.T, machine.system
        A, of_slots = jnp.asarray(system.A[0]), packed(within(T, slots.A))
        terms = jnp.asarray(within(T, jnp.concatenate([jnp.asarray(effects.E), jnp.asarray(slots.E)])))
        factors = jnp.concatenate([f.capacity - 1.0, a])
        E = jnp.asarray(machine.E) + jnp.tensordot(lax.stop_gradient(factors) if many else factors, terms, 1)
        moving = jnp.concatenate([A if still is None else A[:n], of_slots])
        rest = jnp.asarray(system.A0[0])
        if still is not None:
            rest = rest + (lax.stop_gradient(still) if many else still) @ A[n:]
        r = len(T)
        every = jnp.concatenate([unpacked(jnp.concatenate([A, of_slots]), r), terms]) if many else jnp.zeros((0, r, r))
        B = jnp.asarray(system.B) + jnp.tensordot(a, T.T @ jnp.asarray(slots.B), 1)
        reads = jnp.asarray(system.source_rows) + jnp.tensordot(a, jnp.asarray(slots.reads) @ T, 1)
        return cls(moving, rest, E, jnp.asarray(packed(E)), every, factors, B, reads, jnp.asarray(slots.M) @ T)


def _step(
    layout: Layout, places: ContactPlaces, still: bool, machine: PortsFirst, f: Factors, a: jax.Array,
    fixed: Operators, z: jax.Array, now: tuple[ProbedLoads, Slots], known: _Known | None = None,
) -> tuple[jax.Array, jax.Array, jax.Array]:  # fmt: skip
    """The state (r,) after a step, that at its first stage, and the factor (r, r) of its matrix."""
    loads, slots = now
    system = machine.system
    n, T_ref = layout.n_films, system.reference_temperature
    losing = np.array(layout.following_losses, dtype=int)
    environment = jnp.asarray(loads.environment) + f.environment + a @ jnp.asarray(slots.environment)
    # films and losses follow the state at the step's start
    convection = Tabulated(jnp.asarray(loads.theta)[:n], layout.following_films, loads.film_table)
    surfaces, position = system.surfaces(z), jnp.asarray(loads.position)
    rise = jnp.maximum(jnp.abs(surfaces - system.film_plan.air(environment, position)), LITTLE)
    wind = f.wind * jnp.asarray(loads.wind) + f.wind_exponent * jnp.asarray(loads.wind_exponent)
    law = (rise / jnp.asarray(loads.usual)) ** f.exponent * jnp.exp(wind)
    film_factor = f.film * jnp.maximum(1.0 + a @ jnp.asarray(slots.film), 0.02)
    films = film_loads(jnp, system.film_plan, convection, surfaces, environment, position, 1.0, film_factor)
    films = replace(films, total=films.total * law, lift=films.lift * law)
    joint_factor = f.joint * jnp.maximum(1.0 + a @ jnp.asarray(slots.joint), 0.02)
    joints = jnp.asarray(loads.theta)[n:] * joint_factor
    contact = f.contact * jnp.maximum(1.0 + a @ jnp.asarray(slots.contact), 0.02)
    P, rate = jnp.asarray(system.P[0]), jnp.asarray(loads.rate) / SDIRK2.diagonal
    gate = a * jnp.asarray(slots.gate)
    nominal = jnp.asarray(system.nominal)
    coefficients = jnp.concatenate([films.total - nominal[:n], joints - nominal[n:], gate])
    many = len(fixed.terms) > 0
    moving = jnp.concatenate([coefficients[:n], gate]) if still else coefficients
    total = rate * fixed.packed_E + fixed.still + (lax.stop_gradient(moving) if many else moving) @ fixed.A
    matrix = unpacked(total, len(z))
    c = jnp.concatenate([coefficients, rate * fixed.factors]) if many else matrix

    told = Tabulated(
        jnp.asarray(loads.power) * f.source, layout.following_losses,
        jnp.asarray(loads.power_table) * f.source[losing][:, None],
    )  # fmt: skip
    power = source_powers(jnp, told, T_ref + fixed.reads @ z)
    ports = jnp.tensordot(f.source[np.array(places.sources, dtype=int)], jnp.asarray(loads.contact_heat), 1)
    forcing = system.M @ (films.total * (films.outer - T_ref)) + system.H @ films.lift.ravel()
    forcing = forcing + fixed.B @ power + ports
    forcing = forcing + (gate * jnp.asarray(slots.rise)) @ fixed.M + a @ jnp.asarray(slots.forcing)
    if known is None:
        gamma = dense(jnp, places, scaled(jnp, places, loads.contacts, lax.stop_gradient(contact)))
        coupled = machine.ports.joined(lax.stop_gradient(matrix), gamma)
        factor = lax.linalg.cholesky(coupled, symmetrize_input=False)  # it reads the lower triangle
    else:
        factor = known.factor
    # asked for in the order of the stages
    solutions = repeat(None) if known is None else iter(known.solutions)
    bases = repeat(None) if known is None else iter(known.bases)

    def capacity(x: jax.Array) -> jax.Array:
        products = next(bases)
        if not many:
            return rate * (fixed.E @ x)
        products = fixed.terms[len(coefficients) :] @ lax.stop_gradient(x) if products is None else products
        return rate * (fixed.E @ x + (fixed.factors - lax.stop_gradient(fixed.factors)) @ products)

    def solve(right: jax.Array, near: jax.Array) -> tuple[jax.Array, jax.Array]:
        own = Fixed(factor, fixed.terms, next(solutions), loads.contacts, P)
        y = solved(by_factor, partial(change_of, places), own, (c, contact), right, near)
        return y, y

    after, mean, *_ = integrate(SDIRK2, 1, solve, capacity, z, jnp.asarray(forcing))
    first = (mean - SDIRK2.weights[1] * after) / SDIRK2.weights[0]
    return after, first, factor


def _in_blocks(
    layout: Layout, places: ContactPlaces, still: bool, machine: PortsFirst, f: Factors, a: jax.Array,
    fixed: Operators, z: jax.Array, now: tuple[ProbedLoads, Slots],
) -> jax.Array:  # fmt: skip
    """States (n, r) after all steps from z (r,), for many derivatives. Block by block the steps are made first, then
    the products of all terms with their stages, one product of matrices each, then the steps again with derivatives.

    Products with one state at a time read all terms in every stage: at 221 states and 70 terms that took half of the
    time of 82 derivatives (by a script). All steps at once would keep a factor of each.
    """
    n, r = len(now[0].rate), len(z)
    count = -(-n // BLOCK)
    share = SDIRK2.rows[1][0] / SDIRK2.diagonal
    of_E = fixed.terms[len(fixed.terms) - len(fixed.factors) :]
    step = partial(_step, layout, places, still, machine)
    make = partial(step, *lax.stop_gradient((f, a, replace(fixed, terms=fixed.terms[:0]))))

    def blocks(x: Array) -> jax.Array:
        beyond = jnp.repeat(jnp.asarray(x)[-1:], count * BLOCK - n, axis=0)
        return jnp.concatenate([jnp.asarray(x), beyond]).reshape(count, BLOCK, *beyond.shape[1:])

    products = jax.vmap(partial(products_of, places, fixed.terms, jnp.asarray(machine.system.P[0])))

    def made(z: jax.Array, now: tuple[ProbedLoads, Slots]) -> tuple[jax.Array, tuple[jax.Array, ...]]:
        every = make(z, now)
        return every[0], every

    def again(z: jax.Array, now: tuple[tuple[ProbedLoads, Slots], _Known]) -> tuple[jax.Array, jax.Array]:
        z, *_ = step(f, a, fixed, z, *now)
        return z, z

    def block(z: jax.Array, own: tuple[ProbedLoads, Slots]) -> tuple[jax.Array, jax.Array]:
        begin = lax.stop_gradient(z)
        _, (after, first, factor) = lax.scan(made, begin, lax.stop_gradient(own))
        before = jnp.concatenate([begin[None], after[:-1]])
        bases = before, before + share * (first - before)
        solutions = products(own[0].contacts, first), products(own[0].contacts, after)
        known = _Known(factor, solutions, tuple(jax.vmap(lambda x: of_E @ x)(x) for x in bases))
        return lax.scan(again, z, (own, known))

    _, states = lax.scan(block, z, jax.tree.map(blocks, now))
    return states.reshape(-1, r)[:n]


def _turned(
    layout: Layout, places: ContactPlaces, many: bool, still: bool, machine: PortsFirst, effects: Effects,
    loads: ProbedLoads, slots: Slots, start: Array, v: Array,
) -> jax.Array:  # fmt: skip
    """What `trajectory` returns, in the coordinates of the ports."""
    n = effects.source.shape[1]
    v = jnp.asarray(v)
    u, a = v[:n], v[n:]
    f = factors_at(effects, u)
    T = machine.ports.T
    z0 = jnp.asarray(start) + a @ jnp.asarray(slots.initial)
    films = layout.n_films
    joints = jnp.asarray(loads.theta)[0, films:] * f.joint - jnp.asarray(machine.system.nominal)[films:]
    fixed = Operators.of(layout, many, joints if still else None, machine, effects, slots, f, a)
    loads = replace(loads, contact_heat=jnp.asarray(loads.contact_heat) @ T)
    unused = jnp.zeros(len(loads.rate))
    steps = replace(
        slots, A=unused, M=unused, E=unused, B=unused, reads=unused, initial=unused,
        forcing=jnp.asarray(slots.forcing) @ T,
    )  # fmt: skip
    begun = jnp.linalg.solve(T, z0)
    if fixed.terms.nbytes > IN_CACHE:
        states = _in_blocks(layout, places, still, machine, f, a, fixed, begun, (loads, steps))
    else:

        def one(z: jax.Array, now: tuple[ProbedLoads, Slots]) -> tuple[jax.Array, jax.Array]:
            z, *_ = _step(layout, places, still, machine, f, a, fixed, z, now)
            return z, z

        _, states = lax.scan(one, begun, (loads, steps))
    return jnp.concatenate([begun[None], states])


def trajectory(
    layout: Layout, places: ContactPlaces, many: bool, still: bool, machine: PortsFirst, effects: Effects,
    loads: ProbedLoads, slots: Slots, start: Array, v: Array,
) -> jax.Array:  # fmt: skip
    """States (n + 1, r) from start (r,); v: parameters u of the machine, then amplitudes a (K,) of all slots.

    still: joints conduct alike in all steps (`stands_still`), which takes their terms out of every step.
    """
    return _turned(layout, places, many, still, machine, effects, loads, slots, start, v) @ machine.ports.T.T


def stands_still(layout: Layout, loads: ProbedLoads, slots: Slots) -> bool:
    """Whether joints conduct in all steps of a run as in the first."""
    joints = np.asarray(loads.theta)[:, layout.n_films :]
    return bool(np.all(joints == joints[:1]) and not np.any(slots.joint))


def outputs_of(
    layout: Layout, places: ContactPlaces, many: bool, still: bool, from_first: bool, machine: PortsFirst,
    effects: Effects, loads: ProbedLoads, slots: Slots, rows: Rows, bins: tuple[Array, Array], start: Array, v: Array,
) -> jax.Array:  # fmt: skip
    """Means of sensors over bins (b s,) [degC], then TCP rows (k 3,) [m]."""
    states = _turned(layout, places, many, still, machine, effects, loads, slots, start, v)
    mean_of, column = bins
    T = jnp.asarray(mean_of) @ temperatures(machine.system, states)[:, column]
    # what reads them is turned, not the states with their derivatives
    turn = machine.ports.T
    rows = replace(rows, row=rows.row @ turn, member_row=rows.member_row @ turn)
    w = displacements(replace(effects, mean=effects.mean @ turn), rows, states, jnp.asarray(v))
    return jnp.concatenate([T.ravel(), (w - w[0] if from_first else w).ravel()])


outputs = partial(jax.jit, static_argnums=(0, 1, 2, 3, 4))(outputs_of)
states_of = partial(jax.jit, static_argnums=(0, 1, 2, 3))(trajectory)


@partial(jax.jit, static_argnums=(0, 1, 2, 3))
def jacobian(layout: Layout, places: ContactPlaces, still: bool, from_first: bool, *rest: object) -> jax.Array:
    """Derivatives (b s + k 3, n + K) of `outputs_of` by v."""
    return jax.jacfwd(partial(outputs_of, layout, places, True, still, from_first), argnums=len(rest) - 1)(*rest)


@partial(jax.jit, static_argnums=(0, 1, 2, 3))
def by_amplitudes(
    layout: Layout, places: ContactPlaces, still: bool, from_first: bool, machine: PortsFirst, effects: Effects,
    loads: ProbedLoads, slots: Slots, rows: Rows, bins: tuple[Array, Array], start: Array, u: Array, a: Array,
) -> tuple[jax.Array, jax.Array]:  # fmt: skip
    """Derivatives (b s + k 3, K) of `outputs_of` by the amplitudes alone, and the outputs."""

    def both(a: jax.Array) -> tuple[jax.Array, jax.Array]:
        v = jnp.concatenate([jnp.asarray(u), a])
        y = outputs_of(layout, places, False, still, from_first, machine, effects, loads, slots, rows, bins, start, v)
        return y, y

    return jax.jacfwd(both, has_aux=True)(jnp.asarray(a))

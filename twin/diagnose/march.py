"""The window model stepped through a run with hypotheses switched on: states and exact derivatives.

As `twin.calibrate.fit.march`, with three differences. Loads and moving contacts keep their own fine steps (60 s) inside
a coarse one (300 s) of films and joints: contacts held for 300 s put nuts and the TCP off by more than the noise. A
fine step is a two-stage SDIRK step (Alexander, SIAM J. Numer. Anal. 14, 1977: second order, L-stable, one matrix for
both stages), as implicit Euler of 60 s is a tenth of a kelvin off beside nuts and motors. And K slots hold what the
description lacks, each times an amplitude a_k that is differentiated like a parameter:

    (E + sum a_k E_k) x' = -(A(theta (1 + sum a_k film_k), joints, contacts) + sum a_k gate_k A_k) x
                           + (B + sum a_k B_k) P + ... + sum a_k (gate_k rise_k M_k + forcing_k),
    T_air + sum a_k environment_k
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import twin.run.jax_setup  # noqa: F401  isort: skip

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from twin.calibrate.fit.effects import Effects, Factors, contact_names, factors_at
from twin.calibrate.fit.march import Places, Rows
from twin.diagnose.ports_first import Basis, Factor, basis, factor, held, solved, turned, within
from twin.rom import law_values
from twin.rom.drive import Drive
from twin.rom.following import FilmPlan, difference_place, film_state, read_table, temperature_place
from twin.rom.model import MachineModel
from twin.run.stepping import inputs_of
from twin.run.system import Array, Layout, System

INNER = 5  # fine steps in a coarse one
GAMMA = 1.0 - 0.5**0.5  # SDIRK2


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Loads:
    """A run; n coarse steps of m fine ones."""

    rate: Array  # (n,) 1/s of the fine steps
    theta: Array  # (n, n_theta) W/(m^2 K): convection of films that read the log alone, then joints
    film_table: Array  # (n, k, 65) W/(m^2 K) over DIFFERENCES
    diagonal: Array  # (n, m, c, n_ports) W/K, as `twin.calibrate.fit.march.Loads`
    neighbour: Array  # (n, m, c, n_ports)
    weight: Array  # (n, m, n_pairs, n_segments)
    environment: Array  # (n, m, n_environments) degC
    power: Array  # (n, m, n_sources) W
    power_table: Array  # (n, m, l, 121) W over TEMPERATURES
    contact_heat: Array  # (n, m, s, r) W, projected


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Slots:
    """K hypotheses in window coordinates, as unit amplitudes."""

    A: Array  # (K, r, r) per W/(m^2 K)
    M: Array  # (K, r)
    E: Array  # (K, r, r)
    B: Array  # (K, r, n_sources) per W: where else the heat of sources goes
    reads: Array  # (K, l, r): how else laws of sources that follow a temperature read it
    gate: Array  # (n, K): of A and M
    rise: Array  # (n, m, K) K: medium of M above the reference temperature
    forcing: Array  # (n, m, K, r)
    film: Array  # (n, K, n_films): relative change of the convection of films
    joint: Array  # (n, K, n_joints)
    contact: Array  # (n, K, n_contacts)
    environment: Array  # (n, m, K, n_environments) K
    initial: Array  # (K, r)


def no_slots(n: int, m: int, K: int, r: int, model: MachineModel) -> Slots:
    """Slots that do nothing, as numpy arrays to be filled."""
    load = model.load_model
    following = sum(bool(law_values.states_of(source.use)) for source in load.sources)
    return Slots(
        A=np.zeros((K, r, r)), M=np.zeros((K, r)), E=np.zeros((K, r, r)),
        B=np.zeros((K, r, len(load.sources))), reads=np.zeros((K, following, r)), gate=np.zeros((n, K)),
        rise=np.zeros((n, m, K)), forcing=np.zeros((n, m, K, r)), film=np.zeros((n, K, len(load.films))),
        joint=np.zeros((n, K, len(load.joints))), contact=np.zeros((n, K, len(contact_names(model)))),
        environment=np.zeros((n, m, K, len(load.environments))), initial=np.zeros((K, r)),
    )  # fmt: skip


def first_slots(slots: Slots, k: int) -> Slots:
    """The first k of them."""
    return Slots(
        A=slots.A[:k], M=slots.M[:k], E=slots.E[:k], B=slots.B[:k], reads=slots.reads[:k], gate=slots.gate[:, :k],
        rise=slots.rise[:, :, :k], forcing=slots.forcing[:, :, :k], film=slots.film[:, :k], joint=slots.joint[:, :k],
        contact=slots.contact[:, :k], environment=slots.environment[:, :, :k], initial=slots.initial[:k],
    )  # fmt: skip


def loads_for(model: MachineModel, drive: Drive, m: int = INNER) -> Loads:
    """The loads of a run, from a drive of fine steps whose number is a multiple of m, for a model of one body."""
    (body,) = model.bodies
    names, pairs = contact_names(model), model.load_model.pairs
    n = drive.n_steps // m

    def mean(values: np.ndarray) -> np.ndarray:
        return values.reshape(n, m, *values.shape[1:]).mean(axis=1)

    def inner(values: np.ndarray) -> np.ndarray:
        return values.reshape(n, m, *values.shape[1:])

    own = []
    for name in names:
        mask = np.array([p.contact == name for p in pairs])
        own.append(inputs_of(model.load_model, replace(drive, conductance=drive.conductance * mask), 1))
    inputs = inputs_of(model.load_model, drive, 1)
    none = np.zeros((n, m, 0, len(model.load_model.ports)))
    return Loads(
        rate=np.full(n, 1.0 / (drive.time[1] - drive.time[0])),
        theta=mean(drive.theta),
        film_table=mean(drive.films.value),
        diagonal=np.stack([inner(np.asarray(i.contact_diagonal)) for i in own], axis=2) if own else none,
        neighbour=np.stack([inner(np.asarray(i.contact_neighbour)) for i in own], axis=2) if own else none,
        weight=inner(np.asarray(inputs.contact_weight)),
        environment=inner(drive.environment),
        power=inner(drive.power),
        power_table=inner(drive.losses.value),
        contact_heat=inner(drive.contact_heat @ body.P.T),
    )


def flows(places: Places, diagonal: Array, neighbour: Array, weight: Array, contact: Array, y: jax.Array) -> jax.Array:
    """Gamma y (n_ports, k) W at port temperatures y (n_ports, k), of one fine step with the contacts scaled by contact
    (c,); diagonal and neighbour (c, n_ports), weight (n_pairs, n_segments), as in `Loads`."""
    contact = jnp.asarray(contact)
    beside = (contact @ jnp.asarray(neighbour))[:-1, None]
    pad, segment, c, k, s = _touching(places)
    w = -(contact[c] * jnp.asarray(weight)[k, s])[:, None]
    result = (contact @ jnp.asarray(diagonal))[:, None] * y
    result = result.at[:-1].add(beside * y[1:]).at[1:].add(beside * y[:-1])
    return result.at[np.concatenate([pad, segment])].add(jnp.concatenate([w * y[segment], w * y[pad]]))


def gamma(places: Places, diagonal: Array, neighbour: Array, weight: Array, contact: Array) -> jax.Array:
    """Gamma (n_ports, n_ports) W/K, as `flows`."""
    contact = jnp.asarray(contact)
    ports = np.arange(np.shape(diagonal)[1])
    pad, segment, c, k, s = _touching(places)
    beside = (contact @ jnp.asarray(neighbour))[:-1]
    w = -contact[c] * jnp.asarray(weight)[k, s]
    row = np.concatenate([ports, ports[:-1], ports[1:], pad, segment])
    column = np.concatenate([ports, ports[1:], ports[:-1], segment, pad])
    values = jnp.concatenate([contact @ jnp.asarray(diagonal), beside, beside, w, w])
    return jnp.zeros((len(ports), len(ports))).at[row, column].add(values)


def _touching(places: Places) -> np.ndarray:
    """(5, n): pad and segment (ports), contact, pair and number of the segment in it, of all that may touch."""
    pairs = [(p, first + s, c, k, s)
             for k, (c, p, first, n) in enumerate(
                 zip(places.contact_of_pair, places.pad, places.first, places.count, strict=True))
             for s in range(n)]  # fmt: skip
    return np.array(pairs, dtype=int).reshape(-1, 5).T


def gammas(places: Places, loads: Loads, contact: np.ndarray, n_ports: int) -> np.ndarray:
    """Gamma (n m, n_ports, n_ports) W/K of all fine steps of a run."""
    steps = int(np.prod(np.asarray(loads.diagonal).shape[:2]))
    if not n_ports:
        return np.zeros((steps, 0, 0))
    many = jax.jit(jax.vmap(partial(gamma, places), (0, 0, 0, None)))
    flat = [np.asarray(v).reshape(steps, *v.shape[2:]) for v in (loads.diagonal, loads.neighbour, loads.weight)]
    return np.asarray(many(*flat, contact))


@partial(jax.custom_jvp, nondiff_argnums=(0, 1))
def _solved(
    places: Places, many: bool, known_factor: Factor, c: jax.Array, terms: jax.Array, contact: jax.Array,
    segments: tuple[Array, Array, Array], P: jax.Array, known: jax.Array,
) -> jax.Array:  # fmt: skip
    """S^-1 known, by the factor of S = c + P Gamma P^T (many: c . terms in c's place).

    Derivatives come with c, contact and known; the factor's are not looked at.

    Few derivatives: a matrix dc for each, made once. Many: the products of terms with the solution, which they share.
    The other way about, either takes several times as long.
    """
    return solved(known_factor, known)


@_solved.defjvp
def _solved_jvp(places: Places, many: bool, at: tuple, d: tuple) -> tuple[jax.Array, jax.Array]:
    known_factor, _, terms, _, segments, P, known = at
    _, dc, _, dcontact, _, _, dknown = d
    x = solved(known_factor, known)
    dS = dc @ (terms @ x) if many else dc @ x
    diagonal, neighbour, weight = segments
    dS = dS + P @ flows(places, diagonal, neighbour, weight, dcontact, (P.T @ x)[:, None])[:, 0]
    return x, solved(known_factor, dknown - dS)


@dataclass(frozen=True)
class Operators:
    """What stays during a trajectory, in the coordinates of `twin.diagnose.ports_first`."""

    A: jax.Array  # (p, r, r): terms of films and joints, then of slots
    terms: jax.Array  # (q, r, r): of E: of the model's capacities, then of slots
    factors: jax.Array  # (q,) of these
    E: jax.Array  # (r, r), many: its derivatives left out
    ports: Basis
    B: jax.Array  # (r, n_sources)
    reads: jax.Array  # (l, r): temperatures that sources follow
    M: jax.Array  # (K, r) of slots

    @classmethod
    def of(
        cls, system: System, effects: Effects, slots: Slots, f: Factors, a: jax.Array, ports: Basis, many: bool
    ) -> Operators:
        """At factors f and amplitudes a; system: turned."""
        T = ports.T
        A = jnp.concatenate([jnp.asarray(system.A[0]), within(T, slots.A)])
        terms = within(T, jnp.concatenate([jnp.asarray(effects.E), jnp.asarray(slots.E)]))
        factors = jnp.concatenate([f.capacity - 1.0, a])
        E = T.T @ T + jnp.tensordot(lax.stop_gradient(factors) if many else factors, terms, 1)
        B = jnp.asarray(system.B) + jnp.tensordot(a, T.T @ jnp.asarray(slots.B), 1)
        reads = jnp.asarray(system.source_rows) + jnp.tensordot(a, jnp.asarray(slots.reads) @ T, 1)
        return cls(A, terms, factors, E, ports, B, reads, jnp.asarray(slots.M) @ T)


def _step(
    layout: Layout, places: Places, many: bool, system: System, effects: Effects, f: Factors, a: jax.Array,
    fixed: Operators, z: jax.Array, now: tuple[Loads, Slots],
) -> tuple[jax.Array, jax.Array]:  # fmt: skip
    """The state after one coarse step, and those after its fine ones (m, r)."""
    loads, slots = now
    n, T_ref = layout.n_films, system.reference_temperature
    following, losing = np.array(layout.following_films, dtype=int), np.array(layout.following_losses, dtype=int)
    environment = jnp.asarray(loads.environment) + f.environment + jnp.einsum("k,mke->me", a, slots.environment)
    film_factor = f.film * jnp.maximum(1.0 + a @ jnp.asarray(slots.film), 0.02)
    # films follow the state and the mean air at the step's start
    plan = FilmPlan(
        system.film_environment, system.film_radiant, system.film_emissivity, system.film_gradient, system.film_height
    )
    area = jnp.where(system.film_area > 0.0, system.film_area, 1.0)
    surface = T_ref + (system.film_rows @ z) / area
    convection = jnp.asarray(loads.theta)[:n]
    if len(following):
        air = plan.air(environment.mean(axis=0), system.film_moment / area)[following]
        read = read_table(jnp, jnp.asarray(loads.film_table), difference_place(jnp, surface[following] - air))
        convection = convection.at[following].set(read)
    convection = convection * film_factor

    def read_films(air: jax.Array) -> tuple[jax.Array, jax.Array, jax.Array]:
        state = film_state(jnp, plan, convection, surface, air, jnp.array(1.0))
        return state.total, state.outer, state.lift

    totals, outer, lift = jax.vmap(read_films)(environment)
    total = totals.mean(axis=0)
    joint_factor = f.joint * jnp.maximum(1.0 + a @ jnp.asarray(slots.joint), 0.02)
    joints = jnp.asarray(loads.theta)[n:] * joint_factor
    contact = f.contact * jnp.maximum(1.0 + a @ jnp.asarray(slots.contact), 0.02)
    P, rate = jnp.asarray(system.P[0]), jnp.asarray(loads.rate) / GAMMA
    gate = a * jnp.asarray(slots.gate)
    coefficients = jnp.concatenate([jnp.concatenate([total, joints]) - jnp.asarray(system.nominal), gate])
    valued = lax.stop_gradient(coefficients) if many else coefficients
    matrix = rate * fixed.E + jnp.asarray(system.A0[0]) + jnp.tensordot(valued, fixed.A, 1)
    if many:
        c, terms = jnp.concatenate([coefficients, rate * fixed.factors]), jnp.concatenate([fixed.A, fixed.terms])
    else:
        c, terms = matrix, jnp.zeros(())
    kept = held(lax.stop_gradient(matrix), P.shape[1])

    def capacity(x: jax.Array) -> jax.Array:
        if not many:
            return rate * (fixed.E @ x)
        change = fixed.factors - lax.stop_gradient(fixed.factors)
        return rate * (fixed.E @ x + change @ (fixed.terms @ lax.stop_gradient(x)))

    tables = jnp.asarray(loads.power_table) * f.source[losing][:, None]
    winding = T_ref + fixed.reads @ z

    def fine(x: jax.Array, i: jax.Array) -> tuple[jax.Array, jax.Array]:
        power = jnp.asarray(loads.power)[i] * f.source
        if len(losing):
            power = power.at[losing].set(read_table(jnp, tables[i], temperature_place(jnp, winding)))
        ports = jnp.tensordot(f.source[np.array(places.sources, dtype=int)], jnp.asarray(loads.contact_heat)[i], 1)
        forcing = system.M @ (total * (outer[i] - T_ref)) + system.H @ lift[i] + fixed.B @ power + ports
        forcing = forcing + (gate * jnp.asarray(slots.rise)[i]) @ fixed.M + a @ jnp.asarray(slots.forcing)[i]
        diagonal, neighbour, weight = (jnp.asarray(v)[i] for v in (loads.diagonal, loads.neighbour, loads.weight))
        touching = gamma(places, diagonal, neighbour, weight, lax.stop_gradient(contact))
        now = factor(kept, fixed.ports.across(touching))
        solve = partial(_solved, places, many, now, c, terms, contact, (diagonal, neighbour, weight), P)
        middle = solve(capacity(x) + forcing)
        after = solve(capacity(x + (1.0 - GAMMA) / GAMMA * (middle - x)) + forcing)
        return after, after

    m = loads.environment.shape[0]
    return lax.scan(fine, z, jnp.arange(m))


def trajectory(
    layout: Layout, places: Places, many: bool, system: System, effects: Effects, loads: Loads, slots: Slots,
    start: Array, v: Array,
) -> jax.Array:  # fmt: skip
    """States (n m + 1, r) at the fine steps from start (r,); v: parameters u of the machine, then amplitudes a (K,)."""
    n = effects.source.shape[1]
    v = jnp.asarray(v)
    u, a = v[:n], v[n:]
    f = factors_at(effects, u)
    ports = basis(system.P[0])
    T = ports.T
    z0 = jnp.asarray(start) + a @ jnp.asarray(slots.initial)
    system = turned(system, T)
    fixed = Operators.of(system, effects, slots, f, a, ports, many)
    loads = replace(loads, contact_heat=jnp.asarray(loads.contact_heat) @ T)
    unused = jnp.zeros(len(loads.rate))
    steps = replace(
        slots, A=unused, M=unused, E=unused, B=unused, reads=unused, initial=unused,
        forcing=jnp.asarray(slots.forcing) @ T,
    )  # fmt: skip
    one = partial(_step, layout, places, many, system, effects, f, a, fixed)
    _, states = lax.scan(one, jnp.linalg.solve(T, z0), (loads, steps))
    return jnp.concatenate([z0[None], states.reshape(-1, z0.shape[0]) @ T.T])


def outputs_of(
    layout: Layout, places: Places, many: bool, from_first: bool, system: System, effects: Effects, loads: Loads,
    slots: Slots, rows: Rows, bins: tuple[Array, Array], start: Array, v: Array,
) -> jax.Array:  # fmt: skip
    """Means of sensors over bins (b s,) [degC], then TCP rows (k 3,) [m]."""
    from twin.calibrate.fit.march import displacements, temperatures

    states = trajectory(layout, places, many, system, effects, loads, slots, start, v)
    mean_of, column = bins
    T = jnp.asarray(mean_of) @ temperatures(system, states)[:, column]
    w = displacements(effects, rows, states, jnp.asarray(v))
    return jnp.concatenate([T.ravel(), (w - w[0] if from_first else w).ravel()])


outputs = partial(jax.jit, static_argnums=(0, 1, 2, 3))(outputs_of)
states_of = partial(jax.jit, static_argnums=(0, 1, 2))(trajectory)


@partial(jax.jit, static_argnums=(0, 1, 2))
def jacobian(layout: Layout, places: Places, from_first: bool, *rest: object) -> jax.Array:
    """Derivatives (b s + k 3, n + K) of `outputs_of` by v."""
    return jax.jacfwd(partial(outputs_of, layout, places, True, from_first), argnums=len(rest) - 1)(*rest)


@partial(jax.jit, static_argnums=(0, 1, 2))
def by_amplitudes(
    layout: Layout, places: Places, from_first: bool, system: System, effects: Effects, loads: Loads, slots: Slots,
    rows: Rows, bins: tuple[Array, Array], start: Array, u: Array, a: Array,
) -> tuple[jax.Array, jax.Array]:  # fmt: skip
    """Derivatives (b s + k 3, K) of `outputs_of` by the amplitudes alone, and the outputs."""

    def both(a: jax.Array) -> tuple[jax.Array, jax.Array]:
        v = jnp.concatenate([jnp.asarray(u), a])
        y = outputs_of(layout, places, False, from_first, system, effects, loads, slots, rows, bins, start, v)
        return y, y

    return jax.jacfwd(both, has_aux=True)(jnp.asarray(a))

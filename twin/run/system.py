"""A reduced machine prepared for stepping: coordinates with E = 1 and contacts by body.

A change of coordinates z = L^T x with E = L L^T (Cholesky) makes the capacity matrix the identity, so that a step needs
no product with it and the row that reads off the stored heat is also the test vector of the heat balance:
1^T E = energy^T. Oblique bodies are multiplied by E^-1 from the left instead. Outputs do not change.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import twin.run.jax_setup  # noqa: F401  isort: skip

import jax
import numpy as np

from twin.rom.contact_matrix import ContactEntries
from twin.rom.following import FilmPlan
from twin.rom.law_values import states_of
from twin.rom.model import AffineBody, MachineModel
from twin.run.block_factor import Elimination, plan

Array = jax.Array | np.ndarray

jax.tree_util.register_dataclass(ContactEntries)


@dataclass(frozen=True)
class Coupling:
    """Pairs whose rail and pad are on the same two bodies."""

    rail_body: int
    pad_body: int
    pairs: tuple[int, ...]  # index in LoadModel.pairs
    rail_first: tuple[int, ...]  # per pair: first local port of its rail on the rail body
    rail_count: tuple[int, ...]  # per pair: segments of its rail
    pad_ports: tuple[int, ...]  # per pair: local port on the pad body


@dataclass(frozen=True)
class Layout:
    """What the compiled step is specialised on: sizes and places, no numbers. Hashable."""

    symmetric: bool
    sizes: tuple[int, ...]  # states per body
    ports: tuple[tuple[int, ...], ...]  # per body: its ports (global index), increasing
    terms: tuple[tuple[int, ...], ...]  # per body: index into theta of its affine terms
    couplings: tuple[Coupling, ...]
    elimination: Elimination  # of the coupled matrix, body by body
    n_films: int
    following_films: tuple[int, ...]  # films tabulated over their surface temperature
    following_losses: tuple[int, ...]  # sources tabulated over theirs

    @property
    def offsets(self) -> tuple[int, ...]:
        """First state of each body, and the number of all states."""
        return (0, *np.cumsum(self.sizes).tolist())


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class System:
    """Numbers of a machine in coordinates with E = 1; N states of all bodies one after the other."""

    A0: tuple[Array, ...]  # per body (n, n) 1/s, joints at their nominal conductances included
    nominal: Array  # (n_theta,) W/(m^2 K): what A0 includes; zero for films
    A: tuple[Array, ...]  # per body (n_terms, n, n)
    P: tuple[Array, ...]  # per body (n, n_ports): port heat in
    port_rows: tuple[Array, ...]  # per body (n_ports, n): port temperatures out
    M: Array  # (N, n_films): heat of 1 K of outer temperature
    H: Array  # (N, (1 + a) n_films): heat of 1 K/m of gradient, axes at zero; then by the metre of each axis
    B: Array  # (N, n_sources)
    source_rows: Array  # (n_following_losses, N): mean temperature of their surfaces
    film_environment: Array  # (n_films,) int
    film_radiant: Array  # (n_films,) int
    film_emissivity: Array  # (n_films,)
    film_gradient: Array  # (n_films,) K/m
    film_height: Array  # (n_films,) m
    film_area: Array  # (n_films,) m^2
    film_moment: Array  # (1 + a, n_films) m^3, axes at zero; then m^2, by the metre of each axis
    film_rows: Array  # (n_films, N) m^2: film_rows @ z = area times mean surface temperature rise
    energy: Array  # (N,) stored heat [J] = energy @ z
    C: Array  # (n_sensors, N)
    G: Array  # (n_poses * 3, N)
    one: Array  # (N,) the field that is 1 K everywhere
    reference_temperature: Array  # () degC

    @property
    def film_plan(self) -> FilmPlan:
        """The films as `twin.rom.step_loads` reads them."""
        return FilmPlan(
            environment=self.film_environment,
            radiant=self.film_radiant,
            emissivity=self.film_emissivity,
            gradient=self.film_gradient,
            height=self.film_height,
            mean_height=self.film_moment[0] / self.safe_area,
            climb=self.film_moment[1:] / self.safe_area,
        )

    @property
    def safe_area(self) -> Array:
        """film_area, 1 m^2 for films of no surface."""
        xp = np if isinstance(self.film_area, np.ndarray) else jax.numpy
        return xp.where(self.film_area > 0.0, self.film_area, 1.0)

    def surfaces(self, z: Array) -> Array:
        """Mean temperatures (n_films,) [degC] of the films' surfaces at state z (N,)."""
        return self.reference_temperature + (self.film_rows @ z) / self.safe_area


def _normalised(body: AffineBody) -> tuple[AffineBody, np.ndarray]:
    """The body in coordinates z with E = 1, and X with x = X z."""
    if body.symmetric:
        L = np.linalg.cholesky(body.E)
        X = np.linalg.inv(L).T
        left = X.T
    else:
        X = np.eye(body.n)
        left = np.linalg.inv(body.E)
    return (
        AffineBody(
            name=body.name,
            E=np.eye(body.n),
            A0=left @ body.A0 @ X,
            A=tuple(left @ a @ X for a in body.A),
            theta=body.theta,
            M=left @ body.M,
            B=left @ body.B,
            sources=body.sources,
            P=left @ body.P,
            ports=body.ports,
            C=body.C @ X,
            sensors=body.sensors,
            G=body.G @ X,
            one=np.linalg.solve(X, body.one),
            energy=X.T @ body.energy,
            P_out=None if body.symmetric else X.T @ body.port_rows.T,
            B_out=None if body.symmetric else X.T @ body.source_rows.T,
            H=None if body.H is None else left @ body.H,
            raised=None if body.raised is None else left @ body.raised,
        ),
        X,
    )


def _couplings(model: MachineModel, ports: tuple[tuple[int, ...], ...]) -> tuple[Coupling, ...]:
    load = model.load_model
    owner = {port: b for b, of_body in enumerate(ports) for port in of_body}
    groups: dict[tuple[int, int], list[int]] = {}
    for k, pair in enumerate(load.pairs):
        groups.setdefault((owner[load.rails[pair.rail].first_port], owner[pair.pad_port]), []).append(k)
    couplings = []
    for (r, p), pairs in groups.items():
        rails = [load.rails[load.pairs[k].rail] for k in pairs]
        first = tuple(ports[r].index(rail.first_port) for rail in rails)
        count = tuple(len(rail.stations) for rail in rails)
        pads = tuple(ports[p].index(load.pairs[k].pad_port) for k in pairs)
        couplings.append(Coupling(r, p, tuple(pairs), first, count, pads))
    return tuple(couplings)


@dataclass(frozen=True)
class Prepared:
    """A machine ready to be stepped."""

    layout: Layout
    system: System  # on the device
    back: tuple[np.ndarray, ...]  # per body X (n, n): artefact coordinates x = X z
    heat_capacity: float  # J/K of the whole machine

    def to_artefact(self, z: np.ndarray) -> np.ndarray:
        """States (..., N) in the coordinates of the artefact, bodies one after the other."""
        parts = np.split(z, self.layout.offsets[1:-1], axis=-1)
        return np.concatenate([part @ X.T for part, X in zip(parts, self.back, strict=True)], axis=-1)

    def from_artefact(self, x: np.ndarray) -> np.ndarray:
        """The inverse of `to_artefact` for one state (N,)."""
        parts = np.split(x, self.layout.offsets[1:-1])
        return np.concatenate([np.linalg.solve(X, part) for part, X in zip(parts, self.back, strict=True)])

    def uniform(self, temperature: float) -> np.ndarray:
        """The state (N,) of a machine at one temperature [degC]."""
        return (temperature - float(self.system.reference_temperature)) * np.asarray(self.system.one)


def prepare(model: MachineModel) -> Prepared:
    """Change a dense machine to coordinates with E = 1 and put it on the device."""
    bodies, back = zip(*(_normalised(b) for b in model.bodies), strict=True)
    load = model.load_model
    order = [np.argsort(b.ports, kind="stable") for b in bodies]
    layout = _layout(model, bodies, order)
    N, n_films, offsets = model.n, len(load.films), layout.offsets
    B, source_rows = np.zeros((N, len(load.sources))), np.zeros((len(load.sources), N))
    C, G = np.zeros((len(model.sensors), N)), np.zeros((3 * len(model.poses), N))
    for b, body in enumerate(bodies):
        rows = slice(offsets[b], offsets[b + 1])
        B[rows, list(body.sources)] = body.B
        source_rows[list(body.sources), rows] = body.source_rows
        C[list(body.sensors), rows] = body.C
        G[:, rows] = body.G.reshape(-1, body.n)
    M, H, film_rows, film_area, film_moment = _film_matrices(bodies, layout, len(load.axes))
    films = FilmPlan.of(load, np.zeros((1, n_films)), np.ones(n_films))
    nominal = np.array([0.0] * n_films + [j.conductance for j in load.joints])
    system = System(
        A0=tuple(b.A0 + np.tensordot(nominal[list(b.theta)], np.array(b.A).reshape(-1, b.n, b.n), 1) for b in bodies),
        nominal=nominal,
        A=tuple(np.array(b.A).reshape(-1, b.n, b.n) for b in bodies),
        P=tuple(b.P[:, o] for b, o in zip(bodies, order, strict=True)),
        port_rows=tuple(b.port_rows[o] for b, o in zip(bodies, order, strict=True)),
        M=M,
        H=H,
        B=B,
        source_rows=source_rows[list(layout.following_losses)],
        film_environment=films.environment,
        film_radiant=films.radiant,
        film_emissivity=films.emissivity,
        film_gradient=films.gradient,
        film_height=films.height,
        film_area=film_area,
        film_moment=film_moment,
        film_rows=film_rows,
        energy=np.concatenate([b.energy for b in bodies]),
        C=C,
        G=G,
        one=np.concatenate([b.one for b in bodies]),
        reference_temperature=np.array(model.reference_temperature),
    )
    capacity = float(np.asarray(system.energy) @ np.asarray(system.one))
    return Prepared(layout, jax.device_put(system), back, capacity)


def _layout(model: MachineModel, bodies: Sequence[AffineBody], order: Sequence[np.ndarray]) -> Layout:
    """order: per body the places of its ports, increasing."""
    load = model.load_model
    ports = tuple(tuple(int(b.ports[i]) for i in o) for b, o in zip(bodies, order, strict=True))
    couplings = _couplings(model, ports)
    return Layout(
        symmetric=all(b.symmetric for b in bodies),
        sizes=tuple(b.n for b in bodies),
        ports=ports,
        terms=tuple(tuple(int(k) for k in b.theta) for b in bodies),
        couplings=couplings,
        elimination=plan(len(bodies), {(c.rail_body, c.pad_body) for c in couplings}),
        n_films=len(load.films),
        following_films=tuple(k for k, f in enumerate(load.films) if states_of(f.use)),
        following_losses=tuple(k for k, s in enumerate(load.sources) if states_of(s.use)),
    )


def _film_matrices(bodies: Sequence[AffineBody], layout: Layout, n_axes: int) -> tuple[np.ndarray, ...]:
    """M, H, film_rows, film_area and film_moment of all bodies, as in `System`."""
    N, n, offsets = layout.offsets[-1], layout.n_films, layout.offsets
    axes = n_axes if any(body.raised is not None for body in bodies) else 0
    M, H, film_rows = np.zeros((N, n)), np.zeros((N, 1 + axes, n)), np.zeros((n, N))
    film_area, film_moment = np.zeros(n), np.zeros((1 + axes, n))
    for b, body in enumerate(bodies):
        rows = slice(offsets[b], offsets[b + 1])
        for column, k in enumerate(body.theta):
            if k >= n:
                continue
            M[rows, k] = body.M[:, column]
            if body.H is not None:
                H[rows, 0, k] = body.H[:, column]
                film_moment[0, k] += body.energy @ body.H[:, column]
            if body.raised is not None:
                H[rows, 1:, k] = body.raised[:, :, column].T
                film_moment[1:, k] += body.raised[:, :, column] @ body.energy
            film_rows[k, rows] = body.energy @ body.A[column]
            film_area[k] += body.energy @ body.M[:, column]
    return M, H.reshape(N, -1), film_rows, film_area, film_moment

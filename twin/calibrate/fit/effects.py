"""What parameters do to a reduced model, as arrays: the bridge from dotted paths to the differentiable step.

All parameters of a fit are one vector u: ln(value / nominal) of log parameters, value - nominal of linear ones. Factors
and shifts are products of u with constant matrices, so they are traced by JAX and shared by fits, batches and
sensitivities.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import twin.run.jax_setup  # noqa: F401  isort: skip

import jax
import jax.numpy as jnp
import numpy as np

from twin.errors import TwinError
from twin.rom.apply import member_field, member_mean
from twin.rom.model import AffineBody, MachineModel
from twin.rom.parameter import Parameter
from twin.run.system import Array


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Effects:
    """n parameters of the machine and i of the initial state on a model of one body with r states."""

    source: Array  # (n_sources, n) exponents
    film: Array  # (n_films, n)
    joint: Array  # (n_joints, n)
    contact: Array  # (n_contacts, n)
    environment: Array  # (n_environments, n) K per K
    exponent: Array  # (n_films, n) of the rise of a surface above its air; what a diagnosis alone varies
    wind: Array  # (n_films, n) of ln c, c forced over free convection at the top speed; a diagnosis alone varies it
    wind_exponent: Array  # (n_films, n) of the exponent of the speed in forced convection; a diagnosis alone varies it
    E: Array  # (n_c, r, r) J/K: shares in E of the members that capacities act on
    capacity: Array  # (n_c, n)
    G: Array  # (n_e, n_poses * 3, r) m/K: shares in G of the members that expansions act on
    expansion: Array  # (n_e, n)
    mean: Array  # (n_m, r): mean temperatures of the members that single components act on
    component: Array  # (3, n_m, n) m/K per m/K
    initial: Array  # (i, r): fields that are 1 K in one member


@dataclass(frozen=True)
class Start:
    """A correction of the initial temperature of a member in one run; K from the given start."""

    run: int
    member: str
    sigma: float  # K
    bound: float  # K

    def path(self, run_name: str) -> str:
        """Its name in reports: it belongs to a run, not to the machine."""
        return f"initial.{run_name}.{self.member}"


def effects_of(model: MachineModel, parameters: Sequence[Parameter], starts: Sequence[Start]) -> Effects:
    """The arrays for a model of one body (`twin.calibrate.fit.window`).

    Raises TwinError for parameters that the model does not have, such as capacities of an artefact without shares.
    """
    (body,) = model.bodies
    load, n = model.load_model, len(parameters)
    names = {
        "source": [s.name for s in load.sources],
        "film": [f.name for f in load.films],
        "joint": [j.name for j in load.joints],
        "contact": list(load.contacts),
        "environment": [e.name for e in load.environments],
        "exponent": [f.name for f in load.films],
        "wind": [f.name for f in load.films],
        "wind_exponent": [f.name for f in load.films],
        "capacity": list(body.members),
        "expansion": list(body.members),
    }
    acts = {kind: np.zeros((len(of_kind), n)) for kind, of_kind in names.items()}
    component = np.zeros((3, len(body.members), n))
    for k, p in enumerate(parameters):
        for target in p.targets:
            if target not in names[p.kind]:
                what = "the artefact has no shares of its parts" if not body.members else f"there is no '{target}'"
                raise TwinError(what, p.path, "build the artefact again with `twin build`")
            i = names[p.kind].index(target)
            if p.component >= 0:
                component[p.component, i, k] = 1.0
            else:
                acts[p.kind][i, k] = 1.0
    some = {kind: np.flatnonzero(acts[kind].any(axis=1)) for kind in ("capacity", "expansion")}
    single = np.flatnonzero(component.any(axis=(0, 2)))
    r = body.n
    return Effects(
        source=acts["source"],
        film=acts["film"],
        joint=acts["joint"],
        contact=acts["contact"],
        environment=acts["environment"],
        exponent=acts["exponent"],
        wind=acts["wind"],
        wind_exponent=acts["wind_exponent"],
        E=_shares(body.E_members, some["capacity"], (r, r)),
        capacity=acts["capacity"][some["capacity"]],
        G=_shares(body.G_members, some["expansion"], (len(model.poses), 3, r)).reshape(-1, 3 * len(model.poses), r),
        expansion=acts["expansion"][some["expansion"]],
        mean=np.array([member_mean(body, int(m)) for m in single]).reshape(-1, r),
        component=component[:, single],
        initial=np.array([initial_field(body, s.member) for s in starts]).reshape(-1, r),
    )


def initial_field(body: AffineBody, member: str) -> np.ndarray:
    """State (r,) in which one member is 1 K warm; the whole machine where the member is ""."""
    return member_field(body, body.members.index(member)) if member else body.one


def _shares(shares: np.ndarray | None, which: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    return np.zeros((0, *shape)) if shares is None or not len(which) else shares[which]


def factors(exponents: Array, u: Array) -> jax.Array:
    """exp(exponents @ u): the factors of sources, films, conductances, capacities or expansions."""
    return jnp.exp(jnp.asarray(exponents) @ u)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Factors:
    """Factors, and shifts of environments [K], at one u."""

    source: jax.Array
    film: jax.Array
    joint: jax.Array
    contact: jax.Array
    environment: jax.Array
    exponent: jax.Array
    wind: jax.Array
    wind_exponent: jax.Array
    capacity: jax.Array


def factors_at(effects: Effects, u: jax.Array) -> Factors:
    """What parameters u (n,) make of a model."""
    return Factors(
        factors(effects.source, u),
        factors(effects.film, u),
        factors(effects.joint, u),
        factors(effects.contact, u),
        jnp.asarray(effects.environment) @ u,
        jnp.asarray(effects.exponent) @ u,
        jnp.asarray(effects.wind) @ u,
        jnp.asarray(effects.wind_exponent) @ u,
        factors(effects.capacity, u),
    )

"""What a run does to the probed model, step by step."""

from __future__ import annotations

from dataclasses import dataclass

import twin.run.jax_setup  # noqa: F401  isort: skip

import jax
import jax.numpy as jnp
import numpy as np

from twin.rom.contact_matrix import ContactEntries, ContactPlaces, dense, entries_by_contact, scaled
from twin.rom.drive import Drive
from twin.rom.model import MachineModel
from twin.run.system import Array


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class ProbedLoads:
    """A run of n steps."""

    rate: Array  # (n,) 1/s
    theta: Array  # (n, n_theta) W/(m^2 K): convection of films that read the log alone, then joints
    film_table: Array  # (n, k, 65) W/(m^2 K) over DIFFERENCES
    contacts: ContactEntries  # each contact on its own
    environment: Array  # (n, n_environments) degC
    position: Array  # (n, axes) m, means
    power: Array  # (n, n_sources) W
    power_table: Array  # (n, l, 121) W over TEMPERATURES
    contact_heat: Array  # (n, s, r) W, projected
    usual: Array  # (n, n_films) K: the rise at which films of another exponent have the described coefficient
    wind: Array  # (n, n_films) d ln h / dw, of the relative speed that films' laws read
    wind_exponent: Array  # (n, n_films) d ln h / dm


def loads_for(model: MachineModel, drive: Drive) -> ProbedLoads:
    """The loads of a run, for a model of one body."""
    (body,) = model.bodies
    return ProbedLoads(
        rate=np.full(drive.n_steps, 1.0 / (drive.time[1] - drive.time[0])),
        theta=drive.theta,
        film_table=drive.films.value,
        contacts=entries_by_contact(model.load_model, drive),
        environment=drive.environment,
        position=drive.mean_position,
        power=drive.power,
        power_table=drive.losses.value,
        contact_heat=drive.contact_heat @ body.P.T,
        usual=np.ones((drive.n_steps, len(model.load_model.films))),
        wind=np.zeros((drive.n_steps, len(model.load_model.films))),
        wind_exponent=np.zeros((drive.n_steps, len(model.load_model.films))),
    )


def gammas(places: ContactPlaces, loads: ProbedLoads, contact: np.ndarray) -> np.ndarray:
    """Gamma (n, n_ports, n_ports) W/K of all steps of a run, with the contacts scaled by contact (c,)."""
    if not places.n_ports:
        return np.zeros((len(loads.rate), 0, 0))
    return np.asarray(
        jax.jit(jax.vmap(lambda one: dense(jnp, places, scaled(jnp, places, one, contact))))(loads.contacts)
    )


def convection(drive: Drive, films: int) -> np.ndarray:
    """(n_steps, films) W/(m^2 K) of a drive, at a rise of a few kelvin where it follows the surface."""
    result = np.array(drive.theta[:, :films])
    middle = drive.films.value.shape[2] // 2 + 15
    result[:, list(drive.films.index)] = drive.films.value[:, :, middle]
    return result

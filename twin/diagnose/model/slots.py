"""What the description lacks, in K slots that the probed model integrates: each times an amplitude."""

from __future__ import annotations

from dataclasses import dataclass

import twin.run.jax_setup  # noqa: F401  isort: skip

import jax
import numpy as np

from twin.rom import law_values
from twin.rom.model import MachineModel
from twin.run.system import Array


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
    rise: Array  # (n, K) K: medium of M above the reference temperature
    forcing: Array  # (n, K, r)
    film: Array  # (n, K, n_films): relative change of the convection of films
    joint: Array  # (n, K, n_joints)
    contact: Array  # (n, K, n_contacts)
    environment: Array  # (n, K, n_environments) K
    initial: Array  # (K, r)


def no_slots(n: int, K: int, r: int, model: MachineModel) -> Slots:
    """Slots that do nothing, as numpy arrays to be filled."""
    load = model.load_model
    following = sum(bool(law_values.states_of(source.use)) for source in load.sources)
    return Slots(
        A=np.zeros((K, r, r)), M=np.zeros((K, r)), E=np.zeros((K, r, r)),
        B=np.zeros((K, r, len(load.sources))), reads=np.zeros((K, following, r)), gate=np.zeros((n, K)),
        rise=np.zeros((n, K)), forcing=np.zeros((n, K, r)), film=np.zeros((n, K, len(load.films))),
        joint=np.zeros((n, K, len(load.joints))), contact=np.zeros((n, K, len(load.contacts))),
        environment=np.zeros((n, K, len(load.environments))), initial=np.zeros((K, r)),
    )  # fmt: skip


def first_slots(slots: Slots, k: int) -> Slots:
    """The first k of them."""
    return Slots(
        A=slots.A[:k], M=slots.M[:k], E=slots.E[:k], B=slots.B[:k], reads=slots.reads[:k], gate=slots.gate[:, :k],
        rise=slots.rise[:, :k], forcing=slots.forcing[:, :k], film=slots.film[:, :k], joint=slots.joint[:, :k],
        contact=slots.contact[:, :k], environment=slots.environment[:, :k], initial=slots.initial[:k],
    )  # fmt: skip

"""Where the parts of a machine begin that ran before a log does: from what its sensors read first.

A part with sensors is as warm as their median. One without is where as much heat would flow to it as leaves it, between
the parts that are known and the air,

    (K + w G^T G) o = b + w G^T d

with the heat flows K between members and b to the air, the parts with sensors G, their medians d, and w so large that
these are met. How far a part may be from there is known from the parts with sensors: each is told by all others (leave
one out; Stone, J. R. Stat. Soc. B 36, 1974). A sensor that reads otherwise than they say may be off, and where those of
one part differ it may be as far from their median.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from twin.calibrate.fit.window import merged
from twin.diagnose.model.probed_loads import convection, gammas, loads_for
from twin.rom.apply import member_field
from twin.rom.contact_matrix import ContactPlaces
from twin.rom.drive import Drive
from twin.rom.model import MachineModel

RADIATION = 5.7  # W/(m^2 K) of a black surface at 20 degC: 4 sigma T^3
MET = 1e4  # times the largest flow between members: readings are met to a ten-thousandth
INSIDE = 0.1  # of what a part without sensors may be off: by how much a sensor is not all of its part. A judgement
OFF = 1.5  # K that a sensor may be off by: a thermocouple of class 1 (IEC 60584-1)


@dataclass(frozen=True)
class FirstField:
    """K beside one temperature, per member of the model in the order of its bodies."""

    members: tuple[str, ...]
    offset: tuple[float, ...]
    spread: tuple[float, ...]  # standard deviations of what is not known


def _fields(model: MachineModel) -> np.ndarray:
    """(N, members) states in which one member is 1 K warm."""
    blocks = [np.stack([member_field(b, i) for i in range(len(b.members))], axis=1) for b in model.bodies]
    return np.asarray(scipy.linalg.block_diag(*blocks))


def first_field(model: MachineModel, drive: Drive, read: Mapping[str, float], temperature: float) -> FirstField:
    """Of a model whose sensors read so first [degC], beside a temperature [degC]."""
    members = tuple(m for body in model.bodies for m in body.members)
    K, b, C = _network(model, drive, temperature)
    every = np.array([read[name] - temperature for name in read])
    # the member that a sensor is on, and no share of others: in a basis of few states it has some of each, and parts
    # without a sensor would make up for what its own part differs by from place to place
    at = np.argmax(np.abs(C[[model.sensors.index(name) for name in read]]), axis=1)
    own = np.unique(at)
    d = np.array([np.median(every[at == m]) for m in own])
    within = np.array([np.sqrt(np.mean((every[at == m] - middle) ** 2)) for m, middle in zip(own, d, strict=True)])
    G, w = np.eye(len(members))[own], MET * float(np.diag(K).max())

    def told(of: np.ndarray) -> np.ndarray:
        """(members,) from those of `own` that `of` (own,) says."""
        A = K + w * G[of].T @ G[of] + 1e-12 * np.diag(K).max() * np.eye(len(K))
        return np.asarray(np.linalg.solve(A, b + w * G[of].T @ d[of]))

    offset = told(own >= 0)
    missed = np.array([d[i] - told(own != m)[m] for i, m in enumerate(own)])
    unsure = float(np.sqrt(np.mean(missed**2)))
    spread = np.full(len(members), unsure)
    spread[own] = np.maximum(np.maximum(INSIDE * unsure, within), np.minimum(np.abs(missed), OFF))
    return FirstField(members, tuple(offset.tolist()), tuple(spread.tolist()))


def _network(model: MachineModel, drive: Drive, temperature: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Heat flows [W/K] between members K (M, M) and b (M,) [W] from the air, in the first step of a drive; sensors by
    members C (s, M)."""
    small, load = merged(model, _fields(model)), model.load_model
    (body,) = small.bodies
    n = len(load.films)
    h = convection(drive, n)[0] + RADIATION * np.array([film.emissivity for film in load.films])
    theta = np.concatenate([h, drive.theta[0, n:]])
    K = body.A0 + np.tensordot(theta, np.array(body.A).reshape(-1, body.n, body.n), 1)
    if body.P.shape[1]:
        contacts = ContactPlaces.of(load)
        gamma = gammas(contacts, loads_for(small, drive), np.ones(contacts.n_contacts))[0]
        K = K + body.P @ gamma @ body.P.T
    air = drive.environment[0, [film.environment for film in load.films]] - temperature
    return K, body.M[:, :n] @ (h * air), np.asarray(body.C)

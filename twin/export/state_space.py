"""The artefact as one linear state space, at held film coefficients and axis positions.

    E x' = A x + B u        A = -(A0 + sum_k theta_k A_k) - P Gamma P_out^T
    y    = C x + D u        D = 0

x are the states of all bodies; u the heat of every source, the temperature of every environment above the reference
temperature and, where the air is warmer above, its gradient; y the sensors above the reference temperature and the TCP
displacement. Laws stay outside: a source's heat is an input, whatever it depends on. A film's coefficient is held, and
split into convection and radiation by what radiation is at the reference temperature.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from twin.export.operating_point import OperatingPoint
from twin.physics.radiation import radiation_coefficient
from twin.rom.contact import segment_borders, station_weights
from twin.rom.load_model import LoadModel, Pair
from twin.rom.model import AffineBody, MachineModel
from twin.rom.tcp import tcp_rows


@dataclass(frozen=True)
class Channel:
    """An input or an output."""

    name: str  # "sources.x_motor", "environments.room", "sensors.bed_1", "tcp.x"
    unit: str  # SI; K above the reference temperature
    rest: float = 0.0  # of inputs: what it is where nothing is logged and nothing moves


@dataclass(frozen=True)
class StateSpace:
    """E x' = A x + B u, y = C x + D u."""

    E: np.ndarray  # (n, n) J/K
    A: np.ndarray  # (n, n) W/K
    B: np.ndarray  # (n, m) W per unit of each input
    C: np.ndarray  # (p, n) unit of each output per K
    D: np.ndarray  # (p, m) zero
    states: tuple[str, ...]  # "bed_001": body and number
    inputs: tuple[Channel, ...]
    outputs: tuple[Channel, ...]


def state_space(model: MachineModel, point: OperatingPoint) -> StateSpace:
    """The linear machine at an operating point. Switches are open, joints have their described conductance.

    Raises ModelError where a body moves freely at this position (`twin.rom.tcp`).
    """
    load = model.load_model
    theta = np.concatenate([point.films, [joint.conductance for joint in load.joints]])
    P = _columns(model, [b.P for b in model.bodies], [b.ports for b in model.bodies], len(load.ports))
    P_out = _columns(model, [b.port_rows.T for b in model.bodies], [b.ports for b in model.bodies], len(load.ports))
    conduction = block_diag(*(b.A0 + _weighted(b, theta) for b in model.bodies))
    sources = _columns(model, [b.B for b in model.bodies], [b.sources for b in model.bodies], len(load.sources))
    environments, gradients, inputs = _environments(model, point)
    own = [axis.name for axis in load.axes]
    at = point.position[[own.index(name) for name in model.pose_axes]]
    tcp = np.hstack([rows[0] for rows in tcp_rows(model, at[None])]) if model.moves else np.zeros((0, model.n))
    C = np.zeros((len(model.sensors), model.n))
    for body, first in zip(model.bodies, _first(model), strict=True):
        C[list(body.sensors), first : first + body.n] = body.C
    B = np.hstack([sources + P @ contact_shares(load, point.position), environments, gradients])
    return StateSpace(
        E=block_diag(*(b.E for b in model.bodies)),
        A=-conduction - P @ conductance_matrix(load, point.position) @ P_out.T,
        B=B,
        C=np.vstack([C, tcp]),
        D=np.zeros((len(C) + len(tcp), B.shape[1])),
        states=tuple(f"{b.name}_{i + 1:03d}" for b in model.bodies for i in range(b.n)),
        inputs=(*(Channel(f"sources.{s.name}", "W") for s in load.sources), *inputs),
        outputs=(
            *(Channel(f"sensors.{name}", "K") for name in model.sensors),
            *(Channel(f"tcp.{c}", "m") for c in "xyz"[: len(tcp)]),
        ),
    )


def conductance_matrix(load: LoadModel, position: np.ndarray) -> np.ndarray:
    """Gamma (n_ports, n_ports) [W/K] of moving contacts at axis positions (n_axes,) [m]: the sum of g d d^T."""
    gamma = np.zeros((len(load.ports),) * 2)
    for pair in load.pairs:
        d = -_facing(load, pair, position)
        d[pair.pad_port] += 1.0
        gamma += pair.conductance * pair.area * np.outer(d, d)
    return gamma


def contact_shares(load: LoadModel, position: np.ndarray) -> np.ndarray:
    """(n_ports, n_sources) 1: which share of a source's heat enters each port; zero of sources on surfaces."""
    shares = np.zeros((len(load.ports), len(load.sources)))
    for j, source in enumerate(load.sources):
        pairs = [p for p in load.pairs if source.contact and p.contact == source.contact]
        for pair in pairs:
            shares[:, j] += source.rail_share / len(pairs) * _facing(load, pair, position)
            shares[pair.pad_port, j] += (1.0 - source.rail_share) / len(pairs)
    return shares


def _facing(load: LoadModel, pair: Pair, position: np.ndarray) -> np.ndarray:
    """(n_ports,) weights of the rail's segments below the pad; they sum to 1."""
    rail = load.rails[pair.rail]
    stations = np.array(rail.stations)
    moved = position[pair.axis]
    s = np.array(pair.station - moved if pair.rail_moves else pair.station + moved)
    weights = np.zeros(len(load.ports))
    if pair.assignment == "segment":
        weights[rail.first_port + int(np.searchsorted(segment_borders(stations), s))] = 1.0
        return weights
    i, right = station_weights(stations, s)
    weights[rail.first_port + int(i) + np.arange(2)] = 1.0 - float(right), float(right)
    return weights


def _environments(model: MachineModel, point: OperatingPoint) -> tuple[np.ndarray, np.ndarray, tuple[Channel, ...]]:
    """What environments bring: columns (n, n_environments) per K above the reference, (n, g) per K/m; their channels.

    theta_k M_k T_out,k + lift_k H_k with T_out = T_air + share (T_radiant - T_air), T_air the one at height zero.
    """
    load, films = model.load_model, point.films
    M = _columns(model, [b.M for b in model.bodies], [b.theta for b in model.bodies], len(load.theta_names))
    H = np.zeros_like(M)
    for body, first in zip(model.bodies, _first(model), strict=True):
        if body.H is not None:
            H[first : first + body.n, list(body.theta)] = body.H
        if body.raised is not None:
            H[first : first + body.n, list(body.theta)] += np.tensordot(point.position, body.raised, 1)
    reference = model.reference_temperature
    warmer, above = np.zeros((2, model.n, len(load.environments)))
    for k, film in enumerate(load.films):
        radiated = min(films[k], float(radiation_coefficient(reference, reference, film.emissivity)))
        convection = films[k] - radiated
        warmer[:, film.environment] += convection * M[:, k]
        warmer[:, film.radiant] += radiated * M[:, k]
        above[:, film.environment] += convection * (H[:, k] - load.environments[film.environment].height * M[:, k])
    graded = [i for i, e in enumerate(load.environments) if e.gradient]
    channels = [
        Channel(f"environments.{e.name}", "K", e.offset + (0.0 if e.signal else e.temperature - reference))
        for e in load.environments
    ] + [
        Channel(f"environments.{load.environments[i].name}.gradient", "K/m", load.environments[i].gradient)
        for i in graded
    ]
    return warmer, above[:, graded], tuple(channels)


def _weighted(body: AffineBody, theta: np.ndarray) -> np.ndarray:
    """sum_k theta_k A_k (n, n) [W/K] of a body."""
    total = np.zeros((body.n, body.n))
    for k, A in zip(body.theta, body.A, strict=True):
        total = total + theta[k] * A
    return total


def _columns(
    model: MachineModel, blocks: Sequence[np.ndarray], places: Sequence[Sequence[int]], count: int
) -> np.ndarray:
    """(n, count): the columns of every body at their places among those of the machine."""
    result = np.zeros((model.n, count))
    for body, first, block, columns in zip(model.bodies, _first(model), blocks, places, strict=True):
        result[first : first + body.n, list(columns)] = block
    return result


def _first(model: MachineModel) -> list[int]:
    """The first state of every body."""
    return np.cumsum([0, *(body.n for body in model.bodies)])[:-1].tolist()

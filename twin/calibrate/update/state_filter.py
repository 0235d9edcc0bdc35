"""Kalman filter on the reduced thermal state, uncertain parameters, and what no parameter explains.

State: z, the reduced temperatures; u, ln(value / nominal) of powers, films and conductances; gain and offset of the TCP
error per axis; a bias per temperature sensor. Temperatures are assimilated as they come, TCP measurements when there is
one. u drifts (random walk), gain, offset and bias drift and return (Ornstein-Uhlenbeck): what mesh, basis and missing
physics leave.

    y_tcp = (1 + gain) * G z + offset + v        T_sensor = T_ref + C z + bias + v

The covariance is kept as root root^T with a fixed number of columns (reduced-rank square root filter, Verlaan and
Heemink, Stochastic Hydrology and Hydraulics 11, 1997): columns pass through the differentiated step
(`twin.calibrate.update.state_tangent`), measurements come one scalar at a time (`twin.calibrate.update.state_learn`).
Process noise adds columns; the least important directions, judged by what they do to outputs in units of their noise,
are left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import twin.run.jax_setup  # noqa: F401  isort: skip

import jax
import numpy as np

from twin.calibrate.update.state_tangent import KINDS, Acts, UncertainLoads, acts_of, cold, tangent_step
from twin.rom.artefact import Artefact
from twin.rom.parameter import Parameter
from twin.run.stepping import State
from twin.run.system import Layout, Prepared, System, prepare

HOUR = 3600.0
SCALES = np.array([0.35, 0.5, 0.7, 1.0, 1.4, 2.0])  # of the predicted standard deviation of the TCP error
BELIEF = np.array([1.0, 2.0, 3.0, 3.0, 2.0, 1.0]) / 12.0  # in them, before anything is measured


@dataclass(frozen=True)
class StatePrior:
    """How well things are known before anything is measured; sigma of parameters are those of the artefact."""

    sensor_noise: float = 0.1  # K, of one reading
    sensor_bias: float = 0.2  # K, what a sensor reads beside the model, sensor by sensor
    sensor_hours: float = 6.0  # h, after which such a bias is forgotten
    tcp_noise: float = 1e-6  # m, of one measurement without a sigma of its own
    tcp_offset: float = 2e-6  # m
    tcp_gain: float = 0.05  # 1
    tcp_hours: float = 6.0  # h, after which offset and gain are forgotten
    walk: float = 0.02  # prior sigma of a parameter by which it drifts in one hour
    start: float = 0.3  # K, of the initial temperature of each body
    noise_every: float = 600.0  # s between additions of process noise
    columns: int = 20  # of the root beyond one per uncertain number


@dataclass(frozen=True)
class Rows:
    """Rows of z, u, gain, offset and bias in the whole vector, and its length."""

    z: slice
    u: slice
    gain: slice
    offset: slice
    bias: slice
    n: int

    def extra(self, part: slice) -> slice:
        """The same rows among those after z."""
        return slice(part.start - self.z.stop, part.stop - self.z.stop)


@dataclass(frozen=True)
class Machine:
    """What the filter never changes: the base model, and its uncertain parameters."""

    artefact: Artefact
    prepared: Prepared
    parameters: tuple[Parameter, ...]
    acts: Acts
    prior: StatePrior
    C: np.ndarray  # (n_sensors, N)
    G: np.ndarray  # (n_poses, 3, N) m/K
    limits: np.ndarray  # (n, 2) of u

    @property
    def layout(self) -> Layout:
        return self.prepared.layout

    @property
    def system(self) -> System:
        return self.prepared.system

    @property
    def rows(self) -> Rows:
        """Where things stand in the whole vector."""
        edges = np.cumsum([0, self.C.shape[1], len(self.parameters), 3, 3, len(self.C)]).tolist()
        z, u, gain, offset, bias = (slice(a, b) for a, b in pairwise(edges))
        return Rows(z, u, gain, offset, bias, edges[-1])


def machine_of(artefact: Artefact, prior: StatePrior = StatePrior(), parameters: Sequence[Parameter] = ()) -> Machine:
    """The filter's constants; by default with the artefact's parameters of the kinds it knows (`KINDS`)."""
    chosen = tuple(p for p in (parameters or artefact.parameters) if p.kind in KINDS)
    prepared = prepare(artefact.model)
    G = np.asarray(prepared.system.G)
    limits = [[np.log(b / p.nominal) if p.scale == "log" else b - p.nominal for b in (p.low, p.high)] for p in chosen]
    return Machine(
        artefact=artefact,
        prepared=prepared,
        parameters=chosen,
        acts=acts_of(artefact.model.load_model, chosen),
        prior=prior,
        C=np.asarray(prepared.system.C),
        G=G.reshape(-1, 3, G.shape[1]),
        limits=np.array(limits).reshape(-1, 2),
    )


@dataclass(frozen=True)
class StateEstimate:
    """The filter's state: enough to go on from, exactly."""

    time: float  # s
    step: State  # z with the factor of its last step
    extra: np.ndarray  # (n + 6 + n_sensors,) u, gain, offset, bias
    root: np.ndarray  # (N + n + 6 + n_sensors, r)
    noise_due: float  # s, of process noise not yet added
    left_out: np.ndarray  # (3,) m: the innovation of a TCP measurement just gated, else NaN
    belief: np.ndarray  # (len(SCALES),) how probable it is that the predicted TCP sigma is wrong by that factor

    @property
    def vector(self) -> np.ndarray:
        return np.concatenate([np.asarray(self.step.z), self.extra])


def begin(machine: Machine, time: float, temperature: float, first: UncertainLoads) -> StateEstimate:
    """The machine at one temperature [degC] at `time` [s]; `first` are the loads of its first step."""
    at = machine.rows
    prior, size = machine.prior, at.n
    sigma = np.zeros(size)
    sigma[at.u] = [p.sigma for p in machine.parameters]
    sigma[at.gain], sigma[at.offset], sigma[at.bias] = prior.tcp_gain, prior.tcp_offset, prior.sensor_bias
    columns = [np.diag(sigma)[:, at.u.start :]]
    one, borders = np.asarray(machine.system.one), machine.layout.offsets
    for a, b in pairwise(borders):
        column = np.zeros((size, 1))
        column[a:b, 0] = prior.start * one[a:b]
        columns.append(column)
    root = np.hstack([*columns, np.zeros((size, prior.columns))])
    z0 = jax.numpy.asarray(machine.prepared.uniform(temperature))
    step = cold(machine.layout, machine.system, z0, first)
    return StateEstimate(time, step, np.zeros(size - at.u.start), root, 0.0, np.full(3, np.nan), BELIEF)


def advance(machine: Machine, state: StateEstimate, loads: UncertainLoads, dt: float) -> StateEstimate:
    """The state one step of dt [s] later."""
    at = machine.rows
    u, root = state.extra[at.extra(at.u)], state.root.copy()
    step, dz = tangent_step(machine.layout, machine.system, machine.acts, state.step, u, root[at.z], root[at.u], loads)
    root[at.z] = np.asarray(dz)
    moved = replace(state, time=state.time + dt, step=step, root=root, noise_due=state.noise_due + dt)
    return _with_noise(machine, moved) if moved.noise_due >= machine.prior.noise_every - 1e-6 else moved


def _with_noise(machine: Machine, state: StateEstimate) -> StateEstimate:
    at = machine.rows
    prior, hours = machine.prior, state.noise_due / HOUR
    keep = np.ones(at.n)
    keep[at.gain] = keep[at.offset] = np.exp(-hours / prior.tcp_hours)
    keep[at.bias] = np.exp(-hours / prior.sensor_hours)
    noise = np.zeros(at.n)
    noise[at.u] = [prior.walk * p.sigma * np.sqrt(hours) for p in machine.parameters]
    for part, sigma in ((at.gain, prior.tcp_gain), (at.offset, prior.tcp_offset), (at.bias, prior.sensor_bias)):
        noise[part] = sigma * np.sqrt(1.0 - keep[part] ** 2)
    grown = np.hstack([state.root * keep[:, None], np.diag(noise)[:, at.u.start :]])
    return replace(
        state,
        extra=state.extra * keep[at.u.start :],
        root=compressed(machine, grown, state.root.shape[1]),
        noise_due=0.0,
    )


def compressed(machine: Machine, root: np.ndarray, columns: int) -> np.ndarray:
    """The leading `columns` directions of root (m, k), by what they do to outputs, parameters, gains and biases."""
    at = machine.rows
    prior = machine.prior
    rows = [
        machine.C @ root[at.z] / prior.sensor_noise,
        machine.G[:: max(1, len(machine.G) // 9)].reshape(-1, at.z.stop) @ root[at.z] / prior.tcp_noise,
        root[at.u] / np.array([0.05 * p.sigma for p in machine.parameters])[:, None],
        root[at.gain] / 0.01,
        root[at.offset] / prior.tcp_noise,
        root[at.bias] / prior.sensor_noise,
        root[at.z] * 1e-2 / np.sqrt(machine.prepared.heat_capacity),
    ]
    weighted = np.vstack(rows)
    _, vectors = np.linalg.eigh(weighted.T @ weighted)
    return root @ vectors[:, ::-1][:, :columns]

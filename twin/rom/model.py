"""The affine state space of a body and of a machine, full or reduced.

A *body* is the set of parts joined by fixed contacts: it moves as one. Bodies meet at moving contacts only.
For every body (field temperatures relative to T_ref, x in K or in modal coordinates):

    E x' = -(A0 + sum_k theta_k A_k) x + sum_k theta_k (M_k (T_amb,k - T_ref) + H_k gamma_k) + B q + P q_port
    H_k = H_k(0) + sum_a raised_a,k position_a
    T_port = P^T x          (area average of a port; P also distributes port heat: sum over nodes 1)
    T_sensor = C x
    w(pose) = G[pose] x     (this body's share of the TCP displacement, m)
    w(position) = Z(position) W x     (the same at any axis position: `twin.rom.tcp`)
    T_source = B^T x        (area average of a source's surface)

gamma_k [K/m] is the rise of the environment's temperature with height, T_amb,k its value at height zero. An axis that
moves a body up moves it into other air: raised_a,k is M_k times the vertical part of the axis' direction.

Moving contacts couple port temperatures: q_port = -Gamma(t) T_port with a symmetric positive semidefinite Gamma
(`twin.rom.contact`). E, A0, A_k are symmetric positive semidefinite for the full model and every Galerkin projection
of it, so the model is stable for all theta >= 0, all conductances >= 0 and all positions.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from twin.rom.elastic_structure import ElasticStructure
from twin.rom.load_model import LoadModel
from twin.rom.lumped_structure import LumpedStructure

Matrix = Any  # numpy array or scipy.sparse.csr_array; `rom` itself never needs to know which


@dataclass(frozen=True)
class AffineBody:
    """One body; n states. Sparse (full model) or dense (reduced) matrices."""

    name: str
    E: Matrix  # (n, n) J/K capacity
    A0: Matrix  # (n, n) W/K conduction
    A: tuple[Matrix, ...]  # (n, n) each: film terms per W/(m^2 K) [m^2], joint terms likewise
    theta: tuple[int, ...]  # index of each term's coefficient in LoadModel.theta_names
    M: np.ndarray  # (n, len(theta)) m^2: A_k @ 1 of film terms; zero columns for joints
    B: np.ndarray  # (n, len(sources)) distribution of 1 W of each source
    sources: tuple[int, ...]  # index of each column in LoadModel.sources
    P: np.ndarray  # (n, n_ports of this body) 1: port averages
    ports: tuple[int, ...]  # index of each column in LoadModel.ports
    C: np.ndarray  # (len(sensors), n) 1
    sensors: tuple[int, ...]  # index of each row in MachineModel.sensors
    G: np.ndarray  # (n_poses, 3, n) m/K
    one: np.ndarray  # (n,) coordinates of the field that is 1 K everywhere
    energy: np.ndarray  # (n,) J/K: energy @ x is the heat stored relative to T_ref (= E one)
    P_out: np.ndarray | None = None  # (n, n_ports) where reading a port differs from feeding it (oblique projection)
    B_out: np.ndarray | None = None  # (n, len(sources)) likewise of sources
    H: np.ndarray | None = None  # (n, len(theta)) m^3: A_k @ height of film terms, axes at zero; None: zero
    raised: np.ndarray | None = None  # (n_axes, n, len(theta)) m^2: what a metre of each axis adds to H; None: zero
    F: Matrix | None = None  # (m, n) 1: temperatures of the surface vertices, for pictures
    V: np.ndarray | None = None  # (n of the full model, n) 1: all its temperatures, of models not yet in an artefact
    # What parameters of single members (parts; nodes and bars of lumped machines) act on, summing to E and G:
    members: tuple[str, ...] = ()
    first: tuple[int, ...] = ()  # of the full model: the first state of each member; the reduced ones have instead
    E_members: np.ndarray | None = None  # (n_members, n, n) J/K
    G_members: np.ndarray | None = None  # (n_members, n_poses, 3, n) m/K
    # Elastic inputs: what the structure of the machine reads of the temperatures; None in artefacts that lack it:
    W: np.ndarray | None = None  # (p, n) m/K; rad/K of rotations, 1 of temperatures that scales and screws read
    W_members: np.ndarray | None = None  # (n_members, p, n) shares of the members in W, of reduced models

    def member_states(self, member: int) -> slice:
        """Of the full model: which states are those of a member."""
        return slice(self.first[member], (*self.first, self.n)[member + 1])

    @property
    def port_rows(self) -> np.ndarray:
        """(n_ports, n): T_port = port_rows @ x."""
        return (self.P if self.P_out is None else self.P_out).T

    @property
    def source_rows(self) -> np.ndarray:
        """(n_sources, n): mean temperatures of the sources' surfaces = source_rows @ x."""
        return (self.B if self.B_out is None else self.B_out).T

    @property
    def film_rows(self) -> np.ndarray:
        """(len(theta), n) m^2: theta_k film_rows[k] @ x is the heat [W] that term k takes out at T_amb = T_ref."""
        left = self.left_one
        return np.stack([a.T @ left for a in self.A]) if self.A else np.zeros((0, self.n))

    @property
    def left_one(self) -> np.ndarray:
        """(n,) the test vector that sums the rows of the heat equation: `one`, unless the projection is oblique."""
        return self.one if self.symmetric else np.linalg.solve(self.E.T, self.energy)

    @property
    def symmetric(self) -> bool:
        """True for the full model and Galerkin projections, False for oblique ones."""
        return self.P_out is None

    @property
    def n(self) -> int:
        return self.one.shape[0]


@dataclass(frozen=True)
class MachineModel:
    """All bodies of a machine with what drives and couples them."""

    name: str
    bodies: tuple[AffineBody, ...]
    load_model: LoadModel
    reference_temperature: float  # degC
    sensors: tuple[str, ...]  # structural sensors (degC), in output order
    ambient_sensors: tuple[tuple[str, int], ...]  # sensors in air: (name, index in LoadModel.environments)
    pose_axes: tuple[str, ...]  # axis names of the grid, e.g. ("x", "y", "z")
    pose_grid: tuple[np.ndarray, ...]  # per axis the grid positions [m]
    poses: np.ndarray  # (n_poses, n_axes) m, C order over pose_grid, angles zero, then those `scattered`
    structure: ElasticStructure | LumpedStructure | None = None  # acts on W of the bodies; None: G is all there is
    scattered: int = 0  # so many poses, the last ones, lie anywhere within the grid (`twin.rom.tcp.at_positions`)

    @property
    def n(self) -> int:
        return sum(b.n for b in self.bodies)

    @property
    def all_sensors(self) -> tuple[str, ...]:
        """Structural sensors, then those in the air: the order of outputs."""
        return (*self.sensors, *(name for name, _ in self.ambient_sensors))

    @property
    def turning(self) -> tuple[str, ...]:
        """Rotary axes that turn the tool or the work: their angles [rad] may follow positions of the pose axes."""
        return tuple(axis.name for axis in self.load_model.rotary)

    @property
    def moves(self) -> bool:
        """Whether any temperature moves the tool; some lumped machines have no TCP."""
        return any(np.any(b.G) for b in self.bodies)

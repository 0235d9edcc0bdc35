"""The coupled model as one dense NumPy system, written for clarity: what the compiled step is tested against."""

from __future__ import annotations

import numpy as np

from twin.rom.drive import Drive
from twin.rom.model import MachineModel
from twin.rom.tableau import SDIRK2_6, Tableau


def gamma(model: MachineModel, drive: Drive, step: int) -> np.ndarray:
    """Gamma (n_ports, n_ports) [W/K] of a step, from the dwell means of every pair."""
    load = model.load_model
    G = np.zeros((len(load.ports), len(load.ports)))
    for k, pair in enumerate(load.pairs):
        rail, g = load.rails[pair.rail], drive.conductance[step, k]
        n = len(rail.stations)
        ports = np.r_[np.arange(rail.first_port, rail.first_port + n), pair.pad_port]
        w, beside = drive.weight[step, k, :n], drive.neighbour[step, k, : n - 1]
        D = np.zeros((n + 1, n + 1))
        D[:n, :n] = np.diag(drive.square[step, k, :n]) + np.diag(beside, 1) + np.diag(beside, -1)
        D[:n, n] = D[n, :n] = -w
        D[n, n] = 1.0
        G[np.ix_(ports, ports)] += g * D
    return G


class Dense:
    """E x' = -A(step) x + f(step) of all bodies in artefact coordinates."""

    def __init__(self, model: MachineModel, drive: Drive):
        self.model, self.drive = model, drive
        self.starts = np.cumsum([0, *(b.n for b in model.bodies)])
        self.E = self._diagonal([b.E for b in model.bodies])
        n_ports = len(model.load_model.ports)
        self.P, self.P_out = np.zeros((2, model.n, n_ports))
        for b, body in enumerate(model.bodies):
            self.P[self._rows(b), list(body.ports)] = body.P
            self.P_out[self._rows(b), list(body.ports)] = body.port_rows.T
        self.energy = np.concatenate([b.energy for b in model.bodies])

    def _rows(self, b: int) -> slice:
        return slice(self.starts[b], self.starts[b + 1])

    def _diagonal(self, blocks: list[np.ndarray]) -> np.ndarray:
        full = np.zeros((self.starts[-1], self.starts[-1]))
        for b, block in enumerate(blocks):
            full[self._rows(b), self._rows(b)] = block
        return full

    def A(self, step: int) -> np.ndarray:
        theta = self.drive.theta[step]
        blocks = [
            b.A0 + sum((theta[k] * a for k, a in zip(b.theta, b.A, strict=True)), np.zeros_like(b.A0))
            for b in self.model.bodies
        ]
        return self._diagonal(blocks) + self.P @ gamma(self.model, self.drive, step) @ self.P_out.T

    def f(self, step: int) -> np.ndarray:
        load, drive = self.model.load_model, self.drive
        right = self.P @ drive.port_heat[step]
        for b, body in enumerate(self.model.bodies):
            for column, k in enumerate(body.theta):
                if k < len(load.films):
                    rise = drive.environment[step, load.films[k].environment] - self.model.reference_temperature
                    right[self._rows(b)] += drive.theta[step, k] * rise * body.M[:, column]
            right[self._rows(b)] += body.B @ drive.power[step, list(body.sources)]
        return right

    def uniform(self, temperature: float) -> np.ndarray:
        rise = temperature - self.model.reference_temperature
        return rise * np.concatenate([b.one for b in self.model.bodies])

    def euler(self, x: np.ndarray, substeps: int) -> np.ndarray:
        """States (n_steps + 1, N) by implicit Euler."""
        states = [x]
        for step in range(self.drive.n_steps):
            rate = substeps / (self.drive.time[step + 1] - self.drive.time[step])
            S, f = rate * self.E + self.A(step), self.f(step)
            for _ in range(substeps):
                x = np.linalg.solve(S, rate * self.E @ x + f)
            states.append(x)
        return np.array(states)

    def runge_kutta(self, x: np.ndarray, substeps: int = 1, tableau: Tableau = SDIRK2_6) -> np.ndarray:
        """States (n_steps + 1, N) by rates k_i = E^-1 (f - A (x + h sum_j a_ij k_j)) of the stages."""
        states = [x]
        for step in range(self.drive.n_steps):
            h = (self.drive.time[step + 1] - self.drive.time[step]) / substeps
            A, f = self.A(step), self.f(step)
            for _ in range(substeps):
                rates: list[np.ndarray] = []
                for row in tableau.rows:
                    known = x + h * sum((a * k for a, k in zip(row, rates, strict=False)), np.zeros_like(x))
                    rates.append(np.linalg.solve(self.E + h * row[-1] * A, f - A @ known))
                x = x + h * sum((b * k for b, k in zip(tableau.weights, rates, strict=True)), np.zeros_like(x))
            states.append(x)
        return np.array(states)

    def exact(self, x: np.ndarray) -> np.ndarray:
        """States (n_steps + 1, N) by the exact exponential over every step, for loads constant within it."""
        import scipy.linalg

        states, n = [x], len(x)
        for step in range(self.drive.n_steps):
            h = self.drive.time[step + 1] - self.drive.time[step]
            augmented = np.zeros((n + 1, n + 1))  # [x; 1]' = [[-E^-1 A, E^-1 f], [0, 0]] [x; 1]
            augmented[:n, :n] = -np.linalg.solve(self.E, self.A(step))
            augmented[:n, n] = np.linalg.solve(self.E, self.f(step))
            x = (scipy.linalg.expm(h * augmented) @ np.append(x, 1.0))[:n]
            states.append(x)
        return np.array(states)

    def tcp(self, states: np.ndarray) -> np.ndarray:
        """(n, n_poses, 3) m."""
        parts = np.split(states, self.starts[1:-1], axis=1)
        return sum(np.einsum("pci,ni->npc", b.G, x) for b, x in zip(self.model.bodies, parts, strict=True))

    def temperature(self, states: np.ndarray) -> np.ndarray:
        """(n, n_sensors) degC."""
        T = np.full((len(states), len(self.model.sensors)), self.model.reference_temperature)
        for body, x in zip(self.model.bodies, np.split(states, self.starts[1:-1], axis=1), strict=True):
            T[:, list(body.sensors)] += x @ body.C.T
        return T

"""The integrator of the host: coupled bodies, full (sparse) or rich (dense), any tableau.

    (r E + A(theta) + P Gamma P^T) X = r E base + M theta (T_out - T_ref) + B q + P q_port    (`twin.rom.tableau`)

Paper 000 eqs (4)-(6) with the films implicit (erratum E-000-3: the lagged form is stable only for dt < 2 rho c d/h).
How that is solved, and what of the films its factors leave to the right side: `twin.build.coupled_system`. The heat
balance counts what was solved and stays exact.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from twin.build.coupled_system import CoupledSystem, Factored
from twin.build.fixed_point import fixed_point
from twin.build.heat import Heat
from twin.rom.contact_matrix import ContactPlaces, contact_entries, dense
from twin.rom.drive import Drive
from twin.rom.following import FOLLOW, FilmPlan, read_table, temperature_place
from twin.rom.model import MachineModel
from twin.rom.step_loads import StepDrive, StepLoads, Tabulated, step_loads
from twin.rom.tableau import SDIRK2_6, Feedback, Tableau, stages

# Share of the heat that leaves a body without films through its contacts: what `steady_state` keeps in the body for a
# turn, so that it can be solved for alone. Small, for few turns; not tiny, as rounding grows with its inverse.
KEPT = 1e-3


def contact_matrix(model: MachineModel, drive: Drive, step: int) -> np.ndarray:
    """Gamma (n_ports, n_ports) W/K of one step: q_port = -Gamma T_port."""
    load = model.load_model
    entries = contact_entries(load, drive, slice(step, step + 1))
    return np.asarray(dense(np, ContactPlaces.of(load), entries.at(0)))


class CoupledStepper(CoupledSystem):
    """Steps a MachineModel whose bodies are sparse (full) or dense (rich)."""

    def __init__(self, model: MachineModel, keep: int = 2, follow: float = FOLLOW, tableau: Tableau = SDIRK2_6):
        super().__init__(model, keep, follow)
        self._tableau = tableau
        n_films, n_theta = len(model.load_model.films), len(model.load_model.theta_names)
        self._film_rows = tuple(body.film_rows for body in model.bodies)
        # area and first moment of height of the films, and what a metre of each axis adds to that
        axes = len(model.load_model.axes) if any(body.raised is not None for body in model.bodies) else 0
        self._area, self._moment = np.zeros(n_theta), np.zeros((1 + axes, n_theta))
        for body in model.bodies:
            own = list(body.theta)
            self._area[own] += body.left_one @ body.M
            if body.H is not None:
                self._moment[0, own] += body.left_one @ body.H
            if body.raised is not None:
                self._moment[1:, own] += body.left_one @ body.raised
        self._area[n_films:] = 0.0
        self._safe_area = np.where(self._area[:n_films] > 0, self._area[:n_films], 1.0)
        self._plan = FilmPlan.of(model.load_model, self._moment[:, :n_films], self._safe_area)
        self._contacts = ContactPlaces.of(model.load_model)
        self._feeds: dict[tuple[int, ...], tuple[np.ndarray, np.ndarray]] = {}

    def __reduce__(self) -> tuple:
        """A copy starts without factors, as those of sparse solvers cannot be copied, and has no rows for pictures."""
        bodies = tuple(replace(body, F=None, V=None) for body in self.model.bodies)
        return CoupledStepper, (replace(self.model, bodies=bodies), self._keep, self._follow, self._tableau)

    def surfaces(self, x: list[np.ndarray]) -> np.ndarray:
        """Mean temperatures (n_films,) [degC] of the films' surfaces."""
        n = len(self.model.load_model.films)
        total = np.zeros(len(self._area))
        for body, rows, xb in zip(self.model.bodies, self._film_rows, x, strict=True):
            total[list(body.theta)] += rows @ xb
        return self.model.reference_temperature + total[:n] / self._safe_area

    def loads(self, drive: Drive, step: int, x: list[np.ndarray]) -> StepLoads:
        """The loads of a step that starts at x."""
        T_ref = self.model.reference_temperature
        told = self._told(drive, step)
        return step_loads(np, self._plan, told, self.surfaces(x), self._following(drive, x), T_ref)

    def _following(self, drive: Drive, x: list[np.ndarray]) -> np.ndarray:
        """Temperatures (k,) [degC] of the sources that follow them."""
        temperature = np.full(len(self.model.load_model.sources), self.model.reference_temperature)
        if drive.losses.index:
            for body, xb in zip(self.model.bodies, x, strict=True):
                if not set(drive.losses.index).isdisjoint(body.sources):
                    temperature[list(body.sources)] += body.source_rows @ xb
        return temperature[list(drive.losses.index)]

    def _told(self, drive: Drive, step: int) -> StepDrive:
        """What the log tells of a step."""
        theta, n = drive.theta[step], len(self.model.load_model.films)
        return StepDrive(
            convection=Tabulated(theta[:n], drive.films.index, drive.films.value[step]),
            joints=theta[n:],
            power=Tabulated(drive.power[step], drive.losses.index, drive.losses.value[step]),
            port_heat=drive.contact_heat[step].sum(axis=0),
            environment=drive.environment[step],
            position=drive.mean_position[step],
            radiation=float(drive.radiation),
        )

    def _feedback(self, drive: Drive, step: int, power: np.ndarray) -> Feedback | None:
        """What sources that follow a temperature add to a forcing with powers (n_sources,) [W]; None without such."""
        index = list(drive.losses.index)
        if not index:
            return None
        T_ref, table, begun = self.model.reference_temperature, drive.losses.value[step], power[index]
        B, rows = self._fed(drive.losses.index)

        def feedback(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            now = read_table(np, table, temperature_place(np, T_ref + rows @ x))
            return B @ (now - begun), now

        return feedback

    def _fed(self, index: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
        """(N, k) where the heat of sources goes, and (k, N) what reads their temperatures, of all bodies. Kept."""
        if index not in self._feeds:
            N, n = self._rows[-1].stop, len(self.model.load_model.sources)
            B, rows = np.zeros((N, n)), np.zeros((n, N))
            for body, own in zip(self.model.bodies, self._rows, strict=True):
                B[own, list(body.sources)], rows[list(body.sources), own] = body.B, body.source_rows
            self._feeds[index] = B[:, list(index)], rows[list(index)]
        return self._feeds[index]

    def _of_terms(self, films: np.ndarray) -> np.ndarray:
        """(..., n_theta): numbers (..., n_films) of films, and zero for joints."""
        joints = len(self._area) - films.shape[-1]
        return np.concatenate([films, np.zeros((*films.shape[:-1], joints))], axis=-1)

    def forcing(self, loads: StepLoads) -> list[np.ndarray]:
        """Per body M theta (T_out - T_ref) + H lift + B q + P q_port [W]."""
        result = []
        rise, lift = self._of_terms(loads.rise), self._of_terms(loads.lift)
        for body in self.model.bodies:
            own = list(body.theta)
            f = body.M @ (loads.theta[own] * rise[own])
            if body.H is not None:
                f = f + body.H @ lift[0, own]
            if body.raised is not None:
                f = f + np.einsum("ank,ak->n", body.raised, lift[1:, own])
            result.append(f + body.B @ loads.power[list(body.sources)] + body.P @ loads.port_heat[list(body.ports)])
        return result

    def run(
        self, drive: Drive, start: list[np.ndarray], substeps: int = 1, first: int = 0
    ) -> Iterator[tuple[int, list[np.ndarray], Heat]]:
        """Yield (step, state after it, heat of the step) for steps first, first + 1, ... of `drive`.

        States per body (n_b,) K.
        """
        tableau, contacts = self._tableau, contact_entries(self.model.load_model, drive)
        weights = np.array(tableau.weights) / substeps
        x = list(start)
        for step in range(first, drive.n_steps):
            dt = drive.time[step + 1] - drive.time[step]
            loads = self.loads(drive, step, x)
            gamma = dense(np, self._contacts, contacts.at(step))
            factors, solve, capacity = self._system(loads.theta, gamma, substeps / dt / tableau.diagonal)
            forcing = np.concatenate(self.forcing(loads))
            after = before = np.concatenate(x)
            own, seen = np.zeros_like(before), np.zeros_like(before)  # means over the step
            feedback, following = self._feedback(drive, step, loads.power), list(drive.losses.index)
            power = loads.power.copy()
            power[following] = 0.0
            for _ in range(substeps):
                after, made = stages(tableau, solve, capacity, after, forcing, feedback)
                at, saw, powers = zip(*made, strict=True)
                own, seen = own + weights @ np.array(at), seen + weights @ np.array(saw)
                if following:
                    power[following] += weights @ np.array(powers)
            x = self._parts(after)
            loads = replace(loads, power=power)
            yield step, x, self._heat(loads, factors, dt, *map(self._parts, (after - before, seen, own)))

    def responses(
        self, drive: Drive, start: list[np.ndarray], forcing: Callable[[int], np.ndarray]
    ) -> Iterator[tuple[int, np.ndarray]]:
        """Yield (step, changes (N, k) [K] of all states after it) by k forcings (N, k) [W], each on top of the drive.

        Films, losses and contacts are those of the drive without them, so that the response is linear. All k share the
        factors: a run each would read these k times.
        """
        contacts = contact_entries(self.model.load_model, drive)
        before, change = start, np.zeros_like(forcing(0))
        for step, after, _ in self.run(drive, start):
            theta, gamma = self.loads(drive, step, before).theta, dense(np, self._contacts, contacts.at(step))
            rate = 1.0 / (drive.time[step + 1] - drive.time[step]) / self._tableau.diagonal
            _, solve, capacity = self._system(theta, gamma, rate)
            change, _ = stages(self._tableau, solve, capacity, change, forcing(step))
            before = after
            yield step, change

    def _heat(
        self,
        loads: StepLoads,
        factors: list[Factored],
        dt: float,
        change: list[np.ndarray],
        seen: list[np.ndarray],
        own: list[np.ndarray],
    ) -> Heat:
        """Heat of a step from its loads, its change of state, and the means that the rest and the factor saw."""
        rise, lift = self._of_terms(loads.rise), self._of_terms(loads.lift)
        flow = loads.theta * self._area * rise + (self._moment * lift).sum(axis=0)
        stored = 0.0
        for body, rows, f, dx, x_seen, x_own in zip(
            self.model.bodies, self._film_rows, factors, change, seen, own, strict=True
        ):
            terms = list(body.theta)
            flow[terms] -= f.theta * (rows @ x_own) + (loads.theta[terms] - f.theta) * (rows @ x_seen)
            stored += float(body.energy @ dx) / dt
        n = len(self.model.load_model.films)
        return Heat(loads.power, flow[:n], stored, self._area[:n] * loads.radiated)

    def steady_state(self, drive: Drive, step: int, tolerance: float = 1e-5, most: int = 200) -> list[np.ndarray]:
        """The state that the loads of one step would reach if held for ever; laws that follow the state included.

        A fixed point of loads and state, to `tolerance` [K] (root mean square over the heat capacity), by Anderson
        acceleration (Walker, Ni, SIAM J. Numer. Anal. 49, 2011): plain iteration diverges where a loss falls or
        radiation rises steeply with temperature. A body that loses heat through contacts only has no steady state of
        its own: it is solved for with the rate of KEPT, which the fixed point takes out again. Raises ModelError where
        none is found.
        """
        gamma = contact_matrix(self.model, drive, step)
        rates = [self._rate_of_rest(b, gamma) for b in range(len(self.model.bodies))]
        capacity = sum(float(b.one @ b.energy) for b in self.model.bodies)

        def turn(flat: np.ndarray) -> np.ndarray:
            x = self._parts(flat)
            loads = self.loads(drive, step, x)
            follow = min(self._follow, FOLLOW)
            factors = [self._factor(b, loads.theta, rate, follow) for b, rate in enumerate(rates)]
            rest = [self._rest(b, loads.theta, factor.theta) for b, factor in enumerate(factors)]
            f = [
                fb + rate * self._stored(b, x[b])
                for b, (fb, rate) in enumerate(zip(self.forcing(loads), rates, strict=True))
            ]
            rhs = [fb if r is None else fb - r(xb) for fb, r, xb in zip(f, rest, x, strict=True)]
            return np.concatenate(self.solve(rhs, factors, self.across(factors, gamma)))

        def size(flat: np.ndarray) -> float:
            stored = [abs(float(p @ self._stored(b, p))) for b, p in enumerate(self._parts(flat))]
            return float(np.sqrt(sum(stored) / capacity))

        start = float(drive.environment[step, 0]) if drive.environment.shape[1] else self.model.reference_temperature
        return self._parts(fixed_point(turn, np.concatenate(self.uniform(start)), size, tolerance, most))

    def _rate_of_rest(self, b: int, gamma: np.ndarray) -> float:
        """1/s: zero for a body with films, KEPT of what its contacts take over its heat capacity for one without."""
        body = self.model.bodies[b]
        if self._area[list(body.theta)].any():
            return 0.0
        return KEPT * float(gamma[list(body.ports), list(body.ports)].sum() / (body.one @ body.energy))

    def uniform(self, temperature: float) -> list[np.ndarray]:
        """The state of a machine at one temperature [degC]."""
        return [(temperature - self.model.reference_temperature) * b.one for b in self.model.bodies]


def sensor_temperatures(model: MachineModel, x: list[np.ndarray]) -> np.ndarray:
    """Structural sensors (n_sensors,) degC."""
    T = np.full(len(model.sensors), model.reference_temperature)
    for body, xb in zip(model.bodies, x, strict=True):
        T[list(body.sensors)] += body.C @ xb
    return T


def tcp_at_poses(model: MachineModel, x: list[np.ndarray]) -> np.ndarray:
    """TCP displacement (n_poses, 3) m."""
    return sum(body.G @ xb for body, xb in zip(model.bodies, x, strict=True))

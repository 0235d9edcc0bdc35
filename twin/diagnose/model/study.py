"""A probed model with a plan of measurements: outputs of hypotheses as one vector, and their derivatives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import jax.numpy as jnp
import numpy as np

from twin.calibrate.fit.effects import Effects, effects_of
from twin.calibrate.fit.integration import Rows, displacements
from twin.calibrate.fit.measured import Measured
from twin.diagnose.model.integration import by_amplitudes, jacobian, outputs, stands_still, states_of
from twin.diagnose.model.over_runs import over_runs
from twin.diagnose.model.probed_model import ProbedModel, ProbedRun
from twin.diagnose.model.slots import Slots, first_slots, no_slots
from twin.errors import TwinError
from twin.rom.contact_matrix import ContactPlaces
from twin.rom.model import MachineModel
from twin.run.replay import at_rest
from twin.run.system import Layout

K = 4  # amplitudes that may be active at once
COMPONENTS = ("dx", "dy", "dz")  # of the TCP, in the order of its columns
NEARLY_NONE = 1e-6  # cosine of two heats in a reduced basis that have no place in common: rounding


@dataclass(frozen=True)
class Planned:
    """A run of the probed model with what is measured in it."""

    run: ProbedRun
    measured: Measured
    rows: Rows
    z0: np.ndarray  # (r,)

    @property
    def shapes(self) -> tuple[tuple[int, int], tuple[int, int]]:
        """Of bin means (b, s) and of TCP rows (k, 3)."""
        return (self.measured.mean_of.shape[0], len(self.measured.sensors)), (len(self.measured.tcp), 3)

    @property
    def size(self) -> int:
        """Numbers that are measured in the run."""
        (b, s), (k, three) = self.shapes
        return b * s + k * three

    def split(self, flat: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(size, ...) -> (b, s, ...) and (k, 3, ...)."""
        sensors, tcp = self.shapes
        n = sensors[0] * sensors[1]
        return flat[:n].reshape(*sensors, *flat.shape[1:]), flat[n:].reshape(*tcp, *flat.shape[1:])


@dataclass(frozen=True)
class Study:
    """n parameters; runs in the order of the probed model: first the `fitted` ones, which are looked at, then sealed
    ones.
    """

    probed: ProbedModel
    effects: Effects
    runs: tuple[Planned, ...]
    fitted: tuple[int, ...]

    @property
    def scale(self) -> np.ndarray:
        """(n,) prior standard deviations in units of u."""
        return np.array([p.sigma for p in self.probed.parameters])

    @property
    def fitted_runs(self) -> list[tuple[str, float]]:
        """Name and step [s] of each fitted run."""
        return [(run.name, run.step) for run in (self.runs[k].run for k in self.fitted)]

    @property
    def rows(self) -> list[slice]:
        """Which of the m numbers of all fitted runs, one run after the other, are of each."""
        ends = np.cumsum([0, *(self.runs[k].size for k in self.fitted)]).tolist()
        return [slice(i, j) for i, j in pairwise(ends)]

    def split(self, flat: np.ndarray) -> list[tuple[Planned, np.ndarray, np.ndarray]]:
        """(m, ...) of all fitted runs: of each what sensors (b, s, ...) and the TCP (k, 3, ...) have."""
        runs = [self.runs[k] for k in self.fitted]
        return [(p, *p.split(flat[own])) for p, own in zip(runs, self.rows, strict=True)]

    def joined(self, of: Callable[[Planned], tuple[object, object]]) -> np.ndarray:
        """(m,) of what every fitted run has for its sensors and for the TCP, (b, s) and (k, 3) or broadcast to that."""
        parts = [np.zeros(0)]
        for planned in (self.runs[k] for k in self.fitted):
            both = zip(of(planned), planned.shapes, strict=True)
            parts += [np.broadcast_to(np.asarray(values), shape).ravel() for values, shape in both]
        return np.concatenate(parts[1:] or parts)

    def all_outputs(self, x: np.ndarray) -> np.ndarray:
        """(m,) of all fitted runs at x (n,) in prior standard deviations."""
        return np.concatenate(over_runs(lambda k: self.outputs(k, x), self.fitted))

    def slots(self, k: int) -> Slots:
        """Empty slots for run k, to be filled."""
        return no_slots(self.runs[k].run.drive.n_steps, K, self.probed.base.n, self.probed.base)

    def outputs(self, k: int, x: np.ndarray, slots: Slots | None = None, a: Sequence[float] = ()) -> np.ndarray:
        """(size,) of run k at x (n,) in prior standard deviations, with hypotheses of amplitudes a."""
        (layout, contacts, *rest), arguments = self._given(k, slots, a)
        return np.asarray(outputs(layout, contacts, False, *rest, *arguments, self._v(x, a)))

    def jacobian(self, k: int, x: np.ndarray, slots: Slots | None = None, a: Sequence[float] = ()) -> np.ndarray:
        """(size, n + len(a)) derivatives by x and the amplitudes."""
        fixed, arguments = self._given(k, slots, a)
        J = jacobian(*fixed, *arguments, self._v(x, a))
        return np.asarray(J) * np.concatenate([self.scale, np.ones(len(a))])

    def by_amplitudes(self, k: int, x: np.ndarray, slots: Slots, a: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
        """Outputs (size,) of run k and their derivatives (size, len(a)) by the amplitudes of the first len(a) slots."""
        fixed, arguments = self._given(k, slots, a)
        D, y = by_amplitudes(*fixed, *arguments, self._v(x, ()), np.array(a, dtype=float))
        return np.asarray(y), np.asarray(D)

    def states(self, k: int, x: np.ndarray, slots: Slots | None = None, a: Sequence[float] = ()) -> np.ndarray:
        """z (n + 1, r) of run k."""
        (layout, contacts, still, _), (machine, effects, loads, own, _, _, z0) = self._given(k, slots, a)
        return np.asarray(states_of(layout, contacts, False, still, machine, effects, loads, own, z0, self._v(x, a)))

    def read(self, k: int, states: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What sensors (b, s) [degC] and the TCP (k, 3) [m] show of states of run k, as `outputs` reads them."""
        m, rows = self.runs[k].measured, self.runs[k].rows
        (body,) = self.probed.base.bodies
        T = m.mean_of @ (states @ body.C.T)[:, m.column] + self.probed.base.reference_temperature
        u = jnp.asarray(np.asarray(x) * self.scale)
        w = np.asarray(displacements(self.effects, rows, jnp.asarray(states), u))
        return T, w - w[0] if m.from_first else w

    def _v(self, x: np.ndarray, a: Sequence[float]) -> np.ndarray:
        return np.concatenate([np.asarray(x) * self.scale, np.asarray(a, dtype=float)])

    def _given(
        self, k: int, slots: Slots | None, a: Sequence[float]
    ) -> tuple[tuple[Layout, ContactPlaces, bool, bool], tuple]:
        """What the integration of run k is compiled for, and what it takes: as many slots as there are amplitudes, for
        every other one costs a step what a film does."""
        probed, planned, m = self.probed, self.runs[k], self.runs[k].measured
        loads, own = planned.run.loads, first_slots(self.slots(k) if slots is None else slots, len(a))
        fixed = probed.layout, probed.contacts, stands_still(probed.layout, loads, own), m.from_first
        bins = m.mean_of, m.column
        return fixed, (probed.ports_first, self.effects, loads, own, planned.rows, bins, planned.z0)


def own_place(study: Study, source: int) -> int | None:
    """The place that a source of a surface heats; None of a node beside the parts, which is none."""
    (body,) = study.probed.base.bodies
    B = body.B[:, body.sources.index(source)]
    alike = [abs(B @ b) / np.linalg.norm(b) for b in study.probed.B]
    best = int(np.argmax(alike))
    return best if alike[best] > NEARLY_NONE * np.linalg.norm(B) else None


def heated_places(study: Study) -> list[int]:
    """The faces that sources enter at, but contacts; none of lumped machines, whose nodes have no faces."""
    sources, places = study.probed.base.load_model.sources, study.probed.places
    own = {own_place(study, j) for j, source in enumerate(sources) if not source.contact}
    return sorted(p for p in own if p is not None and places[p].surfaces)


def make_study(probed: ProbedModel, measured: Sequence[Measured], fitted: Sequence[int]) -> Study:
    """The study of measurements (one per run of the probed model); `fitted` are the runs that are looked at.

    Raises TwinError where plans and runs do not match.
    """
    if len(measured) != len(probed.runs) or list(fitted) != list(range(len(fitted))):
        raise TwinError(
            "a plan per run, the fitted ones first", probed.base.name, "give one for every run of the probed model"
        )
    effects = effects_of(probed.base, probed.parameters, ())
    (body,) = probed.base.bodies
    G = body.G.reshape(-1, 3, body.n)
    n_poses = len(probed.base.poses)
    planned = []
    for run, m in zip(probed.runs, measured, strict=True):
        members = np.asarray(effects.G).reshape(-1, n_poses, 3, body.n)
        rows = Rows(m.tcp_step, m.tcp_share, np.tensordot(m.pose, G, 1), np.einsum("kp,epcr->ekcr", m.pose, members))
        planned.append(Planned(run, m, rows, start_of(probed.base, run)))
    return Study(probed, effects, tuple(planned), tuple(fitted))


def start_of(model: MachineModel, run: ProbedRun) -> np.ndarray:
    """State (N,) in which a run of a model begins, in the model's own coordinates."""
    if run.begins.rested:
        return at_rest(model, run.drive, run.begins.temperature)
    middle = [(run.begins.temperature - model.reference_temperature) * b.one for b in model.bodies]
    return np.concatenate(middle) + run.begins.of(model)


def with_measured(study: Study, measured: Sequence[Measured]) -> Study:
    """The same plan with other numbers measured."""
    return replace(study, runs=tuple(replace(p, measured=m) for p, m in zip(study.runs, measured, strict=True)))

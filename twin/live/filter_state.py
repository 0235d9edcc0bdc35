"""The filter `state` of `twin update` beside the machine: temperatures and TCP errors correct powers, films, states.

docs/update.md; `twin.calibrate.update.state`. It steps a copy of the machine with a hundred directions around it, by
the loads of every step of the JAX engine. Of a sensor it takes the last reading in a step, where `twin update` takes
the mean: the last one is of the time that the step ends at.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import twin.run.jax_setup  # noqa: F401  isort: skip

import jax
import numpy as np

from twin.calibrate.update import state_filter
from twin.calibrate.update.program import Measurement
from twin.calibrate.update.state import StateUpdater
from twin.calibrate.update.state_filter import StateEstimate, StatePrior, machine_of
from twin.calibrate.update.state_tangent import KINDS, UncertainLoads, separate_loads
from twin.errors import ModelError, TwinError
from twin.live.engine import EngineFailure
from twin.live.engine_jax import JaxEngine
from twin.rom.artefact import read_artefact
from twin.rom.drive import evaluate

_FIELDS = ("extra", "root", "left_out", "belief")


class StateFilter:
    """A `twin.live.learner.Filter` beside a JAX engine, which hands it the loads of every step."""

    def __init__(self, path: Path, engine: JaxEngine, prior: StatePrior = StatePrior()):
        """Raises ArtefactError for files that are no artefact, ModelError for one without parameters to learn."""
        artefact = read_artefact(path)
        if not any(p.kind in KINDS for p in artefact.parameters):
            remedy = "build it again with `twin build`, or choose --learn gain"
            raise ModelError("the artefact declares no losses, films or joints as parameters", str(path), remedy)
        self.machine, self.engine = machine_of(artefact, prior), engine
        self._shape = self._any_loads()
        # its own loads are not used: steps are made here, as they come
        self._updater = StateUpdater(self.machine, self._shape, engine.facts.step, 0.0, 0.0)
        self._state: StateEstimate | None = None  # None: no step yet
        self._sensors = artefact.model.sensors
        self._readings = {"readings": 0, "readings_left_out": 0}  # of sensors; by the gate
        engine.loads = []

    def step(self, time: float, base: np.ndarray, temperatures: Mapping[str, float]) -> None:
        engine, dt = self.engine, self.engine.facts.step
        assert engine.loads is not None
        loads, engine.loads = engine.loads, []
        for own in loads:
            one: UncertainLoads = jax.tree.map(lambda a: a[0], UncertainLoads(*own))
            if self._state is None:
                if engine.steps != len(loads):
                    remedy = "it has to learn from the start: add --fresh, or leave it out"
                    raise TwinError("the machine was running before the filter state began", "--learn", remedy)
                self._state = state_filter.begin(self.machine, time - dt * len(loads), engine.initial, one)
            self._state = state_filter.advance(self.machine, self._state, one, dt)
        read = np.array([temperatures.get(name, np.nan) for name in self._sensors])
        known = np.isfinite(read)
        if self._state is not None and known.any():
            self._state, told = self._updater.learn_temperatures(self._state, read, known.astype(float))
            self._readings["readings"] += len(told)
            self._readings["readings_left_out"] += sum(not t.accepted for t in told)
        if self._state is not None and not np.isfinite(self._state.vector).all():
            raise EngineFailure("what the filter has learnt is not finite", "--learn", "start afresh with --fresh")

    def at_poses(self) -> np.ndarray:
        return np.zeros((len(self.machine.G), 3)) if self._state is None else self._updater.at_poses(self._state)

    def learn(
        self, time: float, position: np.ndarray, weights: np.ndarray, displacement: np.ndarray, sigma: float
    ) -> list[dict[str, Any]]:
        assert self._state is not None
        measured = Measurement(time, position, displacement, sigma if sigma > 0.0 else None)
        self._state, told = self._updater.learn_tcp(self._state, measured)
        return [
            {"name": t.name, "innovation_m": t.innovation, "sigma_m": t.sigma, "accepted": t.accepted} for t in told
        ]

    def learnt(self) -> dict[str, Any]:
        """Parameters that have moved by more than their standard deviation as learnt; readings, and those left out."""
        if self._state is None:
            return {}
        at = self.machine.rows
        u, sigma = self._state.extra[at.extra(at.u)], np.linalg.norm(self._state.root[at.u], axis=1)
        moved = {p.path: [float(p.nominal * np.exp(v) if p.scale == "log" else p.nominal + v), float(s)]
                 for p, v, s in zip(self.machine.parameters, u, sigma, strict=True) if abs(v) > s}  # fmt: skip
        return {
            "parameters": moved,
            "readings": self._readings["readings"],
            "readings_left_out": self._readings["readings_left_out"],
        }

    def stored(self) -> dict[str, Any]:
        if self._state is None:
            return {"state": None}
        s = self._state
        leaves = [np.asarray(leaf) for leaf in jax.tree.leaves(s.step)]
        return {
            "state": [_text(leaf) for leaf in leaves],
            "time": s.time,
            "noise_due": s.noise_due,
            "readings": self._readings,
            **{name: _text(getattr(s, name)) for name in _FIELDS},
        }

    def restore(self, told: dict[str, Any]) -> None:
        if "state" not in told:
            raise TwinError("the state is of another way to learn", "--learn", "give the one before, or --fresh")
        if told["state"] is None:
            return
        like = state_filter.begin(self.machine, 0.0, 0.0, jax.tree.map(lambda a: a[0], self._shape))
        shapes, tree = jax.tree.flatten(like.step)
        leaves = [_array(text, np.shape(a)) for text, a in zip(told["state"], shapes, strict=True)]
        step = jax.tree.unflatten(tree, [jax.numpy.asarray(a) for a in leaves])
        fields = {name: _array(told[name], getattr(like, name).shape) for name in _FIELDS}
        self._state = replace(like, time=told["time"], noise_due=told["noise_due"], step=step, **fields)
        self._readings = dict(told["readings"])

    def _any_loads(self) -> UncertainLoads:
        """Of a machine in the middle of its ranges, for the shapes alone."""
        load, dt = self.machine.artefact.model.load_model, self.engine.facts.step
        signals = {s.name: np.full(2, 0.5 * (s.low + s.high)) for s in load.signals}
        return separate_loads(load, evaluate(load, np.array([0.0, dt]), signals, dt, 1), self.engine.substeps)


def _text(array: np.ndarray) -> str:
    return base64.b64encode(np.ascontiguousarray(array, dtype="<f8").tobytes()).decode()


def _array(text: str, shape: tuple[int, ...]) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), dtype="<f8").reshape(shape).copy()

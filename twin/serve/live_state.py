"""The state folder of `twin live`, read and never written: its health record, and the steps of its model since.

What `twin live` keeps is bounded, and so is what is kept here: the last KEPT steps that were seen. Those that the model
made before this server began, or between two looks, are not shown; the journal has their inputs.
"""

from __future__ import annotations

import json
import math
import time
from collections import deque
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from twin.errors import TwinError
from twin.live.health import FORMAT, STEP
from twin.page.machine import machine_told
from twin.page.packed import packed
from twin.page.shape import shape_of
from twin.page.words import flag_words
from twin.rom.artefact import Artefact
from twin.rom.tcp import by_body, tcp_at
from twin.serve.now import Now

KEPT = 1500  # steps: 25 h of a minute each
SILENT = 10.0  # s without a health record, which comes every 2 s: `twin live` has stopped, or hangs


@dataclass(frozen=True)
class Step:
    """A step of the model as `twin live` wrote it."""

    number: int
    time: float  # s, POSIX, by the stamps of the inputs
    temperatures: tuple[float, ...]
    tcp: np.ndarray  # (n_poses, 3) m
    positions: tuple[float, ...]  # m, of the linear axes of the loads
    states: np.ndarray
    flags: tuple[str, ...]


class LiveState:
    """Looks when it is asked."""

    def __init__(self, artefact: Artefact, folder: Path):
        """Raises TwinError where the folder is none of `twin live`, or of another artefact."""
        self.artefact, self.folder = artefact, Path(folder)
        self.shape = shape_of(artefact)
        self.health: dict[str, Any] = {}
        self.steps: deque[Step] = deque(maxlen=KEPT)
        self._epoch = 0.0  # s, POSIX: of the first step seen since `twin live` began
        self._seen = 0  # ns, when step.json was changed
        self._read = 0
        if not self.folder.is_dir():
            raise TwinError("no such folder", str(folder), "give the --state of `twin live`")
        self.look()
        if self.health and self.health.get("artefact") != artefact.digest:
            raise TwinError("the state is of another artefact", str(folder), "give the artefact that `twin live` runs")

    def look(self) -> None:
        """Take in what has changed. A file that cannot be read is left for the next time: it is replaced as a whole."""
        if found := self._changed("health.json", "_read", FORMAT):
            self.health = found
        step = self._step(self._changed("step.json", "_seen", STEP))
        if step is None:
            return
        if self.steps and step.number <= self.steps[-1].number:  # started afresh
            self.steps.clear()
        if not self.steps:
            self._epoch = step.time
        self.steps.append(step)

    def _step(self, found: dict[str, Any] | None) -> Step | None:
        """None where it is damaged, or of another artefact."""
        model = self.artefact.model
        try:
            if found is None or found["artefact"] != self.artefact.digest:
                return None
            tcp = np.array(found["displacements_m"], dtype=float).reshape(len(model.poses), 3)
            step = Step(
                int(found["step"]), float(found["time"]), tuple(map(float, found["temperatures_degC"])),
                tcp[: len(model.poses) - model.scattered], tuple(map(float, found["positions_m"])),
                np.array(found["states"], dtype=float).reshape(model.n), tuple(map(str, found["flags"])),
            )  # fmt: skip
        except (KeyError, TypeError, ValueError):
            return None
        sound = len(step.temperatures) == len(model.all_sensors)
        return step if sound and len(step.positions) == len(model.load_model.axes) else None

    def _changed(self, name: str, when: str, wanted: str) -> dict[str, Any] | None:
        try:
            at = (self.folder / name).stat().st_mtime_ns
            if at == getattr(self, when):
                return None
            told = json.loads((self.folder / name).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        if not isinstance(told, dict) or told.get("format") != wanted:
            return None
        setattr(self, when, at)
        return told

    # ---- for the page ----

    def content(self) -> dict[str, Any]:
        """What does not change while the machine runs."""
        model = self.artefact.model
        middle = int(np.linalg.norm(model.poses - model.poses.mean(axis=0), axis=1).argmin()) if len(model.poses) else 0
        machine = machine_told(self.artefact, self.shape)
        machine["missing"].append(
            f"curves begin when this server did, and hold the last {KEPT} steps that it saw of `twin live`"
        )
        return {
            "version": 1, "mode": "live", "title": f"{model.name}: live", "subtitle": str(self.folder.name),
            "machine": machine, "trust": self.trust(), "flags": [], "facts": self.facts(), "epoch": 0,
            "correction": None, "middle": middle,
        }  # fmt: skip

    def told(self, after: int) -> dict[str, Any]:
        """Health, and the steps after the one with this number; all of them where there is none of it."""
        self.look()
        afresh = not any(s.number == after for s in self.steps)
        newer = [s for s in self.steps if afresh or s.number > after]
        return {
            "trust": self.trust(), "facts": self.facts(), "epoch": self._epoch, "afresh": afresh, "keep": KEPT,
            "flags": [{"name": f, "words": flag_words(f), "steps": 0} for f in (newer or self.steps)[-1].flags]
            if self.steps else [],
            "health": self.health or None, "correction": self._correction(),
            "rows": [
                {"step": s.number, "hours": (s.time - self._epoch) / 3600.0, "outside": bool(s.flags),
                 "temperature": list(s.temperatures), "tcp": packed(s.tcp)}
                for s in newer
            ],
        }  # fmt: skip

    def frame(self, number: int) -> dict[str, Any] | None:
        """The surface at a step; None where the step is none of those kept, or the machine has no surface."""
        step = next((s for s in list(self.steps) if s.number == number), None)  # `look` may add one meanwhile
        if step is None or not self.artefact.fields:
            return None
        model = self.artefact.model
        x = dict(zip((b.name for b in model.bodies), by_body(model, step.states), strict=True))
        temperature = np.concatenate([model.reference_temperature + f.basis @ x[f.body] for f in self.artefact.fields])
        moved, position = np.zeros((len(temperature), 3)), np.zeros(0)
        if self.shape is not None:
            position = self._positions(step, self.shape.structure.axes)
            moved = np.concatenate([u[0] for u in self.shape(step.states[None], position[None])])
        return {"temperature": packed(temperature), "displacement": packed(moved), "position": packed(position)}

    def _positions(self, step: Step, axes: tuple[str, ...]) -> np.ndarray:
        known = dict(zip((a.name for a in self.artefact.model.load_model.axes), step.positions, strict=True))
        return np.array([known.get(a, 0.0) for a in axes])

    def silent(self) -> float:
        """s since the last health record, above what is usual; else 0."""
        age = time.time() - float(self.health.get("written", 0.0))
        return age if age > SILENT else 0.0

    def trust(self) -> dict[str, str]:
        if not self.health:
            return {"level": "no", "line": "no: `twin live` has written no health record here yet"}
        if late := self.silent():
            return {
                "level": "no",
                "line": f"no: `twin live` has written nothing for {_lasting(late)}; it has stopped, or hangs",
            }
        line = str(self.health["trust"])
        return {"level": {"yes": "yes", "wit": "care"}.get(line[:3], "no"), "line": line}

    def facts(self) -> list[str]:
        if not self.health:
            return []
        told = [f"correction: {self.health['mode']}", f"{self.health['input']['records']} records"]
        if self.steps:
            told.append(time.strftime("last step %Y-%m-%d %H:%M:%S", time.localtime(self.steps[-1].time)))
        return told

    def _correction(self) -> dict[str, Any] | None:
        if not self.health:
            return None
        own = self.health["correction"]
        rows = [
            [f"largest of axis {name} ({own['form']})", f"{1e6 * v:.1f} µm"] for name, v in own["largest_m"].items()
        ]
        rows.append(["limits: absolute, slew", f"{1e6 * own['limit_m']:.0f} µm, {1e6 * own['slew_m_per_s']:g} µm/s"])
        rows += [[o["name"], f"{o['failures']} failures {o['error']}".strip()] for o in own["outputs"]]
        cut = "; cut to its absolute limit" if own["cut_to_limit"] else ""
        return {"words": f"{self.health['mode']}: {self.health['words']}{cut}", "rows": rows}

    # ---- for OPC UA ----

    def now(self) -> Now | None:
        self.look()
        if not self.steps or not self.health:
            return None
        step, model = self.steps[-1], self.artefact.model
        actual = np.full(3, math.nan)
        if model.moves:
            actual = tcp_at(model, by_body(model, step.states), self._positions(step, model.pose_axes)[None])[0]
        balance = self.health["model"]["balance_error"]
        return Now(
            time=step.time, step=step.number, temperatures=step.temperatures, tcp=step.tcp, actual=actual,
            trust=self.trust()["line"], mode=self.health["mode"], words=self.health["words"],
            age=float(self.health["input"]["age_s"]) + self.silent(),
            balance=math.nan if balance is None else float(balance), flags=step.flags,
            largest=dict(self.health["correction"]["largest_m"]),
        )  # fmt: skip


def _lasting(seconds: float) -> str:
    return (
        f"{seconds:.0f} s"
        if seconds < 120
        else f"{seconds / 60:.0f} min"
        if seconds < 7200
        else f"{seconds / 3600:.0f} h"
    )

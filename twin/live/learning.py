"""Measured TCP errors on their way to the model: listened for, freed of the offsets, stored, learnt; taken again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from twin.live.facts import Facts
from twin.live.measured import KEPT, Events, Measured, Store, Used
from twin.live.offsets import Form, Values, at

if TYPE_CHECKING:  # NumPy, which a process that learns nothing does not load
    from twin.live.learner import Learner


class Learning:
    """The learner, where its events come from and where those that were used are kept."""

    def __init__(self, facts: Facts, learner: Learner, path: Path | None, folder: Path):
        """path: of events; None: there are none. Raises TwinError where it is neither a file nor a folder."""
        self.facts, self.learner = facts, learner
        self.events = None if path is None else Events(path, facts)
        folder.mkdir(parents=True, exist_ok=True)
        self.store = Store(folder / "measured.jsonl")
        self.count = 0  # learnt
        self.too_old = 0
        self._steps = 0
        self._waiting: list[Measured] = []  # by their clock, the log is not yet there
        self._back = _errors_per_offset(facts)

    def step(self, steps: int, displacements: Sequence[float], temperatures: Mapping[str, float]) -> None:
        """The machine has made so many steps; what had been learnt there before a restart is learnt again."""
        self.learner.step(steps * self.facts.step, displacements, temperatures)
        self._steps = steps
        for used in self.store.used:
            if used.number >= self.count and used.steps <= steps:
                self._learn(used)

    def corrected(self, displacements: Sequence[float]) -> list[float]:
        return self.learner.corrected(displacements)

    def listen(self, shift: float, active: Values | None, form: Form) -> list[dict[str, Any]]:
        """Learn what has come; what became of each.

        shift [s]: from the clock of the log to the time since the machine was started; active: the offsets that go out
        now, which a row measured with them active is freed of.
        """
        told: list[dict[str, Any]] = []
        if self.events is None:
            return told
        rows, self._waiting = sorted([*self._waiting, *self.events.poll()], key=lambda r: r.time), []
        for row in rows:
            time = row.time + shift
            if self.store.has(row):
                continue
            if time > self.learner.newest():
                self._waiting.append(row)
                continue
            if time < self.learner.oldest():
                self.too_old += 1
                continue
            moved = self._uncorrected(row, active, form)
            used = Used(self.count, self._steps, time, row.position, moved, row.sigma, row.time)
            self.store.append(used)
            self._learn(used)
            told.append({"position_m": list(row.position), "learnt": self.learner.told})
        return told

    def _learn(self, used: Used) -> None:
        self.learner.measure(used.time, used.position, used.displacement, used.sigma)
        self.count = used.number + 1

    def _uncorrected(self, row: Measured, active: Values | None, form: Form) -> tuple[float, ...]:
        """Without what the offsets of the axes take away: an offset moves the tool by its axis' share of the error."""
        if not row.corrected or active is None:
            return row.displacement
        own = [at(self.facts, values, form, row.position) for values in active]
        return tuple(d - sum(b * o for b, o in zip(back, own, strict=True))
                     for d, back in zip(row.displacement, self._back, strict=True))  # fmt: skip

    def begun(self) -> None:
        """All of the journal has been taken: what had been learnt later is listened for once more."""
        self.store.keep([u for u in self.store.used if u.number < self.count])

    def clear(self) -> None:
        self.store.clear()

    def stored(self) -> dict[str, Any]:
        if len(self.store.used) > 2 * KEPT:
            self.store.keep(self.store.used[-KEPT:])
        return {"learner": self.learner.stored(), "count": self.count, "too_old": self.too_old, "steps": self._steps}

    def restore(self, told: dict[str, Any]) -> None:
        self.learner.restore(told["learner"])
        self.count, self.too_old, self._steps = told["count"], told["too_old"], told["steps"]

    def health(self) -> dict[str, Any]:
        return {
            "measurements": self.count,
            "too_old": self.too_old,
            "waiting": len(self._waiting),
            "rows_wrong": 0 if self.events is None else self.events.wrong,
            "error": "" if self.events is None else self.events.error,
            "last": self.learner.told,
            "learnt": self.learner.filter.learnt(),
        }


def _errors_per_offset(facts: Facts) -> list[list[float]]:
    """J (3, axes): TCP displacement per offset of each axis, out of offset = -J^+ w."""
    import numpy as np

    found: list[list[float]] = (-np.linalg.pinv(np.array(facts.offset_per_error))).tolist()
    return found

"""Blocks into the machine: placed in time, judged, fed step by step. What comes out depends on the blocks alone.

So the journal, taken again from a checkpoint, gives the same numbers bit by bit. Nothing here reads a clock.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from twin.live.block import Block
from twin.live.condense import condense
from twin.live.drift import Drift
from twin.live.engine import Engine
from twin.live.gate import Gate, Limits
from twin.live.timeline import Timeline

if TYPE_CHECKING:  # a tenth of a start, where nothing is learnt
    from twin.live.learning import Learning

NAN = math.nan


class Intake:
    """The engine and all that is between a block and it."""

    def __init__(
        self,
        engine: Engine,
        limits: tuple[Limits, ...],
        initial: float | None,
        numbered: bool,
        learning: Learning | None = None,
    ):
        """initial [degC]: of the whole machine; None: of the air around it, as first logged."""
        self.learning = learning
        self.engine, self.initial, self.numbered = engine, initial, numbered
        self.timeline, self.gate, self.drift = Timeline(), Gate(engine.facts, limits), Drift()
        self.base: float | None = None  # s, of the timeline: when the machine was started; None: not yet
        self.records = 0
        self.dropped = 0  # records before every channel had a value
        self.measured: dict[str, float] = {}  # degC, last readings
        self.worst_balance = 0.0
        self.wrong: dict[str, str] = {}  # columns that are not used, and why
        self._units = tuple(c.unit for c in engine.facts.channels)
        self._positions = frozenset(engine.facts.axis_channels)
        self._columns: tuple[tuple[str, ...], tuple[str, ...]] | None = None
        self._channels: list[tuple[int, int]] = []  # channel, column
        self._sensors: list[tuple[str, int]] = []

    def take(self, block: Block, each_step: Callable[[], None]) -> None:
        """Feed a block; `each_step` is called after every step of the machine that it completes.

        Raises EngineFailure.
        """
        if (block.names, block.units) != self._columns:
            self._map(block)
        block, begin, gap = self.timeline.place(block, self.numbered)
        n, wide, s = block.records, len(block.names), len(self.engine.facts.channels)
        self.records += n
        if n == 0:
            return
        times = array("d", [begin + i * block.interval for i in range(n)])
        rows = array("d", [NAN]) * (n * s)
        for channel, column in self._channels:
            rows[channel::s] = block.values[column::wide]
        first = self._start(times, rows) if self.base is None else 0
        if self.base is None:
            return
        times, rows = times[first:], rows[first * s :]
        if gap is not None and gap < times[0]:
            times, rows = array("d", [gap]) + times, array("d", [NAN]) * s + rows
        self.gate.pass_rows(times, rows)
        if self.numbered:  # rows without numbers come in groups of any size, which must not matter
            condense(rows, self._units, self._positions, block.interval)
        self._feed(block, times, rows, each_step)

    def _start(self, times: array[float], rows: array[float]) -> int:
        """Start the machine with the first row at which all channels have a value; its index."""
        s = len(self.engine.facts.channels)
        for i in range(len(times)):
            one = rows[i * s : (i + 1) * s]
            self.gate.pass_rows(times[i : i + 1], one)
            if not self.gate.waiting():
                facts = self.engine.facts
                around = facts.air_temperature if facts.air < 0 else self.gate.good[facts.air]
                self.engine.start(around if self.initial is None else self.initial)
                self.base = times[i]
                for k in range(s):
                    rows[i * s + k] = self.gate.good[k] if self.gate.seen[k] else NAN
                return i
            self.dropped += 1
        return len(times)

    def _feed(self, block: Block, times: array[float], rows: array[float], each_step: Callable[[], None]) -> None:
        """In pieces that each complete a step at most, whatever the blocks are."""
        assert self.base is not None
        engine, s, wide = self.engine, len(self.engine.facts.channels), len(block.names)
        step, behind = engine.facts.step, len(times) - block.records  # rows before the block's own: of a gap
        since = array("d", [t - self.base for t in times])
        at = 0
        while at < len(since):
            edge = (engine.steps + 1) * step
            end = at
            while end < len(since) and since[end] < edge - 1e-9 * step:
                end += 1
            end = min(end + 1, len(since))
            done = engine.feed(since[at:end], rows[at * s : end * s])
            row = end - 1 - behind
            for name, column in self._sensors:
                value = block.values[row * wide + column] if row >= 0 else NAN
                if math.isfinite(value):
                    self.measured[name] = value
            at = end
            if done:
                self.worst_balance = max(self.worst_balance, engine.balance())
                self.drift.take(
                    self.measured, dict(zip(engine.facts.sensors, engine.sensors(), strict=True)), done * step
                )
                if self.learning is not None:
                    self.learning.step(engine.steps, engine.displacements(), self.measured)
                self.measured = {}
                each_step()

    def _map(self, block: Block) -> None:
        facts = self.engine.facts
        self._columns = (block.names, block.units)
        self._channels, self._sensors, self.wrong = [], [], {}
        channels = {c.column: k for k, c in enumerate(facts.channels)}
        for column, (name, unit) in enumerate(zip(block.names, block.units, strict=True)):
            if name in channels:
                wanted = facts.channels[channels[name]].unit
                if unit == wanted:
                    self._channels.append((channels[name], column))
                else:
                    self.wrong[name] = f"is in {unit}, not in {wanted}"
            elif name in facts.sensors and unit == "degC":
                self._sensors.append((name, column))

    def errors(self) -> list[float]:
        """What offsets are made of (`Engine.errors`), with what was learnt."""
        errors = self.engine.errors()
        return errors if self.learning is None else self.learning.corrected(errors)

    def stored(self) -> dict[str, Any]:
        return {
            "timeline": self.timeline.stored(), "gate": self.gate.stored(), "drift": self.drift.stored(),
            "base": self.base, "records": self.records, "dropped": self.dropped, "measured": self.measured,
            "worst_balance": self.worst_balance,
            "learning": None if self.learning is None else self.learning.stored(),
        }  # fmt: skip

    def restore(self, told: dict[str, Any]) -> None:
        """The inverse of `stored`; the engine is restored by itself."""
        self.timeline = Timeline(**told["timeline"])
        self.gate.restore(told["gate"])
        self.drift.restore(told["drift"])
        self.base, self.records, self.dropped = told["base"], told["records"], told["dropped"]
        self.measured, self.worst_balance = dict(told["measured"]), told["worst_balance"]
        if self.learning is not None and told.get("learning"):
            self.learning.restore(told["learning"])

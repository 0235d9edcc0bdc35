"""Machines of no physics and sources from a list, for tests of what is around them."""

from __future__ import annotations

import json
import math
from array import array
from collections.abc import Sequence
from pathlib import Path

from twin.live.block import Block
from twin.live.clock import RecordClock
from twin.live.engine import EngineFailure
from twin.live.facts import Axis, Channel, Facts
from twin.live.gate import limits_of
from twin.live.intake import Intake
from twin.live.limiter import Limits
from twin.live.offsets import neutral
from twin.live.publisher import Patience, Publisher
from twin.live.runtime import Keeping, Runtime
from twin.live.sinks import Sent
from twin.live.source import Mark
from twin.logs.resolver import Damaged

CHANNELS = (
    Channel("x_position", "m", True, None, 0.0, 0.5),
    Channel("x_current", "A", True, None, 0.0, 20.0),
    Channel("air", "degC", True, None, 15.0, 30.0),
)
FACTS = Facts(
    machine="scripted", digest="d" * 64, prefix="s", step=60.0, reference_temperature=20.0, channels=CHANNELS,
    axis_channels=(0,), strokes=((0.0, 0.5),), air=2, air_temperature=20.0, sensors=("front", "back", "screw", "air"),
    flags=(), poses=3, all_poses=3, pose_grid=((0.0, 0.25, 0.5),), axes=(Axis("x", 0.25, 0.25, 2),),
    offset_per_error=((-1.0, 0.0, 0.0),), fit=((0.0, 1.0, 0.0), (-0.5, 0.0, 0.5), (0.5, -1.0, 0.5)), certificate="none",
)  # fmt: skip
NAMES, UNITS = tuple(c.column for c in CHANNELS), tuple(c.unit for c in CHANNELS)


class Lag:
    """One heat capacity: its rise follows the square of the current. What matters is its state."""

    facts = FACTS

    def __init__(self) -> None:
        self.start(20.0)

    def start(self, temperature: float) -> None:
        self.told = {"T": temperature, "steps": 0, "last": None, "sum": 0.0, "n": 0}

    def feed(self, times: array, rows: array) -> int:
        before = self.told["steps"]
        for i, t in enumerate(times):
            current = rows[3 * i + 1]
            current = self.told["last"] if math.isnan(current) else current
            while t >= (self.told["steps"] + 1) * FACTS.step:
                mean = self.told["sum"] / max(self.told["n"], 1)
                self.told["T"] += 0.02 * (20.0 + 0.05 * mean - self.told["T"])
                self.told |= {"steps": self.told["steps"] + 1, "sum": 0.0, "n": 0}
            self.told["sum"] += current**2
            self.told["n"] += 1
            self.told["last"] = current
        if not abs(self.told["T"]) < 1000.0:
            raise EngineFailure("temperatures are beyond reason", "engine")
        return self.told["steps"] - before

    @property
    def steps(self) -> int:
        return self.told["steps"]

    def sensors(self) -> list[float]:
        return [self.told["T"]] * 4

    def displacements(self) -> list[float]:
        return [1e-6 * (self.told["T"] - 20.0) * k for k in (1.0, 0, 0, 2.0, 0, 0, 4.0, 0, 0)]

    def errors(self) -> list[float]:
        return self.displacements()

    def states(self) -> list[float]:
        return [self.told["T"]]

    def flags(self) -> list[str]:
        return []

    def balance(self) -> float:
        return 0.0

    def saved(self) -> bytes:
        return json.dumps(self.told).encode()

    def restore(self, saved: bytes) -> None:
        self.told = json.loads(saved)


class Listed:
    """Gives what it is told to, in order; an element may be None: nothing arrives."""

    numbered, speed, error = True, 0.0, ""

    def __init__(self, arrivals: Sequence[Block | Damaged | None], stored: Sequence[Block] = (), numbered: bool = True):
        self.arrivals, self.store, self.numbered = list(arrivals), {b.sequence: b for b in stored}, numbered
        self.at = 0

    @property
    def ended(self) -> bool:
        return self.at >= len(self.arrivals)

    def resume(self, mark: Mark | None) -> None:
        if mark is not None:
            self.at = next(
                (k + 1 for k, a in enumerate(self.arrivals) if isinstance(a, Block) and a.sequence == mark.sequence), 0
            )

    def poll(self, wait: float) -> Sequence[Block | Damaged]:
        if self.ended:
            return ()
        self.at += 1
        found = self.arrivals[self.at - 1]
        return () if found is None else (found,)

    def fetch(self, stream: int, numbers: Sequence[int]) -> Sequence[Block]:
        return [self.store[n] for n in numbers if n in self.store]

    def release(self, held: Sequence[Block]) -> None:
        self.held = held

    def close(self) -> None:
        return


class Kept:
    """A sink that keeps everything, and may be unreachable for a while."""

    name = "kept"

    def __init__(self, last=None):
        self.sent: list[Sent] = []
        self.before = last
        self.away = False

    def last(self):
        return self.before

    def write(self, sent: Sent) -> None:
        if self.away:
            raise ConnectionError("away")
        self.sent.append(sent)

    def close(self) -> None:
        return


def block(sequence: int, values: Sequence[float], time: float | None = None, stream: int = 7, **changed) -> Block:
    """One record every 10 s: position, current, air."""
    told = {"stream": stream, "sequence": sequence, "time": 1e9 + 10.0 * sequence if time is None else time,
            "interval": 10.0, "names": NAMES, "units": UNITS, "values": array("d", values)}  # fmt: skip
    return Block(**told | changed)


def runtime(folder: Path, source: Listed, sink: Kept, limits: Limits | None = None, form="grid", **keeping) -> Runtime:
    limits = limits or Limits(200e-6, 0.2e-6, 1.0)
    publisher = Publisher([sink], neutral(FACTS, form), form, limits, Patience(60.0, 600.0))
    intake = Intake(Lag(), limits_of(FACTS, {}), None, source.numbered)
    return Runtime(intake, source, publisher, RecordClock(), Keeping(folder, **keeping))


def run(folder: Path, source: Listed, sink: Kept | None = None, fresh: bool = False, **more) -> Runtime:
    made = runtime(folder, source, sink or Kept(), **more)
    made.begin(fresh)
    made.run(lambda: False)
    return made

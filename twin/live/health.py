"""The health record: what the process says of itself, as JSON that anything can read. docs/live.md has every key."""

from __future__ import annotations

import json
import os
from collections import deque
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

FORMAT = "twin live health"
STEP = "twin live step"
EVENTS = 1 << 20  # bytes of events.jsonl; one older file is kept
LATENCIES = 1000  # last blocks that percentiles are of


def share(values: list[float], part: float) -> float | None:
    """The smallest value that so large a part of all is not above."""
    return sorted(values)[min(int(part * len(values)), len(values) - 1)] if values else None


@dataclass
class Latency:
    """From a block's arrival to its correction [s], the last ones."""

    last: deque[float] = field(default_factory=lambda: deque(maxlen=LATENCIES))
    longest: float = 0.0

    def take(self, seconds: float) -> None:
        self.last.append(seconds)
        self.longest = max(self.longest, seconds)

    def told(self) -> dict[str, float | None]:
        values = list(self.last)
        return {
            "median_s": share(values, 0.5),
            "percentile_99_s": share(values, 0.99),
            "longest_s": self.longest,
        }


class HealthFiles:
    """health.json and step.json, replaced as a whole, and events.jsonl, a line for every change of mode; bounded."""

    def __init__(self, folder: Path):
        self.health, self.events = folder / "health.json", folder / "events.jsonl"
        self._step = folder / "step.json"

    def write(self, told: dict[str, Any]) -> None:
        _replace(self.health, json.dumps(told, indent=1))

    def step(self, told: dict[str, Any]) -> None:
        """What the model has come to: read by `twin serve`, which draws the machine from it."""
        _replace(self._step, json.dumps({"format": STEP, **told}))

    def event(self, told: dict[str, Any]) -> None:
        if self.events.exists() and self.events.stat().st_size > EVENTS:
            os.replace(self.events, self.events.with_name("events.before.jsonl"))
        with self.events.open("a", encoding="utf-8") as f:
            f.write(json.dumps(told) + "\n")


def _replace(path: Path, text: str) -> None:
    part = path.with_name(f".{path.name}.part")
    part.write_text(text, encoding="utf-8")
    os.replace(part, path)

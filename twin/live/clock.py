"""The publisher's clock: the monotonic one times the speed of a replay, or the time of the records themselves."""

from __future__ import annotations

import time
from typing import Protocol


class Clock(Protocol):
    """Seconds that never go back."""

    def now(self) -> float: ...

    def records(self, until: float) -> None:
        """The records have come to `until` [s of the machine]."""


class RealClock:
    """Of this computer, sped up with a replay."""

    def __init__(self, speed: float = 1.0):
        self.speed = speed

    def now(self) -> float:
        return self.speed * time.monotonic()

    def records(self, until: float) -> None:
        return


class RecordClock:
    """Of a replay as fast as it goes: time passes as records come."""

    def __init__(self) -> None:
        self._now = 0.0

    def now(self) -> float:
        return self._now

    def records(self, until: float) -> None:
        self._now = max(self._now, until)

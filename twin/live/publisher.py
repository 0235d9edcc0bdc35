"""The correction on its way out: follows the model, freezes, goes to neutral, never steps beyond its slew limit.

Every sink has a limiter of its own, which starts from what the sink last took: one that was unreachable for an hour
goes on from where it stood. The publisher is the watchdog too: it needs a word from the model (`alive`) again and
again, and whether none comes because the source is silent, the computation hangs or has died, the outputs freeze and
then go to neutral.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass, field

from twin.live.limiter import Limits, allowed, moved
from twin.live.offsets import Form, Values
from twin.live.sinks import Sent, Sink

MODES = ("starting", "following", "frozen", "to neutral", "neutral")


@dataclass(frozen=True)
class Patience:
    """How old inputs may be [s]."""

    freeze: float = 60.0  # after which the correction stands still
    neutral: float = 600.0  # after which it goes to neutral


@dataclass
class Outlet:
    """A sink and where it stands."""

    sink: Sink
    now: Values
    at: float | None = None  # s, by the publisher's clock, of the last write that succeeded
    failures: int = 0
    error: str = ""


@dataclass
class Publisher:
    """Steps all sinks towards the target; safe to be called from two threads."""

    sinks: Sequence[Sink]
    still: Values  # no correction
    form: Form
    limits: Limits
    patience: Patience
    mode: str = "starting"
    words: str = "no step of the model is complete yet"
    limited: bool = False  # the target is cut to the absolute limit
    count: int = 0
    outlets: list[Outlet] = field(init=False)
    _target: Values | None = None
    _heard: float | None = None  # s, by the clock, of the last sign of life
    _age: float = 0.0  # s: how old the inputs were then
    _why: str = ""
    _rhythm: float = 0.0  # s
    _block: int = -1
    _failed: str = ""
    _lock: threading.RLock = field(default_factory=threading.RLock)

    def __post_init__(self) -> None:
        self.outlets = [Outlet(s, s.last() or self.still) for s in self.sinks]

    def aim(self, target: Values) -> None:
        """What the model wants [m]."""
        with self._lock:
            self._target, self.limited = allowed(target, self.limits, self.form)

    def alive(self, now: float, age: float, why: str, rhythm: float, block: int = -1) -> None:
        """The model has taken something in at `now` [s]; its oldest input is `age` [s] old, because of `why`.

        rhythm [s]: until the next is to come; only later than twice that inputs grow older. block: its number.
        """
        with self._lock:
            self._heard, self._age, self._why, self._rhythm, self._block = now, age, why, rhythm, block

    def fail(self, words: str) -> None:
        """What the model says cannot be: to neutral at once, until the process starts anew."""
        with self._lock:
            self._failed = words

    def age(self, now: float) -> float:
        """Of the inputs [s]."""
        return 0.0 if self._heard is None else self._age + max(now - self._heard - 2.0 * self._rhythm, 0.0)

    def tick(self, now: float) -> None:
        """One step of every sink at `now` [s], by a clock that never goes back."""
        with self._lock:
            target = self._judge(now)
            self.count += 1
            for outlet in self.outlets:
                elapsed = self.limits.period if outlet.at is None else now - outlet.at
                values = outlet.now if target is None else moved(outlet.now, target, elapsed, self.limits, self.form)
                written = time.time()
                until = written + max(5.0, 5.0 * self.limits.period)
                try:
                    outlet.sink.write(Sent(self.count, written, until, self.mode, self.words, values, self._block))
                except (OSError, ValueError) as e:
                    outlet.failures += 1
                    outlet.error = str(e)
                    continue
                outlet.now, outlet.at, outlet.error = values, now, ""
            if self.mode == "to neutral" and all(o.now == self.still for o in self.outlets):
                self.mode = "neutral"

    def _judge(self, now: float) -> Values | None:
        """Where to go: the target, nowhere (None), or neutral; sets mode and words."""
        age = self.age(now)
        silent = self._heard is not None and now - self._heard - 2.0 * self._rhythm > self.patience.freeze
        why = f"nothing has arrived for {age:.0f} s" if silent else self._why
        if self._failed:
            self._to_neutral(self._failed)
            return self.still
        if self._target is None:
            self.mode, self.words = "starting", why or "no step of the model is complete yet"
            return None if age <= self.patience.neutral else self.still
        if age > self.patience.neutral:
            self._to_neutral(f"inputs are {age:.0f} s old ({why}): the correction goes to neutral")
            return self.still
        if age > self.patience.freeze:
            self.mode, self.words = "frozen", f"inputs are {age:.0f} s old ({why}): the correction stands still"
            return None
        self.mode = "following"
        self.words = "follows the model" + (", cut to its absolute limit" if self.limited else "")
        return self._target

    def _to_neutral(self, words: str) -> None:
        there = all(o.now == self.still for o in self.outlets)
        self.mode, self.words = "neutral" if there else "to neutral", words

    def close(self) -> None:
        for outlet in self.outlets:
            outlet.sink.close()

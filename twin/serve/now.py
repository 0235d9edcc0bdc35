"""A machine now, for OPC UA: by the last step of `twin live`, or at the end of a finished run."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np


@dataclass(frozen=True)
class Now:
    """A machine at one time; p poses."""

    time: float  # POSIX s of the step; of a finished run s since its start
    step: int
    temperatures: tuple[float, ...]  # degC, in the order of the sensors
    tcp: np.ndarray  # (p, 3) m, TCP error at the poses; empty where nothing moves the tool
    actual: np.ndarray  # (3,) m, where the axes are; NaN where it is not known
    trust: str
    mode: str  # of the correction: starting, following, frozen, to neutral, neutral; "finished" of a finished run
    words: str
    age: float  # s, of the inputs; NaN where there are none
    balance: float  # of the heat, a share of the throughput; NaN: not known
    flags: tuple[str, ...] = ()
    largest: dict[str, float] = field(default_factory=dict)  # m, largest offset of every axis


class Source(Protocol):
    """Gives the newest."""

    def now(self) -> Now | None:
        """None as long as there is no step."""

"""What is wrong with a temperature channel, as data: found in its own rows, or refuted by all others."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

What = Literal["noise", "rail", "stuck", "leap", "offset", "drift", "swapped"]
MEANS: dict[What, str] = {  # what happened, and what `size` is
    "noise": "is noise; its standard deviation",
    "rail": "rests at a value that it does not leave; that value",
    "stuck": "stands still while others go on; for how long",
    "leap": "reads too much from a time on; by how much",
    "offset": "reads too much throughout; by how much",
    "drift": "drifts linearly to the end of the run; by how much",
    "swapped": "has the name of another one, which has its name; without a size",
}
UNITS: dict[What, str] = {"noise": "K", "rail": "degC", "stuck": "s", "leap": "K", "offset": "K", "drift": "K",
                          "swapped": ""}  # fmt: skip


@dataclass(frozen=True)
class Finding:
    """A channel at fault. SI; times in s since the start of the first of its runs."""

    what: What
    channels: tuple[str, ...]  # two that are swapped, else one
    runs: tuple[int, ...]  # numbers of the runs in which it is at fault
    start: float  # s, in the first of these
    end: float  # s, in the last of these: the end of the run where it lasts
    size: float  # in UNITS; NaN of a swapped pair
    interval: tuple[float, float]  # 95 %; that of the size itself where it is read and not estimated
    statistic: float  # twice a log-likelihood ratio; inf where rows of the run itself show it
    least: float = 0.0  # of the statistic, for a name; 0 where rows of the run itself show it

    @property
    def sized(self) -> bool:
        """Whether a channel reads too much by a size, from some time on or throughout: what can be corrected."""
        return self.what in ("leap", "offset", "drift")

"""Which channels belong together: `x_position`, `x_speed`, `x_current` are of one drive by the first word of a name."""

from __future__ import annotations

import re
from collections.abc import Iterator

from twin.logs.run import Table

PLACES = ("m", "rad")  # units of positions
MOVES = ("m/s", "1/s", "rad/s")  # of speeds
DRIVES = ("A", "N*m", "W", "N")  # of what is measured with noise: never quite constant while something moves
_FIRST = re.compile(r"[A-Za-z]*?\d+|[A-Z]+(?=[_.\-:/ ]|$)|[A-Z]?[a-z]+|[A-Z]+|.")


def owner(name: str) -> str:
    """The first word of a channel's name: "x" of `x_current`, "spindle" of `spindle.speed`, "x1" of `X1_ActSpeed`."""
    match = _FIRST.match(name)
    return (match[0] if match else name).casefold()


def pairs(table: Table, units: tuple[str, ...], others: tuple[str, ...]) -> Iterator[tuple[str, str]]:
    """Channels of one owner, the first in one of `units`, the second in one of `others`."""
    for a, unit in table.units.items():
        if unit in units:
            for b, other in table.units.items():
                if b != a and other in others and owner(a) == owner(b):
                    yield a, b

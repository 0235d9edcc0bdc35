"""What a description would cost to check and build, before anything of that size is allocated.

A zero too many in `divisions`, `segments` or a number of poses is a matter of weeks or of terabytes. The estimates are
rough, to a factor of some; between what a workstation does and what these slips ask for lie several powers of ten.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from twin.errors import Problem
from twin.machine.description import Machine

# A thermal system of 290,000 unknowns takes 1.8 GB and 12 s to factor (decision 0006); the elastic system has three per
# node. Fill and work of nested dissection in three dimensions grow with the powers 4/3 and 2 of the unknowns.
NODES, FACTOR_BYTES, FACTOR_SECONDS = 290e3 / 3.0, 1.8e9, 12.0
# One right-hand side through that factor, of a segment's port: four of them, one thermal and three elastic
SOLVE_SECONDS, SIDES = 0.1, 4
POSE_SECONDS = 0.9 / 720  # exact rows of the TCP displacement of a pose (docs/performance.md)
STATES = 500  # of a reduced machine, to which every pose has three rows
NODES_PER_BYTE = (
    1 / 150.0
)  # of a mesh file: ten-node tetrahedra of binary and text files alike, within a factor of three

MOST_BYTES, MOST_SECONDS = 100e9, 7 * 86_400.0  # beyond: refused. Few workstations have that memory
MUCH_BYTES, MUCH_SECONDS = 16e9, 3_600.0  # beyond: asked about by `twin check`


@dataclass(frozen=True)
class Cost:
    """What one key asks for."""

    where: str
    what: str  # "193,049,001 nodes"
    memory: float  # bytes
    time: float  # s
    remedy: str

    @property
    def shown(self) -> str:
        """ "193,049,001 nodes: some 60 TB of memory and 1.5 years"."""
        return f"{self.what}: some {_bytes(self.memory)} of memory and {_time(self.time)}"


def refused(machine: Machine) -> Iterator[Problem]:
    """Errors for what no computer at hand can build. Entries that are broken (None) are left out."""
    for cost in costs(machine):
        if cost.memory > MOST_BYTES or cost.time > MOST_SECONDS:
            yield Problem(cost.shown, cost.where, cost.remedy)


def asked(machine: Machine) -> Iterator[Problem]:
    """Warnings for what takes a large computer or long."""
    for cost in costs(machine):
        if cost.memory > MUCH_BYTES or cost.time > MUCH_SECONDS:
            remedy = f"{cost.remedy}; leave it if it is meant"
            yield Problem(cost.shown, f"machine.toml: {cost.where}", remedy, warning=True)


def costs(machine: Machine) -> Iterator[Cost]:
    """Of every part, moving contact and grid of poses."""
    nodes = {name: _nodes(machine, name) for name, part in machine.parts.items() if part is not None}
    total = max(float(sum(nodes.values())), 1.0)
    for name, n in nodes.items():
        box = machine.parts[name].box
        where = f"parts.{name}.box.divisions" if box else f"parts.{name}.mesh"
        yield Cost(where, f"{n:,.0f} nodes", *_factor(n), "a coarser mesh: elements of some 20 mm do for most parts")
    for name, contact in machine.contacts.items():
        if contact is None or contact.kind != "moving":
            continue
        ports = float(contact.segments * len({rail for rail, _ in contact.pairs}))
        share = total / NODES
        time = ports * SIDES * SOLVE_SECONDS * share
        what = f"{ports:,.0f} segments"
        yield Cost(f"contacts.{name}.segments", what, 8.0 * SIDES * ports * total, time, "8 to 24 segments are usual")
    count = 1.0
    for name, grid in machine.poses.items():
        if grid is None:
            continue
        count *= grid if isinstance(grid, int) else len(grid)
        what = f"{count:,.0f} poses" + (" of all axes up to this one" if name != next(iter(machine.poses)) else "")
        remedy = "5 positions per axis are usual; between them the TCP error is exact all the same"
        yield Cost(f"poses.{name}", what, count * 3 * STATES * 8.0, count * POSE_SECONDS, remedy)


def _nodes(machine: Machine, part: str) -> float:
    """Nodes of quadratic tetrahedra."""
    entry = machine.parts[part]
    if entry.box is not None:
        return math.prod(2.0 * max(n, 0) + 1.0 for n in entry.box.divisions)
    path = machine.folder / str(entry.mesh)
    return path.stat().st_size * NODES_PER_BYTE if path.is_file() else 0.0


def _factor(nodes: float) -> tuple[float, float]:
    """Bytes and seconds of a direct factorisation of the elastic system."""
    ratio = nodes / NODES
    return FACTOR_BYTES * ratio ** (4.0 / 3.0), FACTOR_SECONDS * ratio**2


def _bytes(value: float) -> str:
    for unit in ("B", "kB", "MB", "GB", "TB"):
        if value < 1000.0:
            return f"{value:.2g} {unit}" if value < 100.0 else f"{value:.0f} {unit}"
        value /= 1000.0
    return f"{value:,.0f} PB"


def _time(seconds: float) -> str:
    for unit, size in (("years", 365.25 * 86_400.0), ("days", 86_400.0), ("h", 3_600.0), ("min", 60.0)):
        if seconds >= size:
            return f"{seconds / size:,.1f} {unit}"
    return f"{seconds:.0f} s"

"""Stretches of which the loads say nothing: the heat there is a guess."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from twin.logs.clocks import gaps_of
from twin.logs.run import Run
from twin.rom.drive import Drive

LEAST = 300.0  # s, one mean of measurements: of less no reading tells
PIECE = 600.0  # s, at most, with a heat of its own: two means of measurements


def unlogged(run: Run, drive: Drive) -> tuple[tuple[int, int], ...]:
    """First step and end of pieces of every stretch of LEAST or more in which a run has no row of its loads: the last
    one before is held there, and nobody knows when the machine went on with something else."""
    found = []
    for begin, end in gaps_of(run.loads):
        if end - begin >= LEAST:
            edges = np.linspace(begin, end, int(np.ceil((end - begin) / PIECE)) + 1)
            steps = np.minimum(np.searchsorted(drive.time, edges), drive.n_steps).tolist()
            found += [(first, last) for first, last in pairwise(steps) if first < last]
    return tuple(found)

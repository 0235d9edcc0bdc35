"""Faults of which rows a log holds: rows of another time."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from twin.errors import LogError
from twin.inject.damage.channels import Damage, marked
from twin.logs.run import Run
from twin.nearest import did_you_mean


def splice(run: Run, d: Damage) -> Run:
    """All that is measured is, from the start of the fault on, what was measured a time of the size [s] later.

    Stamps go on as they were, so the measured tables end earlier by the size. Raises LogError where no row is left
    after the start, and without a start.
    """
    known = ["run", f"runs.{run.folder.resolve().name}"]
    if d.place not in known:
        raise LogError(f"no such place: '{d.place}'", d.place, did_you_mean(d.place, known, "places"))
    if d.start == -math.inf or d.end != math.inf:
        raise LogError("rows of another time begin somewhere, and go on", "--from, --to", "give --from alone")
    temperatures, tcp = run.temperatures, run.tcp
    if temperatures is None and tcp is None:
        raise LogError("nothing is measured", str(run.folder), "take a run with temperatures.csv or tcp.csv")
    if temperatures is not None:
        rows, n = _rows(temperatures.time, d)
        columns = {name: values[rows] for name, values in temperatures.columns.items()}
        table = replace(temperatures, time=temperatures.time[:n], columns=columns)
        run = marked(replace(run, temperatures=table), "temperatures")
    if tcp is not None:
        rows, n = _rows(tcp.time, d)
        sigma = tcp.sigma[rows] if tcp.sigma is not None else None
        angle = {name: values[rows] for name, values in tcp.angle.items()}
        position, displacement = tcp.position[rows], tcp.displacement[rows]
        tcp = replace(
            tcp, time=tcp.time[:n], position=position, displacement=displacement, sigma=sigma, angle=angle
        )  # fmt: skip
        run = marked(replace(run, tcp=tcp), "tcp")
    return run


def _rows(time: np.ndarray, d: Damage) -> tuple[np.ndarray, int]:
    """Which row (n,) stands in place of each that is left, and how many these are."""
    first = int(np.searchsorted(time, d.start))
    later = int(np.searchsorted(time, d.start + d.size))
    if first >= len(time) or later >= len(time):
        raise LogError(
            f"no row {d.size:g} s after {d.start:g} s", "--from, SIZE", "give times within what was measured"
        )
    rows = np.concatenate([np.arange(first), np.arange(later, len(time))])
    return rows, len(rows)

"""What control tables are fitted to and judged by: the axis offsets -J^-1 w over the workspace, and what is left of w.

Sign: an offset is added to the nominal position. A tool that stands 10 um too far along an axis gets -10 um.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np

from twin.run.correction import PoseErrors
from twin.run.correction_axes import offset_matrix, uncorrectable

SAMPLES = 9  # positions per axis that tables are fitted to: twice the cells of the usual five poses

PLACES = 300  # that a table is judged at: the rms of what is left is known to some per cent

Offsets = Callable[[np.ndarray], np.ndarray]  # positions (m, n_axes) m -> what a table adds to them (m, n_axes) m


@dataclass(frozen=True)
class Sampled:
    """The axis offsets on a grid over the poses."""

    axes: tuple[str, ...]
    grid: tuple[np.ndarray, ...]  # m, positions per axis
    position: np.ndarray  # (m, n_axes) m, C order over the grid
    offset: np.ndarray  # (m, n_axes) m


@dataclass(frozen=True)
class Left:
    """The error before and after a table, at the poses and PLACES drawn evenly: of the TCP (3,) [m] per machine
    component, or of struts' lengths (6,) [m]."""

    before: np.ndarray  # largest
    before_rms: np.ndarray  # over the drawn places
    after: np.ndarray
    after_rms: np.ndarray
    uncorrectable: np.ndarray  # largest in directions that no axis moves in: no table can express them

    @property
    def share(self) -> float:
        """rms that is left, as a share of that before, of all components; zero where there was no error."""
        size = float(np.sum(self.before_rms**2))
        return float(np.sqrt(np.sum(self.after_rms**2) / size)) if size > 0.0 else 0.0


def at_poses(errors: PoseErrors, jacobian: np.ndarray) -> Sampled:
    """The offsets at the poses themselves: nothing is solved for."""
    return Sampled(errors.axes, errors.grid, errors.poses, errors.tcp @ offset_matrix(jacobian).T)


def sampled(errors: PoseErrors, jacobian: np.ndarray, samples: int = SAMPLES) -> Sampled:
    """The offsets at `samples` positions over the range of every axis of the poses, where the model knows them.

    Where it knows its poses alone (`errors.at` interpolates) these are the same, smoothly filled in.
    """
    wide = sum(len(g) > 1 for g in errors.grid)
    samples = min(samples, max(2, round(SAMPLES ** (3 / max(wide, 1)))))  # as many in all as of three axes at most
    grid = tuple(np.linspace(g[0], g[-1], samples) if len(g) > 1 else g for g in errors.grid)
    position = np.array(list(product(*grid)))
    return Sampled(errors.axes, grid, position, errors.at(position) @ offset_matrix(jacobian).T)


def left(offsets: Offsets, errors: PoseErrors, jacobian: np.ndarray) -> Left:
    """What stays when `offsets` are added: w(p) + J a. That w changes over the offset itself is nanometres.

    (`twin.run.correction.corrected_error` counts that, too; it doubles the positions to be solved for.)
    """
    low, high = [g[0] for g in errors.grid], [g[-1] for g in errors.grid]
    drawn = np.random.default_rng(0).uniform(low, high, (PLACES, len(low)))
    places = np.concatenate([errors.poses, drawn])
    before = np.concatenate([errors.tcp, errors.at(drawn)])
    after = before + offsets(places) @ jacobian.T

    def largest(values: np.ndarray) -> np.ndarray:
        return np.asarray(np.abs(values).max(axis=0))

    def rms(values: np.ndarray) -> np.ndarray:
        return np.asarray(np.sqrt((values[-PLACES:] ** 2).mean(axis=0)))

    return Left(largest(before), rms(before), largest(after), rms(after), largest(uncorrectable(jacobian, before)))


def told(found: Left) -> list[str]:
    """Lines for the head of a table, um."""
    rows = (
        ("largest TCP error", found.before),
        ("rms", found.before_rms),
        ("largest left by this table", found.after),
        ("rms", found.after_rms),
        ("largest that no axis moves against", found.uncorrectable),
    )
    struts = len(found.before) != 3
    names = [f"strut {k + 1}" for k in range(len(found.before))] if struts else ["dx", "dy", "dz"]
    lines = [
        f"{label + ':':<36} {'  '.join(f'{c} {1e6 * v:.2f}' for c, v in zip(names, values, strict=True))} um"
        for label, values in rows
    ]
    return [*lines, f"left of the rms of all components:   {100.0 * found.share:.1f} %"]

"""Which grid of poses suffices: interpolation between its poses against the structure itself, at random poses.

Paper 000 computes 125 poses, or 27 where memory is short, and leaves open which number is enough (section 4). Poses off
the grid cost no more than those on it (`twin.build.structure`), so the answer is a measurement.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from twin.build.full_model import FullModel
from twin.build.stepper import CoupledStepper
from twin.build.volumetric import grid_points
from twin.errors import LogError
from twin.logs.run import Run
from twin.logs.signals import signal_values
from twin.progress import Progress, silent
from twin.rom.drive import evaluate, measured_air
from twin.rom.poses import Kind, pose_weights
from twin.rom.rest import rest_before

KINDS: tuple[Kind, ...] = ("linear", "lagrange")


def fields_of_run(
    full: FullModel, run: Run, times: Sequence[float], steps: int = 72, progress: Progress = silent
) -> tuple[list[float], list[list[np.ndarray]]]:
    """Times [s] and the full model's temperature fields T - T_ref (n_nodes_b,) [K] per body there, under a run's loads.

    `times` count from the start of the log and are rounded up to one of `steps` equal steps of the run. Long steps are
    meant (10 min of 12 h): the loads enter as exact means over each step, and the integrator damps what is faster; the
    shape of the field, by which a grid of poses is judged, hardly changes. Raises LogError for times outside the log.
    """
    span = float(run.loads.time[-1] - run.loads.time[0])
    for t in times:
        if not 0.0 < t <= span * (1.0 + 1e-9):
            raise LogError(
                f"the log covers {span / 3600:g} h, not {t / 3600:g} h", str(run.folder), "give times within the run"
            )
    dt = span / steps
    wanted = [min(int(np.ceil(t / dt - 1e-6)), steps) for t in times]
    load = full.thermal.load_model
    drive = evaluate(load, run.loads.time, signal_values(run, load.signals), dt, max(wanted))
    stepper = CoupledStepper(full.thermal)
    start = run.initial_temperature
    if start is None:
        start = float(measured_air(load, drive)[0, load.surroundings])
    x = stepper.uniform(start)
    if run.steady_start:
        for _, x, _ in stepper.run(rest_before(drive), x):  # noqa: B007, B020
            pass
    kept: dict[int, list[np.ndarray]] = {}
    with progress("full model", max(wanted)) as advance:
        for step, x, _ in stepper.run(drive, x):  # noqa: B020
            if step + 1 in wanted:
                kept[step + 1] = list(x)
            advance(f"{drive.time[step + 1] / 3600:.1f} h")
    return [n * dt for n in wanted], [kept[n] for n in wanted]


@dataclass(frozen=True)
class GridError:
    """What interpolation between the poses of a grid costs, over random poses, components and load cases."""

    counts: tuple[int, ...]  # equidistant positions per axis, ends of the stroke included
    maximum: Mapping[Kind, float]  # m, per kind of interpolation
    p95: Mapping[Kind, float]  # m, 95 % of all (pose, load case) have no component with a larger error

    @property
    def poses(self) -> int:
        return int(np.prod(self.counts))


@dataclass(frozen=True)
class PoseStudy:
    """Interpolation errors of all grids with 2 to `most` positions per axis."""

    axes: tuple[str, ...]
    case: float  # m: largest component of the TCP error at the random poses, over the load cases
    grids: tuple[GridError, ...]  # fewest poses first

    @property
    def equal(self) -> tuple[GridError, ...]:
        """Grids with the same number of positions on every axis."""
        return tuple(g for g in self.grids if len(set(g.counts)) == 1)

    def smallest(self, tolerance: float, kind: Kind, equal: bool = False) -> GridError | None:
        """The grid with the fewest poses whose largest error is within `tolerance` [m]; None where there is none."""
        candidates = self.equal if equal else self.grids
        fit = [g for g in candidates if g.maximum[kind] <= tolerance]
        return min(fit, key=lambda g: (g.poses, g.maximum[kind]), default=None)


def study_grids(
    axes: Sequence[str],
    strokes: Sequence[tuple[float, float]],
    tcp: Callable[[np.ndarray], np.ndarray],
    random: int = 200,
    most: int = 7,
    seed: int = 0,
) -> PoseStudy:
    """Interpolation errors of every grid with 2 .. `most` equidistant positions per axis, against `tcp` itself.

    strokes: (low, high) [m] per axis; tcp: positions (n, n_axes) [m] to displacements (n_cases, n, 3) [m], as
    `twin.build.volumetric.displacements` gives them. `random` poses are drawn uniformly within the strokes. Grids share
    positions (1/2 = 2/4 of a stroke), so `tcp` is asked once at the union of them. "lagrange" turns into "cubic" beyond
    `twin.rom.poses.MOST_LAGRANGE` positions.
    """
    low, high = np.array(strokes, dtype=float).T
    drawn = np.random.default_rng(seed).uniform(low, high, (random, len(low)))
    exact = tcp(drawn)
    share = np.unique([k / (n - 1) for n in range(2, most + 1) for k in range(n)])
    nodes = [a + (b - a) * share for a, b in zip(low, high, strict=True)]
    table = tcp(grid_points(nodes)).reshape(len(exact), *(len(share),) * len(low), 3)
    grids = []
    for counts in product(range(2, most + 1), repeat=len(low)):
        index = [np.searchsorted(share, np.arange(n) / (n - 1)) for n in counts]
        values = table[np.ix_(np.arange(len(exact)), *index, np.arange(3))].reshape(len(exact), -1, 3)
        grid = [axis[i] for axis, i in zip(nodes, index, strict=True)]
        worst = {kind: _errors(grid, drawn, values, exact, kind) for kind in KINDS}
        grids.append(
            GridError(
                counts,
                {kind: float(e.max()) for kind, e in worst.items()},
                {kind: float(np.quantile(e, 0.95)) for kind, e in worst.items()},
            )
        )
    grids.sort(key=lambda g: (g.poses, g.counts))
    return PoseStudy(tuple(axes), float(np.abs(exact).max(initial=0.0)), tuple(grids))


def _errors(
    grid: Sequence[np.ndarray], drawn: np.ndarray, values: np.ndarray, exact: np.ndarray, kind: Kind
) -> np.ndarray:
    """Largest component (n_fields, n_drawn) [m] of the interpolation error."""
    weights, _ = pose_weights(grid, drawn, kind)
    return np.abs(weights @ values - exact).max(axis=2)

"""Which grid of poses suffices, and how much of the volumetric error is a shift."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from twin.errors import DescriptionError
from twin.face.inputs import Quantity, positive, run_of
from twin.face.machine import Machine, warn
from twin.progress import Progress, reporter

if TYPE_CHECKING:
    from twin.build.pose_study import GridError, PoseStudy
    from twin.build.volumetric import Shares
    from twin.logs.run import Run


@dataclass(frozen=True)
class PoseOptions:
    """How grids are compared."""

    tolerance: Quantity = "1 um"  # interpolation error allowed at any pose
    at: Sequence[Quantity] = ()  # times in the run; six equal parts by default
    random: int = 200  # random poses
    most: int = 7  # positions per axis
    steps: int = 72  # of the full model over the run
    seed: int = 0  # of the random poses


@dataclass(frozen=True)
class Poses:
    """A study of grids, and the load cases it was made with."""

    study: PoseStudy
    tolerance: float  # m
    random: int
    times: list[float]  # s, of the load cases
    sizes: list[float]  # m, their largest TCP errors
    shares: list[Shares]

    @property
    def suffices(self) -> bool:
        """Whether any grid keeps the tolerance."""
        return any(self.study.smallest(self.tolerance, kind) for kind in ("linear", "lagrange"))

    def facts(self) -> dict[str, Any]:
        """JSON values (SI)."""
        return facts(self.study, self.tolerance, self.random, self.times, self.sizes, self.shares)


def poses(
    machine: Machine | str | Path,
    run: Run | str | Path,
    options: PoseOptions | None = None,
    progress: Progress | bool | None = None,
) -> Poses:
    """Which pose grid of a machine suffices for the loads of a run, measured at random poses with the full model.

    Raises DescriptionError for a machine without linear axes or with struts, TwinError for one without a TCP.
    """
    import numpy as np

    from twin.build.pipeline import full_model
    from twin.build.pose_study import fields_of_run, study_grids
    from twin.build.volumetric import displacements, grid_points, volumetric_shares
    from twin.face.still import refuse_still

    o, report = options or PoseOptions(), reporter(progress)
    allowed = positive("tolerance", o.tolerance, "m")
    asked = [positive("at", time, "s") for time in o.at]
    loaded = warn(machine)
    described = loaded.description
    log = run_of(run)
    span = float(log.loads.time[-1] - log.loads.time[0])
    full = full_model(described, report)
    refuse_still(full.thermal)
    structure = full.structure
    strokes = [described.axes[a].stroke for a in structure.axes]
    if not strokes:
        what = "has no linear axis, so there is one pose only"
        where = str(machine) if isinstance(machine, str | Path) else str(loaded.path)
        raise DescriptionError(what, where, "nothing to be found out here")
    if described.tcp.platform is not None:
        where = str(machine) if isinstance(machine, str | Path) else str(loaded.path)
        what = "grids over the lengths of six struts are too many to be tried"
        raise DescriptionError(what, where, "`twin correction` tells what is left between the poses of [poses]")
    times, fields = fields_of_run(full, log, asked or [span * k / 6 for k in range(1, 7)], o.steps, report)
    even = grid_points([np.linspace(low, high, 5) for low, high in strokes])
    errors = displacements(structure, even, fields)
    study = study_grids(
        structure.axes, strokes, lambda p: displacements(structure, p, fields), o.random, o.most, o.seed
    )
    sizes = [float(np.abs(error).max()) for error in errors]
    return Poses(study, allowed, o.random, times, sizes, [volumetric_shares(even, error) for error in errors])


def facts(
    study: PoseStudy, tolerance: float, count: int, times: list[float], sizes: list[float], shares: list[Shares]
) -> dict[str, Any]:
    """Load cases, grids, and the smallest that suffice, as JSON values (SI)."""

    def row(g: GridError | None) -> dict[str, Any] | None:
        if g is None:
            return None
        return {"counts": list(g.counts), "poses": g.poses, "max_m": dict(g.maximum), "p95_m": dict(g.p95)}

    return {
        "axes": list(study.axes),
        "random_poses": count,
        "tolerance_m": tolerance,
        "case_m": study.case,
        "load_cases": [
            {
                "time_s": t,
                "max_tcp_error_m": size,
                "shares": None if size == 0.0 else {"shift": s.shift, "linear": s.linear, "higher": s.higher},
            }
            for t, size, s in zip(times, sizes, shares, strict=True)
        ],
        "grids": [row(g) for g in study.grids],
        "smallest": {
            kind: {
                "equal": row(study.smallest(tolerance, kind, equal=True)),
                "any": row(study.smallest(tolerance, kind)),
            }
            for kind in ("linear", "lagrange")
        },
    }

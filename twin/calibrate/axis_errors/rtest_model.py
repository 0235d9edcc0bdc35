"""The axis errors of a result of `twin run`: what R-tests would find on the model, and how far they explain it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from twin.calibrate.axis_errors.chain import Chain
from twin.calibrate.axis_errors.errors import Ranges
from twin.calibrate.axis_errors.field import FieldShares, field_shares
from twin.calibrate.axis_errors.fit import AxisErrorFit, fit_axis_errors
from twin.calibrate.axis_errors.rtest import Measurement, Readings
from twin.errors import TwinError
from twin.ordinary import ordinary
from twin.rom.hdf5_file import strings
from twin.rom.poses import pose_weights
from twin.run.results import FORMAT


@dataclass(frozen=True)
class PoseHistory:
    """Computed TCP displacements at all poses; n + 1 step edges."""

    time: np.ndarray  # (n + 1,) s, as in the loads
    axes: tuple[str, ...]
    poses: np.ndarray  # (n_poses, n_axes) m, C order over a grid
    tcp: np.ndarray  # (n + 1, n_poses, 3) m
    where: str

    def at(self, time: float) -> np.ndarray:
        """(n_poses, 3) [m], linear between the steps. Raises TwinError outside the computed time [s]."""
        first, last = float(self.time[0]), float(self.time[-1])
        if not first <= time <= last:
            what = f"computed from {first / 3600:.2f} to {last / 3600:.2f} h, measured at {time / 3600:.2f} h"
            raise TwinError(what, self.where, "run the model over the whole run folder")
        k = min(int(np.searchsorted(self.time, time, side="right")) - 1, len(self.time) - 2)
        share = (time - self.time[k]) / (self.time[k + 1] - self.time[k])
        return np.asarray((1.0 - share) * self.tcp[k] + share * self.tcp[k + 1])


@dataclass(frozen=True)
class ModelErrors:
    """What one measurement would find on the model."""

    fit: AxisErrorFit
    shares: FieldShares  # over all poses
    outside: int  # rows beyond the poses, where the model gives the error at their border


def read_pose_history(path: Path) -> PoseHistory:
    """From a result.h5, or the folder that holds it. Raises TwinError for other files."""
    path = Path(path)
    path = path / "result.h5" if path.is_dir() else path
    remedy = "give the folder of: twin run ARTEFACT RUN -o FOLDER"
    try:
        with h5py.File(ordinary(path), "r") as f:
            if f.attrs.get("format") != FORMAT:
                raise TwinError("not a result of `twin run`", str(path), remedy)
            return PoseHistory(
                f["time"][...], strings(f["pose_axis"]), f["pose_position"][...], f["tcp"][...], str(path)
            )
    except (OSError, KeyError) as e:
        raise TwinError("not a result of `twin run`", str(path), remedy) from e


def model_errors(
    history: PoseHistory, chain: Chain, read: Readings, found: Sequence[Measurement]
) -> tuple[ModelErrors | None, ...]:
    """Per measurement the errors of the computed displacements at its poses, in the middle of its time.

    They go through the same fit, with the places of the ball known: a model knows where it is. None where a measurement
    has too few rows. Raises TwinError for poses of other axes, and measurements outside the computed time.
    """
    letters = [name.upper() for name in history.axes]
    if sorted(letters) != sorted(a.letter for a in chain.linear):
        what = f"its poses are of {', '.join(history.axes) or 'no axis'}, the chain is {chain}"
        raise TwinError(what, history.where, "give a result of the same machine")
    columns = [letters.index(a.letter) for a in chain.linear]  # of the poses, by axis of the chain
    grid = tuple(np.unique(p) for p in history.poses.T)
    ranges = Ranges.of(chain, read.position)
    told: list[ModelErrors | None] = []
    for measurement in found:
        if measurement.fit is None:
            told.append(None)
            continue
        part = measurement.readings
        tcp = history.at(float(part.time[[0, -1]].mean()))
        weights, outside = pose_weights(grid, part.position[:, np.argsort(columns)])
        fit = fit_axis_errors(chain, ranges, part.position, weights @ tcp)
        told.append(ModelErrors(fit, field_shares(chain, history.poses[:, columns], tcp), int(outside.sum())))
    return tuple(told)

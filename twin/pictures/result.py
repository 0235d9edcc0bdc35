"""What the pictures need of a result.h5, read with h5py alone."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from twin.errors import TwinError
from twin.rom.artefact import Artefact
from twin.rom.hdf5_file import strings
from twin.together import open_result


@dataclass(frozen=True)
class Drawn:
    """A result, n + 1 step edges."""

    hours: np.ndarray  # (n + 1,) h since the start
    sensors: tuple[str, ...]
    temperature: np.ndarray  # (n + 1, n_sensors) degC
    axes: tuple[str, ...]
    position: np.ndarray  # (n + 1, n_axes) m
    pose_axes: tuple[str, ...]
    poses: np.ndarray  # (n_poses, n_pose_axes) m
    tcp: np.ndarray  # (n + 1, n_poses, 3) m
    tcp_actual: np.ndarray  # (n + 1, 3) m
    flags: np.ndarray  # (n, n_flags) bool: the step was outside what was certified
    flag_names: tuple[str, ...]
    states: np.ndarray  # (n + 1, N) artefact coordinates
    angle: np.ndarray  # (n + 1, n_turning) rad of rotary axes
    run: str = ""  # folder of the loads, as summary.json names it; "" where that is not known

    @property
    def outside(self) -> np.ndarray:
        """(n + 1,) bool: the step that ends here was flagged."""
        return np.concatenate([[False], self.flags.any(axis=1)])

    def at(self, hours: float) -> int:
        """The edge nearest to a time [h]."""
        return int(np.abs(self.hours - hours).argmin())

    @property
    def middle(self) -> int:
        """The pose nearest to the middle of the grid."""
        return int(np.linalg.norm(self.poses - self.poses.mean(axis=0), axis=1).argmin())

    def position_at(self, edge: int) -> dict[str, float]:
        return dict(zip(self.axes, self.position[edge].tolist(), strict=True))


def read_result(folder: Path, artefact: Artefact) -> Drawn:
    """The result in `folder`. Raises TwinError where there is none, or none of this artefact."""
    path = Path(folder) / "result.h5"
    remedy = "make it with: twin run ARTEFACT RUN -o OUT"
    if not path.is_file():
        raise TwinError("no result here", str(path), remedy)
    try:
        with open_result(path) as (file, told), h5py.File(file, "r") as f:
            if f.attrs.get("artefact") != artefact.digest:
                raise TwinError("a result of another artefact", str(path), remedy)
            return Drawn(
                hours=(f["time"][...] - f["time"][0]) / 3600.0,
                sensors=strings(f["sensor"]),
                temperature=f["temperature"][...],
                axes=strings(f["axis"]),
                position=f["position"][...],
                pose_axes=strings(f["pose_axis"]),
                poses=f["pose_position"][...],
                tcp=f["tcp"][...],
                tcp_actual=f["tcp_actual"][...],
                flags=f["flags"][...].astype(bool),
                flag_names=strings(f["flag"]),
                states=f["states"][...],
                angle=f["angle"][...] if "angle" in f else np.zeros((len(f["time"]), 0)),
                run=str(told.get("run", "")),
            )
    except (OSError, KeyError) as e:
        raise TwinError("not a readable result of `twin run`", str(path), remedy) from e

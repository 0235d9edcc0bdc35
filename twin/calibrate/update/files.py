"""What an update leaves: update.h5 (base, correction, uncertainty, innovations), tcp.csv and summary.json."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from twin.atomic import atomic_path
from twin.calibrate.score.metrics import figures
from twin.calibrate.score.prequential import HoldLast, prequential
from twin.calibrate.update.program import Updated
from twin.logs.run import Tcp
from twin.logs.write import write_tcp
from twin.rom.hdf5_file import put, put_attributes, scale, writing
from twin.run.results import refuse_run_folder

FORMAT = "twin update"
AXES = ("dx", "dy", "dz")
COVERED = 1.96  # standard deviations of a normal distribution that hold 95 %


def coverage(updated: Updated, rows: np.ndarray, noise: float) -> float | None:
    """Share of the measured components in `rows` (m,) bool inside the predicted 95 % interval, their own noise [m]
    included where the run does not tell it. None where the method predicts none."""
    residual = updated.measured[rows] - updated.predicted[rows]
    own = np.where(np.isfinite(updated.row_sigma[rows]), updated.row_sigma[rows], noise)
    sigma = np.hypot(updated.predicted_sigma[rows], own[:, None])
    known = np.isfinite(residual) & np.isfinite(sigma)
    return float(np.mean(np.abs(residual[known]) <= COVERED * sigma[known])) if known.any() else None


def summary(updated: Updated, noise: float) -> dict[str, Any]:
    """Figures as JSON values: every row of tcp.csv predicted before it was used, by all that could predict it.

    "after_first": without what comes before the first used measurement, where no update can know anything. hold_last
    is told what the update was told. noise [m]: of rows without a sigma.
    """
    held = HoldLast()
    seen = np.where(updated.used[:, None], updated.measured, np.nan)
    last = prequential(held, updated.row_time, updated.row_position, seen)
    first = updated.row_time[updated.used].min(initial=np.inf)
    after = updated.row_time > first
    by = {"update": updated.predicted, "base": updated.predicted_base, "hold_last": last}
    sigma = np.where(np.isfinite(updated.row_sigma), updated.row_sigma, noise)
    accepted, rejected = dict[str, int](), dict[str, int]()
    for t in updated.told:
        counted = accepted if t.accepted else rejected
        counted[t.name] = counted.get(t.name, 0) + 1
    return {
        "method": updated.method,
        "rows": len(updated.row_time),
        "counted_from_s": updated.reference,
        "used": int(updated.used.sum()),
        "measurement_times_s": updated.row_time[updated.used].tolist(),
        "asked_s": list(updated.asked),
        "largest_correction_m": np.abs(updated.correction).max(axis=(0, 1)).tolist(),
        "largest_step_of_correction_m": float(np.abs(np.diff(updated.correction, axis=0)).max()),
        "coverage_95": coverage(updated, np.ones(len(updated.row_time), dtype=bool), noise),
        "accepted": accepted,
        "rejected": rejected,
        "rejected_tcp": [
            {"time_s": t.time, "axis": t.name, "innovation_m": t.innovation, "sigma_m": t.sigma}
            for t in updated.told
            if t.name in AXES and not t.accepted
        ],
        "before_assimilating": {
            part: {name: _scores(updated.measured[rows], values[rows], sigma[rows]) for name, values in by.items()}
            for part, rows in (("all", np.ones_like(after)), ("after_first", after))
            if rows.any()
        },
    }


def _scores(measured: np.ndarray, predicted: np.ndarray, sigma: np.ndarray) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for a, name in enumerate(AXES):
        known = np.isfinite(measured[:, a])
        if known.any():
            found[name] = asdict(figures(measured[known, a], predicted[known, a], sigma[known]))
    whole = np.isfinite(measured).all(axis=1)
    if whole.any():
        found["vector"] = asdict(figures(measured[whole], predicted[whole], sigma[whole]))
    return found


def write_update(folder: Path, updated: Updated, facts: Mapping[str, Any], noise: float) -> dict[str, Any]:
    """Write all files, each whole or not at all; returns the summary, led by `facts`.

    Raises TwinError if a file cannot be written, and for run folders.
    """
    folder = Path(folder)
    refuse_run_folder(folder)
    told = {**facts, **summary(updated, noise)}
    with writing(folder / "update.h5") as f:
        put_attributes(f, {"format": FORMAT, "method": updated.method})
        scale(f, "time", updated.time, "s", "step edges")
        scale(f, "row", np.arange(len(updated.row_time)), "", "rows of tcp.csv inside the loads' time")
        scale(f, "component", ("x", "y", "z"))
        scale(f, "pose", np.arange(updated.base.shape[1]))
        put(f, "base", updated.base, "m", ("time", "pose", "component"), "TCP error of the untouched model")
        put(f, "correction", updated.correction, "m", ("time", "pose", "component"), "to be added to it")
        put(f, "tcp", updated.tcp, "m", ("time", "component"), "updated TCP error at the actual position")
        put(f, "sigma", updated.sigma, "m", ("time", "component"), "standard deviation of its error")
        put(f, "row_time", updated.row_time, "s", ("row",))
        put(f, "measured", updated.measured, "m", ("row", "component"))
        put(f, "predicted", updated.predicted, "m", ("row", "component"), "before the row was used")
        put(f, "predicted_sigma", updated.predicted_sigma, "m", ("row", "component"), "of its error")
        put(f, "used", updated.used.astype(np.uint8), "", ("row",), "1: assimilated; 0: only predicted")
        scale(f, "told", np.arange(len(updated.told)), "", "scalar measurements in the order of assimilation")
        put(f, "told_name", [t.name for t in updated.told], "", ("told",))
        for name, unit in (("time", "s"), ("innovation", "m or K"), ("sigma", "m or K")):
            put(f, f"told_{name}", np.array([getattr(t, name) for t in updated.told]), unit, ("told",))
        put(f, "told_accepted", np.array([t.accepted for t in updated.told], dtype=np.uint8), "", ("told",))
    with atomic_path(folder / "tcp.csv") as path:
        axes = tuple(str(a) for a in facts.get("pose_axes", ()))
        write_tcp(path, Tcp(updated.time, axes, updated.position, updated.tcp))
    with atomic_path(folder / "summary.json") as path:
        path.write_text(json.dumps(told, indent=2) + "\n", encoding="utf-8")
    return told

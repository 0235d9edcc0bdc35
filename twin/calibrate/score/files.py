"""score.json and score.csv: every figure of a score, SI."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from twin.atomic import atomic_path
from twin.calibrate.score.bootstrap import Difference
from twin.calibrate.score.metrics import Figures
from twin.calibrate.score.score import Entry, Score, Settings


def score_json(score: Score, settings: Settings, facts: Mapping[str, Any]) -> dict[str, Any]:
    """JSON values; temperatures in K, deviations in m. Undefined or unquotable figures are null."""
    return {
        **facts,
        "settings": {
            "step_s": settings.dt,
            "substeps": settings.substeps,
            "segments_restart": settings.restart,
            "tcp_uncertainty_m": settings.tcp_sigma,
            "temperature_uncertainty_K": settings.temperature_sigma,
            "hold_last_interval_s": settings.interval,
            "inputs": list(settings.inputs),
        },
        "runs": [asdict(run) for run in score.runs],
        "not_scored_inputs_of_the_model": list(score.air),
        "baselines": dict(score.known),
        "model_minus_best_baseline": {
            part: {"baseline": score.best[part], **_told(found)} for part, found in score.difference.items()
        },
        "model_minus_regression": {part: _told(found) for part, found in score.regression.items()},
        "figures": [_entry(e) for e in score.entries],
    }


def write_score(folder: Path, told: Mapping[str, Any], score: Score) -> None:
    """Write score.json (what `score_json` made) and score.csv. Raises TwinError if a file cannot be written."""
    with atomic_path(folder / "score.json") as path:
        path.write_text(json.dumps(told, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    columns = ["part", "run", "segment", "output", "method", "unit", *(f.name for f in fields(Figures))]
    with atomic_path(folder / "score.csv") as path, open(path, "w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(columns)
        for e in score.entries:
            row = _entry(e)
            table.writerow(["" if row[c] is None else row[c] for c in columns])


def _entry(e: Entry) -> dict[str, Any]:
    unit = "K" if e.kind == "temperature" else "m"
    names = {"part": e.part, "run": e.run, "segment": e.segment, "output": e.output or "all", "method": e.method}
    return {**names, "unit": unit, **asdict(e.figures)}


def _told(found: Difference) -> dict[str, Any]:
    return {
        "rms_difference_m": found.value,
        "interval_95_m": None if found.low is None else [found.low, found.high],
        "block_rows": found.block,
        "rows": found.rows,
    }

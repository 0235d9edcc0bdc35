"""Golden diagnoses: `python -m tests.golden.verdicts FILE`, pinned (`pinned`): trials of tests/hidden and a lumped
machine. The lumped one is asked of the command line; with the trials come the thresholds that they share.
"""

from __future__ import annotations

import json
import math
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from tests.golden.compute import Values, command, flat, numbers
from tests.hidden.found import QUICK, Said, made_detector, said
from twin.build.workers import each
from twin.diagnose.search.detector import Detector

LUMPED = Path(__file__).parents[1] / "diagnose" / "four_nodes"
TRIALS = (  # nothing is hidden in the first two
    "null_0", "null_law", "heat_source", "joint", "zone", "misplaced_source", "sensor_offset", "sensor_drift",
    "sensor_swapped", "coarse_model",
)  # fmt: skip
HOURS = 8
LEVELS = np.array([0.0, 1.0, 0.6, 0.6, 0.0, 1.0, 0.3, 0.8, 0.8])  # of the lumped machine's load, an hour each


def trial_values(name: str, told: Said) -> Values:
    """What is said of a trial."""
    answer = {"verdict": told.verdict, "part": told.part, **_causes([asdict(c) for c in told.causes])}
    return dict(flat({name: answer}, "trials"))


def threshold_values(detector: Detector) -> Values:
    """What all trials are compared with."""
    return dict(flat({family: numbers(value) for family, value in detector.thresholds.items()}, "trials.thresholds"))


def lumped_values(folder: Path) -> Values:
    """Reports of a lumped machine with nothing hidden, and with heat at its column."""
    artefact, day = folder / "four.h5", _day(folder / "day")
    noise = ("--noise", "0.1 K", "--tcp-noise", "1 um")
    command("build", LUMPED, "-o", artefact)
    command("hide", "heat_source", "column", "40 W", LUMPED, "-o", folder / "hidden")
    values: dict[str, Any] = {}
    for name, machine, seed in (("nothing", LUMPED, 1), ("heat", folder / "hidden", 2)):
        command("simulate", machine, day, "-o", folder / name, *noise, "--seed", seed)
        target = folder / f"report_{name}"
        command("diagnose", artefact, folder / name, "-o", target, "--nulls", 20, "--no-build")
        told = json.loads((target / "report.json").read_text(encoding="utf-8"))
        values[name] = {
            "verdict": told["verdict"],
            **_causes(told["causes"]),
            **{key: {k: numbers(v) for k, v in told[key].items()} for key in ("thresholds", "observed")},
            "pulls": {p["path"]: numbers([p["pull"], p["sigma"]], 1.0) for p in told["pulls"]},
            "limits": [[limit["family"], limit["place"]] for limit in told["detection_limits"]],
            "smallest": numbers([limit["size"] for limit in told["detection_limits"]]),
        }
    return dict(flat(values, "lumped"))


def _day(folder: Path) -> Path:
    """Levels of load in an air that swings."""
    folder.mkdir()
    t = np.arange(0.0, 3600.0 * HOURS + 1.0, 60.0)
    level = LEVELS[(t // 3600.0).astype(int)]
    air = 20.0 + 1.5 * np.sin(2.0 * np.pi * t / (9.0 * 3600.0))
    rows = np.column_stack([t, 5000.0 * level, 14.0 * np.sqrt(level), air])
    lines = ["time [s],speed [1/min],current [A],air [degC]", *(",".join(f"{v:.6g}" for v in row) for row in rows)]
    (folder / "loads.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    facts = (
        'sampling = "60 s"',
        'provenance = "made for a test"',
        'synthetic = ["loads"]',
        'initial_temperature = "20 degC"',
    )
    (folder / "run.toml").write_text("\n".join(facts) + "\n", encoding="utf-8")
    return folder


def _causes(causes: list[dict[str, Any]]) -> Values:
    """Family, place and history of every cause, what rivals it, and its numbers."""
    names = ("family", "place", "history", "unit", "signal", "exponent")
    return {
        "causes": [[c[n] for n in names] for c in causes],
        "rivals": [[[r["family"], r["place"], r["history"]] for r in c["rivals"]] for c in causes],
        **{
            f"cause_{k}": {
                "size": numbers([c["amplitude"], *c["ci95"]]),
                "statistic": numbers([c["statistic"], c["threshold"]]),
                "windows": numbers([[w["start"], w["end"]] for w in c["windows"]]),
                "levels": numbers([w["level"] for w in c["windows"]]),
                "settings": _settings(c["settings"]),
            }
            for k, c in enumerate(causes)
        },
    }


def _settings(settings: Mapping[str, float | str]) -> Values:
    return {k: numbers(v) if isinstance(v, float) and math.isfinite(v) else v for k, v in settings.items()}


def main(target: str) -> None:
    with tempfile.TemporaryDirectory() as temporary:
        values = lumped_values(Path(temporary))
    values |= threshold_values(made_detector(QUICK))
    for name, told in zip(TRIALS, each(said, QUICK, TRIALS, long=0.0), strict=True):
        values |= trial_values(name, told)
    Path(target).write_text(json.dumps(values), encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])

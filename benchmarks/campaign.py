"""Effects hidden in data and looked for, hundreds of times: `python -m benchmarks.campaign [MINUTES [FIRST]]`."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cache, lru_cache
from itertools import groupby
from pathlib import Path

import numpy as np

from benchmarks.five_axis import EXPERIMENT, machine
from benchmarks.rows import Row, read
from twin.atomic import atomic_path
from twin.build.spread import spread
from twin.calibrate.fit.measured import Measured, measured
from twin.diagnose.evidence.whiten import measured_of
from twin.diagnose.faults.catalogue import FAMILIES
from twin.diagnose.model.study import with_measured
from twin.diagnose.pipeline import Settings, prepare
from twin.diagnose.search.accepted import settled
from twin.diagnose.search.detector import Detector
from twin.diagnose.search.excused import other_search
from twin.diagnose.search.gain import predicted
from twin.diagnose.search.limits import limits_at, limits_of
from twin.diagnose.search.look import Search
from twin.diagnose.search.verdict import unknown_of, verdict_of, with_faults
from twin.inject.draw.trial import draw
from twin.inject.hidden import Hidden, Trial
from twin.inject.judge.items import Item, items
from twin.inject.judge.match import known_of, place_of
from twin.inject.judge.page import page
from twin.progress import bar

OUT = Path("out/campaign")
NOISE = 0.08  # K
SETTINGS = Settings(temperature_sigma=NOISE)
FIRST = 5800  # seed of the first of the stored trials; fresh ones begin behind those looked at (docs/campaign.md)
CATALOGUE = tuple(f.name for f in FAMILIES)
KNOWN = known_of(EXPERIMENT, CATALOGUE, [f.name for f in FAMILIES if f.group in ("machine", "signal")])


@cache
def made_detector() -> Detector:
    """The nominal machine's, on the loads of the three runs, as `twin diagnose` makes it."""
    trial = draw(EXPERIMENT, "null", 1.0, 0)
    return prepare(machine(), trial.runs[:2], trial.runs[2:], SETTINGS)[0]


@cache
def limits() -> dict[tuple[str, str, str, bool], float]:
    """What a diagnosis of these runs states as its limits, place by place."""
    return limits_at(made_detector())


def limit(hidden: Hidden) -> float | None:
    """At the place of a hidden thing, in its unit; None where diagnoses have none."""
    unit = "K/day" if hidden.unit == "K/s" else hidden.unit
    place = place_of(asdict(hidden))
    at = [limits().get((hidden.family, unit, place, w)) for w in (bool(hidden.windows), False)]
    return next((size for size in at if size is not None), None)


def judged(detector: Detector, trial: Trial) -> Row:
    """One trial: what was hidden, what was said, and what it was worth on the sealed run (of a null nothing)."""
    began = time.perf_counter()
    found, _, own = other_search(detector, trial.runs)
    verdict, causes = with_faults(*verdict_of(found, FAMILIES), own.faults)
    unknown = unknown_of(found) if verdict == "unknown" else None
    seconds, plan = time.perf_counter() - began, own.plans[2]
    without = bare(trial.name, trial.seed) if trial.hidden else None
    return {
        "family": trial.name,
        "factor": trial.factor,
        "seed": trial.seed,
        "truth": [asdict(h) for h in trial.hidden],
        "verdict": verdict,
        "causes": [
            {"family": c.family, "place": c.place, "history": c.history, "amplitude": c.amplitude, "ci95": c.ci95,
             "unit": c.unit, "statistic": c.statistic, "threshold": c.threshold,
             "rivals": [(r.family, r.place) for r in c.rivals]}
            for c in causes
        ],
        "unknown": None if unknown is None else [unknown.part, unknown.surface, unknown.statistic],
        "evidence": max(found.steps[0].parts.values()),
        "observed": found.steps[0].observed,
        "limits": [limit(h) for h in trial.hidden],
        "present": _distance(detector, own.y, without.y) if without else 0.0,
        "variance": [*variance(found, plan.temperature, plan.tcp), without.variance] if without else None,
        "seconds": seconds,
    }  # fmt: skip


def _distance(detector: Detector, y: np.ndarray, without: np.ndarray) -> float:
    """Sum of squares of what is hidden, in units of noise; infinite where it changes what was measured at all."""
    return float(np.nansum((detector.whiten(y) - detector.whiten(without)) ** 2)) if len(y) == len(without) else np.inf


def plans_of(detector: Detector, trial: Trial) -> list[Measured]:
    """What was measured in the three runs of a trial."""
    study = detector.study
    return [
        measured(study.probed.base, run, p.run.drive, p.run.name) for run, p in zip(trial.runs, study.runs, strict=True)
    ]


def variance(found: Search, temperature: np.ndarray, tcp: np.ndarray) -> tuple[float, float]:
    """Mean square of the sealed run's residuals in units of the channels' noise: recalibrated, extended."""
    models = predicted(found, len(found.detector.study.fitted))
    result = [_variance(found.detector, flat, temperature, tcp) for flat in (models.recalibrated, models.extended)]
    return result[0], result[1]


@dataclass(frozen=True)
class Bare:
    """The machine, air and noise of a trial without what is hidden there."""

    y: np.ndarray  # (m,)
    variance: float  # of the sealed run, recalibrated: what no extension can be better than


@lru_cache(maxsize=1)  # for the three sizes of a trial
def bare(family: str, seed: int) -> Bare:
    detector, trial = made_detector(), draw(EXPERIMENT, family, 1.0, seed, hidden=False)
    study, plans = detector.study, plans_of(detector, trial)
    y, last = measured_of(with_measured(study, plans)), len(study.fitted)
    x, _ = settled(detector, y, ())
    return Bare(y, _variance(detector, study.outputs(last, x), plans[last].temperature, plans[last].tcp))


def _variance(detector: Detector, flat: np.ndarray, temperature: np.ndarray, tcp: np.ndarray) -> float:
    sensors, probe = detector.whiten.channels[0]
    T, w = detector.study.runs[len(detector.study.fitted)].split(flat)
    parts = [((temperature - T) / sensors.sigma).ravel(), ((tcp - w) / probe.sigma).ravel()]
    return float(np.nanmean(np.concatenate(parts) ** 2))


def _several(deadline: float, trials: Sequence[Item]) -> list[Row]:
    """A row per trial. deadline: as `time.time` counts; what comes later is left for the next time."""
    rows = []
    for family, factor, seed in trials:
        if time.time() > deadline:
            break
        try:
            result = judged(made_detector(), draw(EXPERIMENT, family, factor, seed))
        except Exception as e:  # a trial that fails is a result, too
            result = {"family": family, "factor": factor, "seed": seed, "error": f"{type(e).__name__}: {e}"}
        rows.append(result)
    return rows


def _kept(rows: Sequence[Row]) -> None:
    OUT.mkdir(parents=True, exist_ok=True)
    with (OUT / f"trials-{os.getpid()}.jsonl").open("a", encoding="utf-8") as f:
        f.writelines(json.dumps(row) + "\n" for row in rows)


def _item(row: Row) -> Item:
    return row["family"], row["factor"], row["seed"]


def results(first: int = FIRST) -> list[Row]:
    """The trials from this seed on that were made; of one that is in several files, the last file's by name."""
    rows = [row for path in sorted(OUT.glob("trials-*.jsonl")) for row in read(path)]
    found = {_item(r): r for r in rows}
    return [found[item] for item in items(EXPERIMENT, CATALOGUE, first) if item in found]


def main(minutes: float = float("inf"), first: int = FIRST) -> None:
    detector = made_detector()
    made = set(map(_item, results(first)))
    todo = [i for i in items(EXPERIMENT, CATALOGUE, first) if i not in made]
    deadline = time.time() + 60.0 * minutes
    pieces = [list(sizes) for _, sizes in groupby(todo, key=lambda item: (item[0], item[2]))]
    with bar("campaign", len(pieces)) as advance:

        def done(piece: list[Item], rows: list[Row]) -> None:
            _kept(rows)
            advance(f"{piece[0][0]} of seed {piece[0][2]}")

        spread(_several, deadline, pieces, done)
    text = page(results(first), limits_of(detector), KNOWN, EXPERIMENT.folder.name)
    print(text, flush=True)
    with atomic_path(OUT / "tables.md") as temporary:
        temporary.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    import sys

    from benchmarks.campaign import main as called  # helpers import functions by the name of their module

    given = sys.argv[1:]
    called(float(given[0]) if given else float("inf"), int(given[1]) if len(given) > 1 else FIRST)

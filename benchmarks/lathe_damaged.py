"""A real lathe with one temperature channel damaged, through all of `twin diagnose` and `twin calibrate`.

Needs the measured data (TWIN_MEASURED_DATA) and says so where there are none. The twin is models/lathe, which misses by
1 K, calibrated as its README does. In a pair of days one of 21 channels of one day is damaged (two where they are
swapped), as `benchmarks.lathe_channels` does; a channel that the description reads as air is damaged in loads.csv, too:
it is one reading. The pair goes through a whole diagnosis, and through a calibration of the machine as first described,
which is held against the same with the days as measured.

`python -m benchmarks.lathe_damaged HALF PAIRS`: pairs of days 1, 3, 5 ... (0) or 2, 4, 6 ... (1), each damaged in the
six ways, one after the other. A row per trial goes to out/lathe_damaged/HALF_PAIR_KIND.json; those that are there are
not made again.
"""

from __future__ import annotations

import sys
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache, partial
from pathlib import Path

import numpy as np

import twin
from benchmarks.lathe_channels import ALWAYS, KINDS, RIGHT, Trial
from benchmarks.lathe_diagnosis import DAYS, pairs_of, the_twin
from benchmarks.lathe_diagnosis import OUT as TWIN
from benchmarks.rows import Row, kept
from models.measured import VARIABLE, measured_data
from twin.diagnose.pipeline import Settings, diagnose, machine_of
from twin.diagnose.result.diagnosis import Cause
from twin.inject.damage.channels import with_load
from twin.logs.read import read_run
from twin.logs.run import Run
from twin.rom.artefact import read_artefact

OUT = TWIN.parent / "lathe_damaged"
PAIRS = 10  # per half: 60 trials
FORM, NULLS = 16, 20  # synthetic measurements: what the twin leaves decides anyway
DAMAGES = {name: draw for name, draw in KINDS.items() if name != ALWAYS}
# what a diagnosis calls each kind of damage, as the beginning of the history of its first cause
SAID = {"noise": ("noise",), "rail": ("rail",), "leap": ("leap", "a leap"), "offset": ("an offset",),
        "drift": ("a drift",), "stuck": ("stuck",), "swapped": ("names",)}  # fmt: skip

FIGURES = ("sensor", "channel", "kind", "size", "alone", "unmoved")
MOVED = 1.0  # posterior standard deviations


def main() -> None:
    data = measured_data("lathe")
    if data is None:
        print(f"   not run: no measured data; set {VARIABLE} to the folder that holds lathe")
        return
    given = [int(a) for a in sys.argv if a.isdigit()]
    pairs = given[1] if len(given) > 1 else PAIRS
    path = the_twin(data)
    for half in given[:1] or [0, 1]:
        rows = [row for k, days in enumerate(pairs_of(half, pairs)) for row in _rows(path, half, k, days)]
        print(f"   days {DAYS[half]}: {len(rows)} trials")
        told(rows)


def _rows(path: Path, half: int, pair: int, days: Sequence[str]) -> list[Row]:
    """The six trials of a pair of days; those that were made are read."""
    runs = [read_run(TWIN / "runs" / day) for day in days]
    clean = cache(lambda: fitted(runs))

    def made(number: int, name: str) -> list[Row]:
        trial = _drawn(np.random.default_rng([half, pair, number]), runs, DAMAGES[name])
        return [{"kind": name, **_made(path, trial, days, clean())}]

    return [
        row for number, name in enumerate(DAMAGES)
        for row in kept(OUT / f"{half}_{pair}_{number}.json", partial(made, number, name))
    ]  # fmt: skip


def _drawn(
    rng: np.random.Generator, runs: Sequence[Run], draw: Callable[[np.random.Generator, Sequence[Run]], Trial | None]
) -> Trial:
    """Damage that is worth the name."""
    while (trial := draw(rng, runs)) is None:
        pass
    return replace(trial, runs=[_as_driven(run) for run in trial.runs])


def _as_driven(run: Run) -> Run:
    """The run whose loads have the same readings as its temperatures, where a channel is in both."""
    assert run.temperatures is not None
    for name in set(run.loads.columns) & set(run.temperatures.columns) if run.synthetic else ():
        run = with_load(run, name, np.interp(run.loads.time, run.temperatures.time, run.temperatures.columns[name]))
    return run


def _made(path: Path, trial: Trial, days: Sequence[str], clean: dict[str, tuple[float, float]]) -> Row:
    """What a diagnosis and a calibration of the damaged runs say."""
    began = time.perf_counter()
    bad = [day for day, told in zip(days, trial.days, strict=True) if told.startswith("*")]
    row: Row = {"days": list(days), "damaged": bad, "kind_of": trial.kind}
    row |= {"channels": list(trial.channels), "size": None if np.isnan(trial.size) else trial.size}
    try:
        artefact = read_artefact(path)
        result = diagnose(artefact, machine_of(artefact, path), trial.runs, (), Settings(form=FORM, nulls=NULLS))
        row |= judged(trial, result.diagnosis.verdict, result.diagnosis.causes)
        after = fitted(trial.runs)
        prior = {p: abs(after[p][0] - pull) for p, (pull, _) in clean.items()}
        posterior = {p: prior[p] / sigma for p, (_, sigma) in clean.items()}
        worst = max(posterior, key=lambda p: posterior[p])
        row |= {"worst": worst, "sigmas": posterior[worst], "prior_sigmas": max(prior.values())}
        row |= {"moved": posterior[worst] >= MOVED}
    except Exception:  # a traceback is a figure of its own
        row["traceback"] = traceback.format_exc()
    return row | {"seconds": round(time.perf_counter() - began)}


def judged(trial: Trial, verdict: str, causes: Sequence[Cause]) -> Row:
    """Which of the figures of a diagnosis are as they should be."""
    own = [c for c in causes if c.family == "sensor" and set(_channels(c)) & set(trial.channels)]
    first = own[0] if causes and causes[0] in own else None
    right = first is not None and set(_channels(first)) <= set(trial.channels)
    sized = any(abs(c.amplitude - trial.size) <= RIGHT * abs(trial.size) for c in own)
    if trial.kind == "swapped":
        sized = any(set(_channels(c)) == set(trial.channels) for c in own)
    return {
        "verdict": verdict, "causes": [[c.family, c.place, c.history, c.amplitude, c.unit] for c in causes],
        "channel": right, "kind_right": first is not None and first.history.startswith(SAID[trial.kind]),
        "sized": right and sized, "alone": len(own) == len(causes),
    }  # fmt: skip


def _channels(cause: Cause) -> list[str]:
    return cause.place.removeprefix("sensors.").split("<>")


def fitted(runs: Sequence[Run]) -> dict[str, tuple[float, float]]:
    """Of every parameter of the machine as first described, fitted to runs: how many prior standard deviations from its
    rough value, and its posterior standard deviation in prior ones."""
    found = twin.calibrate(TWIN / "rough.h5", runs, progress=False)
    return {r["path"]: (r["pull"], (1.0 - r["learned"]) ** 0.5) for r in found.facts["parameters"]}


def told(rows: Sequence[Row]) -> None:
    """Every trial that is not as it should be, and how many are, by kind of damage."""
    for r in rows:
        if not all(_as_it_should(r)):
            size = "" if r["size"] is None else f" {r['size']:.3g}"
            said = r.get("traceback") or f"{r['verdict']} {r['causes']}, {r['worst']} moves {r['sigmas']:.2f} sigma"
            print(f"      {r['days']}, {r['damaged']} {r['kind_of']} {r['channels']}{size}: {said}")
    print(f"   {'':40}" + "".join(f"{name:>9}" for name in FIGURES))
    for name in (*DAMAGES, "all"):
        own = [r for r in rows if name in (r["kind"], "all")]
        counts = np.sum([_as_it_should(r) for r in own], axis=0) if own else np.zeros(len(FIGURES), dtype=int)
        print(f"   {name:40}" + "".join(f"{c:9}" for c in counts) + f" of {len(own)}")
    for key, of in (("sigmas", "its posterior"), ("prior_sigmas", "the prior")):
        moves = [r[key] for r in rows if key in r]
        if moves:
            middle, most = np.quantile(moves, [0.5, 0.95])
            print(f"   standard deviations of {of} by which a parameter moves most: {middle:.2f}, in 95 % < {most:.2f}")
    seconds = np.mean([r["seconds"] for r in rows])
    print(f"   tracebacks: {sum('traceback' in r for r in rows)}; {seconds:.0f} s a trial")


def _as_it_should(r: Row) -> list[bool]:
    """One for each of FIGURES."""
    if "traceback" in r:
        return [False] * len(FIGURES)
    return [r["verdict"] == "sensor", r["channel"], r["kind_right"], r["sized"], r["alone"], not r["moved"]]


if __name__ == "__main__":
    main()

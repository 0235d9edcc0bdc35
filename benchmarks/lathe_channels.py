"""One temperature channel of a real lathe damaged in two or three of its runs: is it named, and its size told.

Needs the measured data (TWIN_MEASURED_DATA) and says so where there are none. Thresholds were chosen on days 1, 3, 5
...; the others were judged once. `python -m benchmarks.lathe_channels 0 12` takes the first half alone and 12 trials of
each kind; `... 1 34 detail` tells every trial of the other that went wrong.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from models.measured import VARIABLE
from models.recordings import lathe_days, lathe_run
from twin.calibrate.channels.finding import Finding
from twin.calibrate.channels.judge import judged
from twin.calibrate.channels.readings import emptied
from twin.inject.damage.channels import Damage
from twin.inject.damage.kinds import damaged
from twin.logs.faults.fault import Fault
from twin.logs.run import Run

TRIALS = 34  # of each kind: 204 in all, and three times as many clean pairs
# of 1 K resolution: witnesses, not among the 21; as the files and as run folders call them
MOTORS = ("Spindle Motor", "X Motor", "Z Motor", "spindle_motor", "x_motor", "z_motor")
RIGHT = 0.2  # of a size
SEEN = 2.0  # K rms by which two swapped channels differ, and
MOVES = 1.0  # K that a stuck one should have moved at least: what is less does no harm


@dataclass(frozen=True)
class Trial:
    """Runs with one damaged channel, and the truth."""

    runs: list[Run]
    days: tuple[str, ...]
    kind: str
    channels: tuple[str, ...]
    size: float


def main() -> None:
    given = [int(a) for a in sys.argv if a.isdigit()]
    halves, trials = given[:1] or [0, 1], given[1] if len(given) > 1 else TRIALS
    detail = "detail" in sys.argv
    for half in halves:
        paths = lathe_days()[half::2]
        if not paths:
            print(f"   not run: no measured data; set {VARIABLE} to the folder that holds lathe")
            return
        runs = [lathe_run(p) for p in paths]
        print(f"   {('thresholds chosen on', 'judged on')[half]} {len(runs)} days")
        rng = np.random.default_rng(half)
        clean(np.random.default_rng(100 + half), runs, 3 * trials, detail)
        print(f"   {trials} trials each{'':26}channel   size  others blamed")
        total = np.zeros(4, dtype=int)
        for name, draw in KINDS.items():
            figures = row(rng, runs, draw, trials, detail)
            total += figures if name != ALWAYS else 0
            shown(name, figures)
        shown(f"all but the one that says '{ALWAYS}'", total)


def clean(rng: np.random.Generator, runs: Sequence[Run], number: int, detail: bool) -> None:
    """Pairs of days without damage: how many have a channel named."""
    pairs = [tuple(int(k) for k in rng.choice(len(runs), 2, replace=False)) for _ in range(number)]
    named = 0
    for pair in pairs:
        told = judged([alone(runs[k]) for k in pair])
        named += bool(told.findings)
        if detail and told.findings:
            print(f"      {[runs[k].provenance for k in pair]}: {[words(f) for f in told.findings]}")
        for k, f in told.splices:
            if detail:
                print(f"      {runs[pair[k]].provenance}: splice from line {f.first_row + 2}")
    print(f"   {number} clean pairs: a channel named in {named}")


def row(
    rng: np.random.Generator, runs: Sequence[Run], draw: Callable[[np.random.Generator, Sequence[Run]], Trial | None],
    trials: int, detail: bool,
) -> np.ndarray:  # fmt: skip
    """Trials, channel right, size right, trials with another channel named."""
    figures = np.zeros(4, dtype=int)
    while figures[0] < trials:
        trial = draw(rng, runs)
        if trial is None:
            continue
        found = judged([alone(run) for run in trial.runs]).findings
        own = [f for f in found if set(f.channels) & set(trial.channels)]
        right = bool(found) and set(found[0].channels) <= set(trial.channels)
        sized = right and any(abs(f.size - trial.size) <= RIGHT * abs(trial.size) for f in own)
        if trial.kind == "swapped":
            sized = right and set(own[0].channels) == set(trial.channels)
        others = any(not set(f.channels) & set(trial.channels) for f in found)
        figures += [1, right, sized, others]
        if detail and not (right and sized and not others):
            print(f"      {trial.days} {trial.kind} {trial.channels} {trial.size:.3g}: {[words(f) for f in found]}")
    return figures


_ALONE: dict[int, tuple[Run, tuple[Run, tuple[Fault, ...]]]] = {}  # days as they are come again in every trial


def alone(run: Run) -> tuple[Run, tuple[Fault, ...]]:
    """What a run shows by itself."""
    if run.synthetic:  # damaged
        return emptied(run)
    if id(run) not in _ALONE:
        _ALONE[id(run)] = (run, emptied(run))
    return _ALONE[id(run)][1]


def shown(name: str, figures: np.ndarray) -> None:
    n, right, sized, others = figures
    print(f"   {name:40}{right:5} of {n}{sized:6}{others:8}", flush=True)


def words(f: Finding) -> str:
    return f"{f.what} {'/'.join(f.channels)} runs {f.runs} from {f.start / 3600:.2f} h {f.size:.3g} ({f.statistic:.0f})"


def _chosen(rng: np.random.Generator, runs: Sequence[Run]) -> tuple[list[Run], int, str, float]:
    """Two or three runs, which of them is damaged, in which channel, and from when on [s]."""
    picked = [runs[int(k)] for k in rng.choice(len(runs), min(int(rng.integers(2, 4)), len(runs)), replace=False)]
    k = int(rng.integers(len(picked)))
    table = picked[k].temperatures
    assert table is not None
    name = str(rng.choice([n for n in table.columns if n not in MOTORS]))
    return picked, k, name, float(table.time[0] + rng.uniform(0.1, 0.6) * np.ptp(table.time))


def _size(rng: np.random.Generator, low: float, high: float) -> float:
    """Log-uniform, of either sign."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))) * rng.choice([-1.0, 1.0]))


def _trial(runs: list[Run], damages: dict[int, Damage], size: float, kind: str, channels: tuple[str, ...]) -> Trial:
    days = tuple(("*" if k in damages else "") + r.provenance for k, r in enumerate(runs))
    return Trial(
        [damaged(r, damages[k]) if k in damages else r for k, r in enumerate(runs)], days, kind, channels, size
    )


def _breaks(rng: np.random.Generator, runs: Sequence[Run]) -> Trial:
    picked, k, name, start = _chosen(rng, runs)
    noise = rng.random() < 0.5
    size = abs(_size(rng, 3.0, 30.0)) if noise else float(rng.choice([-200.0, -40.0, 0.0, 130.0, 850.0]))
    kind = "noise" if noise else "rail"
    return _trial(picked, {k: Damage("sensor", f"sensors.{name}", size, kind, start=start)}, size, kind, (name,))


def _leaps(rng: np.random.Generator, runs: Sequence[Run]) -> Trial:
    """In one run, or from then on in all that follow."""
    picked, k, name, start = _chosen(rng, runs)
    size = _size(rng, 2.0, 20.0)
    damages = {k: Damage("sensor", f"sensors.{name}", size, "offset", start=start)}
    if rng.random() < 0.5:
        damages |= {i: Damage("sensor", f"sensors.{name}", size, "offset") for i in range(k + 1, len(picked))}
    return _trial(picked, damages, size, "leap", (name,))


def _offset(rng: np.random.Generator, runs: Sequence[Run]) -> Trial:
    picked, k, name, _ = _chosen(rng, runs)
    size = _size(rng, 3.0, 20.0)
    return _trial(picked, {k: Damage("sensor", f"sensors.{name}", size, "offset")}, size, "offset", (name,))


def _always(rng: np.random.Generator, runs: Sequence[Run]) -> Trial:
    picked, _, name, _ = _chosen(rng, runs)
    size = _size(rng, 3.0, 20.0)
    damages = {i: Damage("sensor", f"sensors.{name}", size, "offset") for i in range(len(picked))}
    return _trial(picked, damages, size, "offset", (name,))


def _drifts(rng: np.random.Generator, runs: Sequence[Run]) -> Trial:
    picked, k, name, start = _chosen(rng, runs)
    size = _size(rng, 2.0, 10.0)
    begins = {"start": start} if rng.random() < 0.5 else {}
    return _trial(picked, {k: Damage("sensor", f"sensors.{name}", size, "drift", **begins)}, size, "drift", (name,))


def _stuck(rng: np.random.Generator, runs: Sequence[Run]) -> Trial | None:
    picked, k, name, start = _chosen(rng, runs)
    size = float(rng.uniform(3600.0, 7200.0))
    table = picked[k].temperatures
    assert table is not None
    during = table.columns[name][(table.time >= start) & (table.time < start + size)]
    if np.ptp(during - during[0]) < MOVES:
        return None
    return _trial(picked, {k: Damage("sensor", f"sensors.{name}", size, "stuck", start=start)}, size, "stuck", (name,))


def _swapped(rng: np.random.Generator, runs: Sequence[Run]) -> Trial | None:
    picked, k, name, start = _chosen(rng, runs)
    table = picked[k].temperatures
    assert table is not None
    other = str(rng.choice([n for n in table.columns if n != name and n not in MOTORS]))
    begins = {"start": start} if rng.random() < 0.5 else {}
    during = table.time >= begins.get("start", -np.inf)
    if np.sqrt(np.mean((table.columns[name] - table.columns[other])[during] ** 2)) < SEEN:
        return None
    damage = Damage("sensor", f"sensors.{name}", np.nan, "swapped", other=f"sensors.{other}", **begins)
    return _trial(picked, {k: damage}, np.nan, "swapped", (name, other))


ALWAYS = "offset of 3 .. 20 K in all runs"
KINDS: dict[str, Callable[[np.random.Generator, Sequence[Run]], Trial | None]] = {
    "breaks: noise of 3 .. 30 K, or a rail": _breaks,
    "leaps by 2 .. 20 K": _leaps,
    "offset of 3 .. 20 K in one run": _offset,
    "drifts by 2 .. 10 K": _drifts,
    "is stuck for 1 .. 2 h": _stuck,
    "is swapped": _swapped,
    ALWAYS: _always,
}


if __name__ == "__main__":
    main()

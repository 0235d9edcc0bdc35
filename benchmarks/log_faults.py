"""Faults planted into real recordings: how many `twin check` finds in the right channel, and what else it says.

Needs the measured data (TWIN_MEASURED_DATA) and says so where there are none. The thresholds were chosen on one half of
the recordings, days 1, 3, 5 ... of a lathe and hours 0 to 16 of a spindle; the other half was looked at afterwards, and
one rule added for what it showed (docs/run_folder.md).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from models.measured import VARIABLE
from models.recordings import lathe_days, lathe_run, spindle_run
from twin.inject.damage.channels import COMPONENTS, Damage
from twin.inject.damage.kinds import damaged
from twin.logs.faults.fault import Fault
from twin.logs.faults.find import faults_of
from twin.logs.run import Run

CASES = 100  # of each kind and half
ZEROED = 10e-6  # m, that a probe shows before it is set to zero
SPINDLE = 16.0  # h, of each half of its recording
ALL = ("noise", "rail", "leap", "rezero", "splice", "stuck", "offset", "offset_or_warm")


Told = tuple[str, tuple[str, ...], int]


@dataclass(frozen=True)
class Planted:
    """A kind of fault: what is drawn, and as what it may be told."""

    what: str
    draw: Callable[[np.random.Generator, Run, str, float], Damage]  # of a channel, from a time on [s]
    told: tuple[str, ...]
    of_tcp: bool = False
    throughout: bool = False  # has no line


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """Either sign."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))) * rng.choice([-1.0, 1.0]))


def _other(rng: np.random.Generator, run: Run, name: str) -> str:
    assert run.temperatures is not None
    return f"sensors.{rng.choice([n for n in run.temperatures.columns if n != name])}"


def _zeroed(rng: np.random.Generator, run: Run, name: str, start: float) -> Damage:
    """At the first row from a time on at which the probe shows 10 um or more; if there is none, where it shows most."""
    assert run.tcp is not None
    shows = np.where(run.tcp.time >= start, np.abs(run.tcp.displacement[:, COMPONENTS.index(name)]), 0.0)
    row = int(np.argmax(shows >= ZEROED)) if shows.max() >= ZEROED else int(np.argmax(shows))
    return Damage("measurement", f"tcp.{name}", 0.0, "rezero", start=float(run.tcp.time[row]))


KINDS = (
    Planted(
        "breaks: noise of 3 .. 30 K",
        lambda rng, run, n, t: Damage("sensor", f"sensors.{n}", abs(_log_uniform(rng, 3, 30)), "noise", start=t),
        ("noise",),
    ),
    Planted(
        "breaks: -200, -40, 0, 130 or 850 degC",
        lambda rng, run, n, t: Damage(
            "sensor", f"sensors.{n}", float(rng.choice([-200, -40, 0, 130, 850])), "rail", start=t
        ),
        ("rail",),
    ),
    Planted(
        "leaps by 2 .. 20 K",
        lambda rng, run, n, t: Damage("sensor", f"sensors.{n}", _log_uniform(rng, 2, 20), "offset", start=t),
        ("leap",),
    ),
    Planted(
        "offset of 3 .. 20 K from the start",
        lambda rng, run, n, t: Damage("sensor", f"sensors.{n}", _log_uniform(rng, 3, 20), "offset"),
        ("offset", "offset_or_warm"),
        throughout=True,
    ),
    Planted(
        "drifts by 1 .. 10 K",
        lambda rng, run, n, t: Damage("sensor", f"sensors.{n}", _log_uniform(rng, 1, 10), "drift"),
        ALL,
        throughout=True,
    ),
    Planted(
        "is stuck for 1 .. 2 h",
        lambda rng, run, n, t: Damage("sensor", f"sensors.{n}", rng.uniform(3600, 7200), "stuck", start=t),
        ("stuck",),
    ),
    Planted(
        "is swapped from a time on",
        lambda rng, run, n, t: Damage("sensor", f"sensors.{n}", np.nan, "swapped", other=_other(rng, run, n), start=t),
        ("leap",),
    ),
    Planted(
        "rows of 0.5 .. 2 h later",
        lambda rng, run, n, t: Damage("signal", "run", rng.uniform(1800, 7200), "splice", start=t),
        ("splice",),
    ),
    Planted(
        "probe leaps by 10 .. 100 um",
        lambda rng, run, n, t: Damage("not_thermal", f"tcp.{n}", 1e-6 * _log_uniform(rng, 10, 100), "step", start=t),
        ("leap", "rezero"),
        of_tcp=True,
    ),
    Planted(
        "probe is set to zero, 10 um off",
        _zeroed,
        ("rezero",),
        of_tcp=True,
    ),
    Planted(
        "probe is stuck for 1 .. 2 h",
        lambda rng, run, n, t: Damage("measurement", f"tcp.{n}", rng.uniform(3600, 7200), "stuck", start=t),
        ("stuck",),
        of_tcp=True,
    ),
)


def main() -> None:
    for half, name in enumerate(("thresholds chosen on", "judged on")):
        runs = recordings(half)
        if not runs:
            print(f"   not run: no measured data; set {VARIABLE} to the folder that holds lathe and spindle_drift")
            return
        print(f"   {name} {len(runs)} recordings")
        known = [{told(f) for f in faults_of(run)} for run in runs]
        clean(runs)
        print(f"   {CASES} planted faults each              found  in its line  as another kind  further findings")
        for kind in KINDS:
            print(f"   {kind.what:40}" + row(kind, runs, known, np.random.default_rng(half)), flush=True)


def recordings(half: int) -> list[Run]:
    """Every other day of the lathe, and 16 h of the spindle."""
    found = [lathe_run(path) for path in lathe_days()[half::2]]
    spindle = spindle_run(half * SPINDLE, (half + 1) * SPINDLE)
    return found + ([spindle] if spindle is not None else [])


def clean(runs: Sequence[Run]) -> None:
    """What is said of the recordings as they are."""
    told = Counter((f.kind, f.table) for run in runs for f in faults_of(run))
    channels = sum(len(measured(run, t)) for run in runs for t in (False, True))
    listed = ", ".join(f"{n} {kind} in {table}.csv" for (kind, table), n in sorted(told.items())) or "nothing"
    print(f"   as they are, {channels} channels: {listed}")


def measured(run: Run, of_tcp: bool) -> list[str]:
    """Channels with readings."""
    if of_tcp:
        return [
            c for k, c in enumerate(COMPONENTS) if run.tcp is not None and np.isfinite(run.tcp.displacement[:, k]).any()
        ]
    return list(run.temperatures.columns) if run.temperatures is not None else []


def row(kind: Planted, runs: Sequence[Run], known: Sequence[set[Told]], rng: np.random.Generator) -> str:
    """Of a kind of fault, planted into runs of which something is known without it: the figures of a line."""
    found = on_line = other = further = 0
    for _ in range(CASES):
        k = int(rng.integers(len(runs)))
        run = runs[k]
        name = str(rng.choice(measured(run, kind.of_tcp)))
        time = run.loads.time
        planted = kind.draw(
            rng, run, name, float(rng.uniform(time[0] + 0.1 * np.ptp(time), time[0] + 0.6 * np.ptp(time)))
        )
        new = [f for f in faults_of(damaged(run, planted)) if told(f) not in known[k]]
        mine = {name, planted.other.removeprefix("sensors.")}
        own = [f for f in new if f.kind == "splice" or mine & set(f.channels)]
        line = int(np.searchsorted(time, planted.start))
        right = [f for f in own if f.kind in kind.told and (kind.throughout or f.first_row - 1 <= line <= f.last_row)]
        found += bool(right)
        on_line += any(abs(f.first_row - line) <= 1 for f in right) and not kind.throughout
        other += bool(own) and not right
        further += len(new) - len(own)
    return f"{found:7}{'' if kind.throughout else on_line:>13}{other:17}{further:18}"


def told(f: Fault) -> Told:
    """What it is known by: a standstill without its row, which moves with the rows of a splice."""
    return f.kind, f.channels, 0 if f.kind == "stuck" else f.first_row

"""Effects that no description has, hidden in drawn networks: `python -m benchmarks.drawn_outside FIRST N`.

As `benchmarks.drawn_machines`, of the same machines and beside their measurements with nothing hidden: heat of
histories that no log has (irregular ones, at one node or at two; what follows a speed hours late), two nodes that are
joined without the description knowing, and a joint that conducts more the faster something turns. Of heat the right
verdict is "unknown", of the others "unknown" or their name; any other name is wrong. A row per trial goes to
out/drawn/outside_SEED.jsonl, and files that are there are not made again.
"""

from __future__ import annotations

import sys
from collections.abc import Set
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.drawn_machines import OUT, SHARE, drawn_of, logs_of, moved, power_of, said, set_up, simulated
from benchmarks.rows import Row, counted, of_seeds, worth
from twin.cli.main import run as command
from twin.diagnose.evidence.speeds import SPEEDS
from twin.errors import TwinError
from twin.inject.draw.histories import telegraph
from twin.inject.machines.drawn import DrawnMachine
from twin.logs.read import read_run
from twin.logs.run import Run
from twin.logs.write import write_run
from twin.machine import wiring
from twin.machine.bodies import joined
from twin.machine.description import Machine
from twin.machine.effects.edits import extended_description
from twin.machine.effects.effect import Effect

HOUR = 3600.0  # s
SWITCH = "hidden_"  # columns that `twin hide` adds
LAG = HOUR  # s
FASTER = 4.0  # times the conductance at top speed


@dataclass(frozen=True)
class Outside:
    """An effect: slow (random levels of both signs, with ramps) or switched (on and off at random) heat at nodes, or
    heat there that follows a speed late; a joint between two nodes; or a contact of the description that conducts more
    the faster something turns ("faster")."""

    history: str
    places: tuple[str, ...]  # nodes, or the contact
    size: float  # W, W/K of a joint, or a factor of the conductance at top speed
    signal: str = ""  # that it follows


def effects(drawn: DrawnMachine, machine: Machine, power: float) -> list[Outside]:
    """One of each kind, places drawn from the machine's seed; of what conducts where a source heats one side. power: W,
    of all sources in the mean."""
    rng, more = np.random.default_rng([drawn.seed, 55]), np.random.default_rng([drawn.seed, 56])
    nodes, warm = list(machine.nodes), {str(s.surface) for s in machine.sources.values() if s.surface}
    heat = 2.0 * max(SHARE * power, 5.0)

    def some(n: int) -> tuple[str, ...]:
        return tuple(str(name) for name in rng.choice(nodes, n, replace=False))

    found = [Outside("slow", some(1), heat), Outside("switched", some(1), heat), Outside("switched", some(2), heat)]
    described = {name: c.surfaces for name, c in machine.contacts.items() if c.surfaces}
    if speeds := [name for name, s in machine.signals.items() if wiring.signal(name, s).unit in SPEEDS]:
        signal = str(more.choice(speeds))
        found.append(Outside("late", (str(more.choice(nodes)),), heat, signal))
        if beside := [name for name, pair in described.items() if warm & set(pair)]:
            found.append(Outside("faster", (f"contacts.{more.choice(beside)}",), FASTER, signal))
    return [*found, *_joint(drawn, machine, rng, warm)]


def _joint(drawn: DrawnMachine, machine: Machine, rng: np.random.Generator, warm: Set[str]) -> list[Outside]:
    """Two nodes joined that no contact joins, one of them warm; none where there are no such."""
    totals = [float(c.total) for c in machine.contacts.values() if c.total]
    free = [
        pair for pair in combinations(machine.nodes, 2) if frozenset(pair) not in joined(machine) and warm & set(pair)
    ]
    for pair in rng.permutation(free).tolist() if totals else ():
        own = Outside("joint", tuple(pair), 2.0 * float(np.median(totals)))
        try:
            extended_description(drawn.text, [Effect("missing_joint", "<>".join(pair), own.size, "W/K", "always")])
        except TwinError:  # an axis would carry both sides of its guides
            continue
        return [own]
    return []


def slow(rng: np.random.Generator, time: np.ndarray, of: np.ndarray) -> np.ndarray:
    """The history of the five-axis trials at times (n,) s."""
    return telegraph(rng, time, np.diff(time, prepend=time[0]))


def switched(rng: np.random.Generator, time: np.ndarray, of: np.ndarray) -> np.ndarray:
    """0 or 1 for 0.2 h and 0.5 h more in the mean each, at times (n,) s."""
    edges = np.cumsum(rng.exponential(0.5 * HOUR, 100) + 0.2 * HOUR)
    return (np.searchsorted(edges, time) % 2).astype(float)


def late(rng: np.random.Generator, time: np.ndarray, of: np.ndarray) -> np.ndarray:
    """What it follows, of (n,), with a time constant of LAG: through a body that nobody described."""
    found, now = np.empty(len(time)), 0.0
    for i, step in enumerate(np.diff(time, prepend=time[0])):
        now += (of[i] - now) * -np.expm1(-step / LAG)
        found[i] = now
    return found


def faster(rng: np.random.Generator, time: np.ndarray, of: np.ndarray) -> np.ndarray:
    """What it follows, of (n,)."""
    return of


HISTORIES = {"slow": slow, "switched": switched, "late": late, "faster": faster}


def measured(drawn: DrawnMachine, folder: Path, out: Path, hidden: Outside, seed: int) -> list[Path]:
    """Runs of a real machine with an effect; none where it cannot be hidden there."""
    real, logs = folder / "real_0", logs_of(folder)
    if hidden.history == "joint":
        told = ["missing_joint", "<>".join(hidden.places), f"{hidden.size:.4g} W/K", str(real), "-o", str(out / "real")]
        return [] if command(["hide", *told]) else simulated(out / "real", logs, out, drawn, seed)
    family, unit = ("joint", "") if hidden.history == "faster" else ("heat_source", " W")
    for i, place in enumerate(hidden.places):
        told = [family, place, f"{hidden.size:.4g}{unit}", str(real), "-o", str(out / f"real_{i}"), "--to", "1 h"]
        if command(["hide", *told, *(word for log in logs for word in ("--run", str(log)))]):
            return []
        real = out / f"real_{i}"
        logs = [real / "runs" / log.name for log in logs]
    rng = np.random.default_rng([drawn.seed, seed])
    return simulated(real, [_with_histories(log, hidden, rng) for log in logs], out, drawn, seed)


def _with_histories(log: Path, hidden: Outside, rng: np.random.Generator) -> Path:
    """The log with a history in the column of each hidden switch."""
    run = read_run(log)
    of = np.abs(run.loads.columns[hidden.signal]) if hidden.signal else np.zeros(len(run.loads.time))
    of = np.clip(of / max(float(of.max()), 1e-30), 0.0, 1.0)
    made = {c: HISTORIES[hidden.history](rng, run.loads.time, of) for c in run.loads.columns if c.startswith(SWITCH)}
    write_run(log, replace(run, loads=replace(run.loads, columns={**run.loads.columns, **made})))
    return log


def _seen(run: Run) -> Run:
    """A run without the columns of hidden switches."""
    columns = {c: values for c, values in run.loads.columns.items() if not c.startswith(SWITCH)}
    units = {c: run.loads.units[c] for c in columns}
    return replace(run, loads=replace(run.loads, columns=columns, units=units))


def answer(row: Row) -> str:
    """What a row is worth: "unknown", which is right, "too_poor", "nothing"; of what conducts "right" where it is named
    first, "among" where it is a rival; or "wrong": any other name."""
    history, *places, _ = row["hidden"]
    if row["verdict"] in ("unknown", "too_poor", "nothing"):
        return str(row["verdict"])

    def sorted_ends(place: str) -> str:
        return "<>".join(sorted(place.split("<>")))

    right = {({"joint": "missing_joint", "faster": "joint"}.get(history, ""), sorted_ends("<>".join(places)))}
    told = row["rivals"] if row["verdict"] == "ambiguous" else []
    named, rivals = ([(c[0], sorted_ends(c[1])) for c in causes] for causes in (row["causes"], told))
    return worth(named, rivals, right)


def judged(seed: int) -> list[Row]:
    """A row per effect of one machine."""
    with TemporaryDirectory() as folder:
        return _judged(drawn_of("lumped", seed), Path(folder))


def _judged(drawn: DrawnMachine, folder: Path) -> list[Row]:
    machine, healthy, detector = set_up(drawn, folder)
    sound = [read_run(p) for p in healthy[0]]
    rows = []
    for i, hidden in enumerate(effects(drawn, machine, power_of(detector.study))):
        if made := measured(drawn, folder, folder / f"effect_{i}", hidden, 60 + i):
            own = [_seen(read_run(p)) for p in made]
            row = said(detector, (hidden.history, *hidden.places, f"{hidden.size:.3g}"), own)
            rows.append(row | {"moved": moved(own, sound)})
    return rows


def main(first: int, count: int) -> None:
    rows = of_seeds(OUT, "outside", range(first, first + count), judged)
    counted(rows, answer, lambda row: f"{row['hidden'][0]} at {len(row['hidden']) - 2}")


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))

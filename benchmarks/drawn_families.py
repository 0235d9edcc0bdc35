"""The other families, hidden in drawn networks: `python -m benchmarks.drawn_families FIRST N`.

As `benchmarks.drawn_machines`, of the same machines and beside their measurements with nothing hidden; each has one
effect of every entry of `effects`: what switches within a run, what follows a signal, what is at another place, what
acts on one reading. A row per trial goes to out/drawn/families_SEED.jsonl, and files that are there are not made again.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.drawn_machines import (
    OUT,
    SHARE,
    drawn_of,
    hidden_in_logs,
    logs_of,
    moved,
    power_of,
    said,
    set_up,
    simulated,
)
from benchmarks.rows import Row, counted, of_seeds, visible, worth
from twin.cli.main import run as command
from twin.diagnose.faults.sun import SOLAR
from twin.inject.machines.drawn import DrawnMachine
from twin.logs.read import read_run
from twin.machine.description import Machine

OF_TCP = "measurement", "slip"  # families that change readings of the TCP alone, and are always asked for


@dataclass(frozen=True)
class Hidden:
    """One effect as `twin hide` takes it."""

    family: str
    place: str
    size: str
    options: tuple[str, ...] = ()
    in_log: bool = False


def effects(drawn: DrawnMachine, machine: Machine, power: float) -> list[Hidden]:
    """One of each kind, places drawn from the machine's seed. power: W, of all sources in the mean."""
    rng = np.random.default_rng([drawn.seed, 99])

    def one(of: Sequence[str]) -> str:
        return of[int(rng.integers(len(of)))]

    nodes, hours = list(machine.nodes), float(drawn.hours)
    sensors = [f"sensors.{n}" for n, s in machine.sensors.items() if s.environment is None]
    part_of = {f"sensors.{n}": s.part for n, s in machine.sensors.items()}
    own = [n for n, s in machine.sources.items() if s.contact is None]
    currents = [n for n, s in machine.signals.items() if str(s.unit) == "A"]
    environment = next(e for e in machine.environment.values() if e.signal)
    heat = max(SHARE * power, 5.0)
    during = ("--from", f"{0.25 * hours:.1f} h", "--to", f"{0.6 * hours:.1f} h")
    day = ("--from", "0.5 h", "--to", f"{min(hours - 0.3, 5.0):.1f} h")

    def sun(node: str) -> Hidden:  # no brighter than the sun is
        return Hidden("sun", node, f"{min(4.0 * heat, SOLAR * (machine.nodes[node].area or 0.0)):.3g} W", day)

    found = [
        Hidden("zone", f"films.{one(list(machine.films))}", "4 K"),
        Hidden("heat_source", one(nodes), f"{2.0 * heat:.3g} W", during),
        sun(one(nodes)),
        Hidden("coolant", one(nodes), "60 W/(m^2*K)", ("--setting", "temperature=14 degC", *during)),
        Hidden("joint", f"contacts.{one(list(machine.contacts))}", "0.2", ("--from", f"{0.4 * hours:.1f} h")),
        Hidden("sensor", one(sensors), "900 s", ("--history", "lag"), True),
        Hidden("sensor", one(sensors), "0.5", ("--history", "detached", "--signal", environment.signal or ""), True),
        Hidden("measurement", "tcp.dx", "8 um", ("--history", "drift"), True),
        Hidden("slip", "tcp.dx", "4 um", (), True),
    ]
    if own:
        source = one(own)
        others = [n for n in nodes if n != (machine.sources[source].surface or "")]
        found.append(Hidden("misplaced_source", f"sources.{source}", one(others)))
    if currents:
        found.append(
            Hidden("heat_source", one(nodes), f"{2.0 * heat:.3g} W", ("--signal", one(currents), "--exponent", "2"))
        )
    return [*found, *_elsewhere(rng, sensors, part_of)]


def _elsewhere(rng: np.random.Generator, sensors: Sequence[str], part_of: Mapping[str, str | None]) -> list[Hidden]:
    """One sensor is mounted where one of another node is; none where all are on one."""
    sensor = str(rng.choice(sensors))
    others = [s for s in sensors if part_of[s] != part_of[sensor]]
    return [Hidden("sensor", sensor, str(rng.choice(others)), ("--history", "elsewhere"), True)] if others else []


def measured(
    drawn: DrawnMachine, folder: Path, healthy: Sequence[Path], out: Path, hidden: Hidden, seed: int
) -> list[Path]:
    """Runs with an effect, of a reading in the healthy ones; none where it cannot be hidden there. A joint that is lost
    in the first run stays lost."""
    given = logs = logs_of(folder)
    told = [hidden.family, hidden.place, hidden.size]
    if hidden.in_log:
        return hidden_in_logs(told, healthy, out, hidden.options)
    timed = "--from" in hidden.options
    switched = [word for log in logs for word in ("--run", str(log))] if timed else []
    real = out / "real"
    if command(["hide", *told, str(folder / "real_0"), "-o", str(real), *hidden.options, *switched]):
        return []
    if timed:
        logs = [real / "runs" / log.name for log in logs]
    if hidden.family != "joint":
        return simulated(real, logs, out, drawn, seed)
    lost = out / "lost"
    if command(["hide", *told, str(folder / "real_0"), "-o", str(lost)]):
        return []
    return [*simulated(real, logs[:1], out, drawn, seed), *simulated(lost, given[1:], out, drawn, seed + 1000)]


def answer(row: Row) -> str:
    """What a row is worth: "right" (family and place first), "among" (named besides, or one of what cannot be
    distinguished), "place" (another family at its place), "missed", "too_poor", "unknown" or "wrong"."""
    family, place = row["hidden"][:2]
    if row["verdict"] in ("nothing", "too_poor", "unknown"):
        return "missed" if row["verdict"] == "nothing" else row["verdict"]
    named = [(c[0], c[1]) for c in row["causes"]]
    found = worth(named, [(r[0], r[1]) for r in row["rivals"]], {(family, place)})
    return "place" if found == "wrong" and named and named[0][1] == place else found


def kind_of(row: Row) -> str:
    """Family, and what of its options makes it another effect."""
    option = next((o for o in row["hidden"][3:] if o in ("--from", "--signal", "lag", "detached", "elsewhere")), "")
    return f"{row['hidden'][0]} {option.strip('-')}"


def judged(seed: int) -> list[Row]:
    """A row per effect of one machine."""
    with TemporaryDirectory() as folder:
        return _judged(drawn_of("lumped", seed), Path(folder))


def _judged(drawn: DrawnMachine, folder: Path) -> list[Row]:
    machine, healthy, detector = set_up(drawn, folder)
    sound = [[read_run(p) for p in runs] for runs in healthy]
    rows = []
    for i, hidden in enumerate(effects(drawn, machine, power_of(detector.study))):
        if made := measured(drawn, folder, healthy[1], folder / f"effect_{i}", hidden, 40 + i):
            own = [read_run(p) for p in made]
            row = said(detector, (hidden.family, hidden.place, hidden.size, *hidden.options), own)
            rows.append(row | {"moved": moved(own, sound[1 if hidden.in_log else 0])})
    return rows


def main(first: int, count: int) -> None:
    rows = of_seeds(OUT, "families", range(first, first + count), judged)
    counted(rows, answer, kind_of, lambda row: visible(row) or row["hidden"][0] in OF_TCP)


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))

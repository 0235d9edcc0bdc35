"""Faults hidden in drawn machines, and what is said: `python -m benchmarks.drawn_machines FIRST N [KIND]`.

KIND: boxes or lumped, drawn as well by default; nodes is the shipped network of the ball-screw axis, of which loads,
noise and real machines are drawn.

Truth is the full model of the real machine (`twin.inject.machines.other`): another mesh, other film laws, values off.
Every machine is looked at with nothing hidden and with one fault of each of IN_MACHINE and IN_LOG; a row per trial goes
to out/drawn/KIND_SEED.jsonl, and files that are there are not made again. The last lines count the answers, of all
trials and of those that are visible: faults in the machine that move any sensor by 0.5 K or the TCP by 3 um.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from twin.cli.main import run as command
from twin.diagnose.faults.catalogue import FAMILIES
from twin.diagnose.pipeline import Settings, prepare
from twin.diagnose.report.recalibration import large
from twin.diagnose.report.text import alike
from twin.diagnose.search.detector import Detector
from twin.diagnose.search.dispersion import searched
from twin.diagnose.search.standing import standing
from twin.diagnose.search.verdict import pulls_of
from twin.diagnose.search.witness import other_measurements
from twin.inject.machines.drawn import HOURS, NOISE, RUNS, SAMPLINGS, DrawnMachine, draw_machine
from twin.inject.machines.draws import between, one_of
from twin.inject.machines.loads import loads_of_run
from twin.inject.machines.other import other
from twin.logs.read import read_run
from twin.logs.run import Run
from twin.machine.description import Machine
from twin.machine.load import load_machine

OUT = Path("out/drawn")
NODES = Path(__file__).parents[1] / "models" / "ball_screw_axis" / "nodes.toml"
SCREW = {"screw_speed": "x"}  # its drive, which the name does not tell
TRUTHS = 2  # real machines with nothing hidden, per description
# family -> size; places are drawn among those that the machine has
IN_MACHINE = {"heat_source": "", "loss_law": "1.6", "joint": "0.3", "film_gain": "2", "expansion": "1.3"}
IN_LOG = {"offset": "1 K", "drift": "2 K", "swapped": "", "factor": "1.4142135623730951"}
SHARE = 0.25  # of the mean power of all sources: hidden heat
# K, m: what a fault in the machine must do to be asked for, in means of an hour, or of three TCP rows
VISIBLE = 0.5, 3e-6


Row = dict[str, Any]


def trials(drawn: DrawnMachine, machine: Machine, power: float) -> list[tuple[str, str, str]]:
    """(family or kind, place, size) of everything that is hidden, drawn from the machine's seed.

    power: W, of all sources in the mean.
    """
    rng = np.random.default_rng([drawn.seed, 77])
    sizes = IN_MACHINE | IN_LOG | {"heat_source": f"{max(SHARE * power, 5.0):.3g} W"}
    found = []
    for family, known in places(machine).items():
        if known:
            place, size = known[int(rng.integers(len(known)))], sizes[family]
            if family == "swapped":
                others = [s for s in known if s != place]
                size = others[int(rng.integers(len(others)))]
            found.append((family, place, size))
    return found


def places(machine: Machine) -> dict[str, list[str]]:
    """Where each family or kind may be hidden."""
    sensors = [f"sensors.{n}" for n, s in machine.sensors.items() if s.environment is None]
    surfaces = [s for f in machine.films.values() for s in f.surfaces if not s.endswith("*")]
    return {
        "heat_source": (surfaces or _sides(machine)) if machine.parts else list(machine.nodes),
        "loss_law": [f"sources.{s}" for s in machine.sources],
        "joint": [f"contacts.{c}" for c in machine.contacts],
        "film_gain": [f"films.{f}" for f in machine.films],
        "expansion": [f"parts.{p}" for p in machine.parts],
        "offset": sensors,
        "drift": sensors,
        "swapped": sensors if len(sensors) > 2 else [],
        "factor": [f"signals.{n}" for n, s in machine.signals.items() if str(s.unit) == "A"],
    }


def _sides(machine: Machine) -> list[str]:
    """Three of every box, where heat may enter: no other part is joined to them."""
    joined = {s for c in machine.contacts.values() for pair in (c.surfaces or (), *c.pairs) for s in pair}
    sides = [f"{part}.{side}" for part in machine.parts for side in ("x_max", "y_max", "z_max")]
    return [side for side in sides if side not in joined]


def answer(row: Row) -> str:
    """What a row is worth: "right" (family and place first), "among" (named besides, or one of what cannot be
    distinguished), "missed", "unknown" or "wrong"; with nothing hidden "nothing" or "false alarm"."""
    kind, place, size = row["hidden"]
    if kind == "nothing":
        return "nothing" if row["verdict"] == "nothing" else "false alarm"
    if row["verdict"] in ("nothing", "too_poor", "unknown"):
        return "unknown" if row["verdict"] == "unknown" else "missed"
    family = {"factor": "signal"}.get(kind, "sensor" if kind in IN_LOG else kind)
    sought = {_pair(f"{place}<>{size.removeprefix('sensors.')}")} if kind == "swapped" else {place}
    named = [(c[0], _pair(c[1]) if "<>" in c[1] else c[1]) for c in row["causes"]]
    right = {(family, p) for p in sought | set(row.get("same", ()))}
    if named and named[0] in right:
        return "right"
    told = row["rivals"] if row["verdict"] == "ambiguous" else row.get("alike", [])  # of the headline
    rivals = [tuple(r) for r in told]
    return "among" if right & {*named, *rivals} else "wrong"


def headlined(row: Row) -> bool:
    """Whether a number that no verdict names is one of those that stand in the headline: calibration moves a sensor by
    0.5 K or the TCP by 3 um (rms) with it."""
    return answer(row) == "missed" and any(path.startswith(f"{row['hidden'][1]}.") for path in row.get("headline", ()))


def _pair(place: str) -> str:
    """Two sensors in alphabetical order."""
    return "sensors." + "<>".join(sorted(place.removeprefix("sensors.").split("<>")))


def simulated(machine: Path, runs: Sequence[Path], out: Path, drawn: DrawnMachine, seed: int) -> list[Path]:
    """What the full model of a machine measures in runs, with the noise of a drawn one."""
    made = []
    for k, run in enumerate(runs):
        target = out / run.name
        noise = ("--noise-temperature", f"{drawn.noise[0]:.4f} K", "--noise-tcp", f"{1e6 * drawn.noise[1]:.3f} um")
        asked = ["simulate", machine, run, "-o", target, *noise, "--tcp-every", "20 min", "--seed", 100 * seed + k]
        if command([str(a) for a in asked]):
            raise RuntimeError(f"simulate {machine} {run}")
        made.append(target)
    return made


def main(first: int, count: int, kind: str = "") -> None:
    seeds = range(first, first + count)
    counted([row for seed in seeds for row in kept(kind or "any", seed, partial(judged, drawn_of(kind, seed)))])


def kept(name: str, seed: int, ask: Callable[[Path], list[Row]]) -> list[Row]:
    """The rows of a machine in out/drawn/NAME_SEED.jsonl; made in a temporary folder where there are none."""
    OUT.mkdir(parents=True, exist_ok=True)
    path = OUT / f"{name}_{seed}.jsonl"
    if not path.exists():
        with tempfile.TemporaryDirectory() as folder:
            made = ask(Path(folder))
        path.write_text("".join(json.dumps(row) + "\n" for row in made), encoding="utf-8")
    return [json.loads(line) | {"seed": seed} for line in path.read_text(encoding="utf-8").splitlines()]


def counted(rows: Sequence[Row]) -> None:
    """Print the answers one by one, and how many there are of each."""
    answers: dict[tuple[str, bool], Counter[str]] = {}
    for row in rows:
        visible = any(m >= least for m, least in zip(row.get("moved", VISIBLE), VISIBLE, strict=True))
        for only in (False, True) if visible else (False,):
            told = "missed by the verdict, in the headline" if headlined(row) else answer(row)
            answers.setdefault((row["hidden"][0], only), Counter())[told] += 1
        told = f"dispersion {row['dispersion']:.2f}, best {row['best']:.0f}, " if "dispersion" in row else ""
        print(row["seed"], row["hidden"], answer(row), row["verdict"], row["causes"], f"{told}{row['seconds']:.0f} s")
    for only in (False, True):
        print("of those that are visible" if only else "of all")
        for (hidden, seen), of_kind in answers.items():
            if seen == only:
                print(f"   {hidden:<12} {', '.join(f'{n} {told}' for told, n in of_kind.most_common())}")


def drawn_of(kind: str, seed: int) -> DrawnMachine:
    """The machine of a seed: of boxes or a lumped one, of either kind by default; or the shipped network."""
    if kind != "nodes":
        return draw_machine(seed, kind or None)  # type: ignore[arg-type]
    text = NODES.read_text(encoding="utf-8")
    machine = load_machine(NODES, text)
    rng = np.random.default_rng([seed, 9])
    hours, sampling = int(rng.integers(HOURS[0], HOURS[1] + 1)), one_of(rng, SAMPLINGS)
    noise = (between(rng, *NOISE[0], 2), between(rng, *NOISE[1], 2))
    runs = tuple(loads_of_run(machine, 1000 * seed + k, n, hours, sampling, SCREW) for k, n in enumerate(RUNS))
    return DrawnMachine(seed, "lumped", text, runs, hours, sampling, noise, len(machine.sensors), len(machine.nodes))


Measured = tuple[tuple[str, str, str], list[Path]]  # what was hidden, and the measured runs


def judged(drawn: DrawnMachine, folder: Path) -> list[Row]:
    """A row per trial of one machine."""
    drawn.write(folder / "m")
    machine = drawn.machine(folder / "m")
    logs = [folder / "m" / "runs" / name for name in RUNS]
    measured_runs: list[Measured] = [healthy_runs(drawn, folder, logs, k) for k in range(TRUTHS)]
    detector, power = detector_of(drawn, machine, [read_run(p) for p in measured_runs[0][1]])
    for i, hidden in enumerate(trials(drawn, machine, power)):
        out = folder / f"trial_{i}"
        if hidden[0] in IN_MACHINE:
            made = _in_machine(drawn, folder / "real_0", logs, out, hidden, 20 + i)
        elif hidden[0] == "factor":
            made = _misread(drawn, folder / "real_1", logs, out, hidden, 20 + i)
        else:
            made = _in_log(measured_runs[1][1], out, hidden)
        if made:
            measured_runs.append((hidden, made))
    healthy = [[read_run(p) for p in made] for _, made in measured_runs[:TRUTHS]]
    rows = []
    for hidden, paths in measured_runs:
        own = [read_run(p) for p in paths]
        beside = healthy[0] if hidden[0] in IN_MACHINE else healthy[1] if hidden[0] == "factor" else None
        by = (np.inf, np.inf) if beside is None else moved(own, beside)
        rows.append(said(detector, hidden, own) | {"moved": by, "same": same_place(machine, hidden[1])})
    return rows


def detector_of(drawn: DrawnMachine, machine: Machine, runs: Sequence[Run]) -> tuple[Detector, float]:
    """What all trials of a machine are diagnosed with, and the mean power of all its sources [W]."""
    settings = Settings(temperature_sigma=drawn.noise[0], tcp_sigma=drawn.noise[1], nulls=100, form=32)
    detector, _ = prepare(machine, runs[:2], runs[2:], settings)
    return detector, float(detector.study.runs[0].run.drive.power.sum(axis=1).mean())


def same_place(machine: Machine, place: str) -> list[str]:
    """Other names of a place, which are right, too: the surface that is all of a film, and the surface that a fixed
    contact without a gap joins to it."""
    film = machine.films.get(place.removeprefix("films."))
    found = list(film.surfaces) if film is not None and len(film.surfaces) == 1 and place.startswith("films.") else []
    for contact in machine.contacts.values():
        if contact.surfaces and contact.glues and place in contact.surfaces:
            found += [s for s in contact.surfaces if s != place]
    return found


def moved(runs: Sequence[Run], healthy: Sequence[Run]) -> tuple[float, float]:
    """K and m by which a fault moves the sensor, and the TCP, that it moves most: means of an hour, or of three rows.

    Of the same real machine without it; the noise of both is in it.
    """
    kelvin, metres = 0.0, 0.0
    for a, b in zip(runs, healthy, strict=True):
        if a.temperatures is not None and b.temperatures is not None:
            rows = max(1, int(3600.0 / float(np.median(np.diff(a.temperatures.time)))))
            for name, values in a.temperatures.columns.items():
                kelvin = max(kelvin, _largest(values - b.temperatures.columns[name], rows))
        if a.tcp is not None and b.tcp is not None:
            metres = max([metres, *(_largest(d, 3) for d in (a.tcp.displacement - b.tcp.displacement).T)])
    return kelvin, metres


def _largest(values: np.ndarray, rows: int) -> float:
    """The largest mean of so many values one after the other."""
    n = len(values) // rows * rows
    return float(np.abs(values[:n].reshape(-1, rows).mean(axis=1)).max(initial=0.0))


def healthy_runs(drawn: DrawnMachine, folder: Path, logs: Sequence[Path], k: int) -> Measured:
    """A real machine with nothing hidden, and its runs."""
    real = folder / f"real_{k}"
    real.mkdir()
    (real / "machine.toml").write_text(other(drawn.text, 1000 * drawn.seed + k, folder / "m"), encoding="utf-8")
    return ("nothing", "", ""), simulated(real, logs, folder / f"null_{k}", drawn, 10 + k)


def _in_machine(
    drawn: DrawnMachine, real: Path, logs: Sequence[Path], out: Path, hidden: tuple[str, str, str], seed: int
) -> list[Path]:
    """Runs of a real machine with a fault; none where it cannot be hidden there."""
    if command(["hide", *hidden, str(real), "-o", str(out / "real")]):
        return []
    return simulated(out / "real", logs, out, drawn, seed)


def _misread(
    drawn: DrawnMachine, real: Path, logs: Sequence[Path], out: Path, hidden: tuple[str, str, str], seed: int
) -> list[Path]:
    """Runs of a real machine whose logs say a factor too much: as `said` reads the given logs, it saw less."""
    saw = [out / "saw" / log.name for log in logs]
    for log, where in zip(logs, saw, strict=True):
        if command(["hide", "signal", hidden[1], f"{1.0 / float(hidden[2]):.12g}", str(log), "-o", str(where)]):
            return []
    return simulated(real, saw, out, drawn, seed)


def _in_log(healthy: Sequence[Path], out: Path, hidden: tuple[str, str, str]) -> list[Path]:
    """Healthy runs with a fault in their logs; none where it cannot be hidden there."""
    kind, place, size = hidden
    made = [out / run.name for run in healthy]
    for run, where in zip(healthy, made, strict=True):
        if command(["hide", "sensor", place, size, str(run), "-o", str(where), "--history", kind]):
            return []
    return made


def said(detector: Any, hidden: tuple[str, ...], runs: list[Any]) -> Row:
    began = time.perf_counter()
    own, plans, y, faults = other_measurements(detector, runs)
    found, left = searched(own, y)
    found, opened = standing(found, y, FAMILIES, faults, plans[2:], 1)
    verdict, causes = opened.verdict, opened.causes
    return {
        "hidden": hidden,
        "verdict": verdict,
        "note": opened.note or opened.less or opened.size,
        "causes": [(c.family, c.place, round(c.amplitude, 4), c.history, c.ci95) for c in causes],
        "gains": [(g.channel, g.unit, g.recalibrated, g.extended, g.ci95) for g in opened.gains if g.affected],
        "rivals": [(r.family, r.place) for c in causes for r in c.rivals],
        "alike": [(c.family, place) for c in causes for place in alike(c)],
        "by_run": [[(s.amplitude, s.sigma) for s in a.by_run] for a in found.accepted],
        "observed": {k: v / detector.thresholds.get(k, np.inf) for k, v in found.steps[0].observed.items()},
        "dispersion": left.share,
        "best": max((h.statistic for h in found.steps[0].ranked), default=0.0),
        "headline": [p.path for p in large(pulls_of(found))] if verdict == "nothing" else [],
        "seconds": time.perf_counter() - began,
    }


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), *sys.argv[3:4])

"""Faults hidden in drawn machines, and what is said: `python -m benchmarks.drawn_machines FIRST N [KIND]`.

KIND: boxes or lumped, drawn as well by default; nodes is the shipped network of the ball-screw axis, of which loads,
noise and real machines are drawn.

Truth is the full model of the real machine (`twin.inject.machines.other`): another mesh, other film laws, values off.
Every machine is looked at with nothing hidden and with one fault of each of IN_MACHINE and IN_LOG; a row per trial goes
to out/drawn/KIND_SEED.jsonl, and files that are there are not made again. The last lines count the answers, of all
trials and of those that are visible: faults in the machine that move any sensor by 0.5 K or the TCP by 3 um.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.rows import Row, counted, of_seeds, worth
from twin.cli.main import run as command
from twin.diagnose.faults.catalogue import FAMILIES
from twin.diagnose.model.study import Study
from twin.diagnose.pipeline import Settings, prepare
from twin.diagnose.report.recalibration import large
from twin.diagnose.report.text import alike
from twin.diagnose.search.detector import Detector
from twin.diagnose.search.excused import other_search
from twin.diagnose.search.standing import standing
from twin.diagnose.search.verdict import pulls_of
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
IN_MACHINE = {
    "heat_source": "", "loss_law": "1.6", "joint": "0.3", "film_gain": "2", "expansion": "1.3", "capacity": "1.6",
}  # fmt: skip
IN_LOG = {"offset": "1 K", "drift": "2 K", "swapped": "", "factor": "1.4142135623730951"}
SHARE = 0.25  # of the mean power of all sources: hidden heat


def trials(drawn: DrawnMachine, machine: Machine, power: float) -> list[tuple[str, str, str]]:
    """(family or kind, place, size) of everything that is hidden, drawn from the machine's seed.

    power: W, of all sources in the mean.
    """
    rng = np.random.default_rng([drawn.seed, 77])
    sizes = IN_MACHINE | IN_LOG | {"heat_source": f"{max(SHARE * power, 5.0):.3g} W"}
    sizes |= {"expansion": "1.6"} if machine.lumped else {}  # whose tolerance is 30 %
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
        "expansion": [f"parts.{p}" for p in machine.parts] or [f"tcp.expansion.{n}" for n in machine.tcp.expansion],
        "capacity": [n for n, node in machine.nodes.items() if machine.lumped and node.capacity is not None],
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
    told = row["rivals"] if row["verdict"] == "ambiguous" else row.get("alike", [])  # of the headline
    return worth(named, [(r[0], r[1]) for r in told], {(family, p) for p in sought | set(row.get("same", ()))})


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
        noise = ("--noise", f"{drawn.noise[0]:.4f} K", "--tcp-noise", f"{1e6 * drawn.noise[1]:.3f} um")
        asked = ["simulate", machine, run, "-o", target, *noise, "--tcp-every", "20 min", "--seed", 100 * seed + k]
        if command([str(a) for a in asked]):
            raise RuntimeError(f"simulate {machine} {run}")
        made.append(target)
    return made


def told(rows: Sequence[Row]) -> None:
    """Print the answers and their counts, those in the headline for themselves."""

    def said(row: Row) -> str:
        return "missed by the verdict, in the headline" if headlined(row) else answer(row)

    counted(rows, said, lambda row: str(row["hidden"][0]))


def main(first: int, count: int, kind: str = "") -> None:
    told(of_seeds(OUT, kind or "any", range(first, first + count), lambda seed: judged(kind, seed)))


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


def judged(kind: str, seed: int) -> list[Row]:
    """A row per trial of one machine."""
    with TemporaryDirectory() as folder:
        return _judged(drawn_of(kind, seed), Path(folder))


def _judged(drawn: DrawnMachine, folder: Path) -> list[Row]:
    machine, healthy, detector = set_up(drawn, folder)
    measured_runs = [(("nothing", "", ""), runs) for runs in healthy]
    for i, hidden in enumerate(trials(drawn, machine, power_of(detector.study))):
        out = folder / f"trial_{i}"
        if hidden[0] in IN_MACHINE:
            made = _in_machine(drawn, folder, out, hidden, 20 + i)
        elif hidden[0] == "factor":
            made = _misread(drawn, folder, out, hidden, 20 + i)
        else:
            made = hidden_in_logs(["sensor", *hidden[1:]], healthy[1], out, ("--history", hidden[0]))
        if made:
            measured_runs.append((hidden, made))
    sound = [[read_run(p) for p in runs] for runs in healthy]
    rows = []
    for hidden, paths in measured_runs:
        own = [read_run(p) for p in paths]
        beside = sound[0] if hidden[0] in IN_MACHINE else sound[1] if hidden[0] == "factor" else None
        by = (np.inf, np.inf) if beside is None else moved(own, beside)
        rows.append(said(detector, hidden, own) | {"moved": by, "same": same_place(machine, hidden[1])})
    return rows


def set_up(drawn: DrawnMachine, folder: Path) -> tuple[Machine, list[list[Path]], Detector]:
    """Write the description and the loads of a drawn machine (folder/m), and real machines (real_0, ...) with runs in
    which nothing is hidden.

    Returns the description, these runs, and what all trials are diagnosed with.
    """
    drawn.write(folder / "m")
    machine, healthy = drawn.machine(folder / "m"), []
    for k in range(TRUTHS):
        real = folder / f"real_{k}"
        real.mkdir()
        (real / "machine.toml").write_text(other(drawn.text, 1000 * drawn.seed + k, folder / "m"), encoding="utf-8")
        healthy.append(simulated(real, logs_of(folder), folder / f"null_{k}", drawn, 10 + k))
    detector = detector_of(machine, [read_run(p) for p in healthy[0]], drawn.noise)
    return machine, healthy, detector


def logs_of(folder: Path) -> list[Path]:
    """The runs of a drawn machine, loads alone."""
    return [folder / "m" / "runs" / name for name in RUNS]


def detector_of(machine: Machine, runs: Sequence[Run], noise: tuple[float, float]) -> Detector:
    """What all trials of a machine are diagnosed with: made from the plan of any measurements, with noise [K, m]."""
    settings = Settings(temperature_sigma=noise[0], tcp_sigma=noise[1], nulls=100, form=32)
    return prepare(machine, runs[:2], runs[2:], settings)[0]


def power_of(study: Study) -> float:
    """W: of all sources in the mean of the first run."""
    return float(study.runs[0].run.drive.power.sum(axis=1).mean())


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


def _in_machine(drawn: DrawnMachine, folder: Path, out: Path, hidden: tuple[str, str, str], seed: int) -> list[Path]:
    """Runs of a real machine with a fault; none where it cannot be hidden there."""
    if command(["hide", *hidden, str(folder / "real_0"), "-o", str(out / "real")]):
        return []
    return simulated(out / "real", logs_of(folder), out, drawn, seed)


def _misread(drawn: DrawnMachine, folder: Path, out: Path, hidden: tuple[str, str, str], seed: int) -> list[Path]:
    """Runs of a real machine whose logs say a factor too much: as `said` reads the given logs, it saw less."""
    saw = hidden_in_logs(["signal", hidden[1], f"{1.0 / float(hidden[2]):.12g}"], logs_of(folder), out / "saw")
    return simulated(folder / "real_1", saw, out, drawn, seed)


def hidden_in_logs(told: Sequence[str], runs: Sequence[Path], out: Path, options: Sequence[str] = ()) -> list[Path]:
    """Runs with a fault in their logs, told as `twin hide` takes it; none where it cannot be hidden there."""
    made = [out / run.name for run in runs]
    for run, where in zip(runs, made, strict=True):
        if command(["hide", *told, str(run), "-o", str(where), *options]):
            return []
    return made


def said(detector: Detector, hidden: tuple[str, ...], runs: Sequence[Run]) -> Row:
    began = time.perf_counter()
    found, left, own = other_search(detector, runs)
    found, opened = standing(found, own.y, FAMILIES, own.faults, own.plans[2:], 1)
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

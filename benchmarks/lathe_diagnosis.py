"""A real lathe with a twin that misses by 1 K, judged as `twin diagnose` does: false alarms, and faults of the machine.

Needs the measured data (TWIN_MEASURED_DATA) and says so where there are none. The twin is models/lathe, calibrated as
its README does. Every pair of days is looked at as measured; then faults are planted into it: what the twin's full
model computes with the fault less what it computes without is added to the readings, so that what the twin leaves of
the real days stays as noise. They are heat at a node, always, with a signal or in a window, of twice the limit that the
diagnosis of the pair as measured has for that place and history, where that is a size that physics has. Missing members
are not looked for, and one detector serves a pair: neither takes a fault for another one.

`python -m benchmarks.lathe_diagnosis HALF PAIRS FAULTS`: pairs of days 1, 3, 5 ... (0) or 2, 4, 6 ... (1), and faults
in each. A row per diagnosis goes to out/lathe_diagnosis/HALF_PAIR.jsonl; those that are there are not made again.
"""

from __future__ import annotations

import contextlib
import io
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import combinations
from pathlib import Path

import numpy as np

from benchmarks.rows import Row, counts, kept, worth
from models.measured import VARIABLE, measured_data
from models.recordings import lathe_days
from models.scripts import load_script
from twin.build.simulate import simulate_run
from twin.calibrate.fit.measured import Measured, measured
from twin.calibrate.fit.problem import run_names
from twin.cli.main import run as command
from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.evidence.whiten import measured_of
from twin.diagnose.faults.catalogue import FAMILIES as CATALOGUE
from twin.diagnose.faults.channels_check import channels_at_fault, judged_channels
from twin.diagnose.model.study import with_measured
from twin.diagnose.pipeline import Settings, machine_of, prepare
from twin.diagnose.result.diagnosis import Cause
from twin.diagnose.search.accepted import Accepted
from twin.diagnose.search.detector import Detector, emptied
from twin.diagnose.search.dispersion import raised, searched
from twin.diagnose.search.limits import limits_in
from twin.diagnose.search.verdict import cause_of, verdict_of, with_faults
from twin.logs.read import read_run
from twin.logs.run import Run
from twin.machine.effects.edits import extended_description, loads_with
from twin.machine.effects.effect import Effect
from twin.machine.load import load_machine
from twin.rom.artefact import read_artefact
from twin.rom.model import MachineModel

ROOT = Path(__file__).parents[1]
MODEL, OUT = ROOT / "models" / "lathe", ROOT / "out" / "lathe_diagnosis"
TRAINING = ("20200701", "20200616", "20200710", "20200723", "20200730", "20200814")  # of models/lathe/README.md
PAIRS, FAULTS = 12, 3  # per half
FORM, NULLS = 32, 60  # synthetic measurements: what the twin leaves decides anyway
# of linear size, writable, and not the same as another: a warm zone at one node is heat
FAMILIES = {"heat_source": "W"}
TWICE = 2.0
DAYS = "1, 3, 5 ...", "2, 4, 6 ..."  # of the halves


def main() -> None:
    data = measured_data("lathe")
    if data is None:
        print(f"   not run: no measured data; set {VARIABLE} to the folder that holds lathe")
        return
    given = [int(a) for a in sys.argv if a.isdigit()]
    halves = given[:1] or [0, 1]
    pairs, faults = (*given[1:], *(PAIRS, FAULTS)[len(given[1:]) :])
    artefact = the_twin(data)
    for half in halves:
        rows: list[Row] = []
        for k, chosen in enumerate(pairs_of(half, pairs)):
            make = partial(rows_of, artefact, chosen, faults, np.random.default_rng([half, k]))
            rows += kept(OUT / f"{half}_{k}.jsonl", make)
        print(f"   days {DAYS[half]}")
        told(rows)


def pairs_of(half: int, count: int) -> list[tuple[str, str]]:
    """So many pairs of a half's days, in an order that its number draws."""
    every = list(combinations([p.stem for p in lathe_days()[half::2]], 2))
    return [every[int(i)] for i in np.random.default_rng(half).permutation(len(every))[:count]]


def the_twin(data: Path) -> Path:
    """The calibrated artefact, and the runs of all days beside it."""
    made = OUT / "lathe.h5"
    if not made.exists():
        with contextlib.redirect_stdout(io.StringIO()):
            load_script(MODEL / "runs", "make_runs.py").write_runs(data, OUT / "runs")
            runs = [str(OUT / "runs" / day) for day in TRAINING]
            for asked in (
                ["build", str(MODEL), "-o", str(OUT / "rough.h5")],
                ["calibrate", str(OUT / "rough.h5"), *runs, "-o", str(made)],
            ):
                if command(asked):
                    raise SystemExit(f"twin {' '.join(asked)} failed")
    return made


def rows_of(path: Path, days: Sequence[str], faults: int, rng: np.random.Generator) -> list[Row]:
    """The diagnosis of a pair of days as measured, then with faults in it."""
    artefact = read_artefact(path)
    machine = machine_of(artefact, path)
    runs = [read_run(OUT / "runs" / day) for day in days]
    usable, set_aside = checked(runs, artefact.model)
    detector, plans = prepare(machine, usable, (), Settings(form=FORM, nulls=NULLS))
    study = detector.study
    made, limited = _row(detector, plans, set_aside, days, None)
    rows = [made]
    plain = [simulate_run(machine, run)[0] for run in runs]
    for _ in range(faults):
        if (hidden := drawn(limited, rng)) is None:
            break
        cause, effect = hidden
        edit = extended_description(artefact.description, [effect])
        faulty = load_machine(machine.folder, edit.text)
        planted = [
            with_difference(run, simulate_run(faulty, loads_with(run, edit.signals))[0], own)
            for run, own in zip(runs, plain, strict=True)
        ]
        usable, set_aside = checked(planted, artefact.model)
        plans = [
            measured(study.probed.base, run, p.run.drive, p.run.name) for run, p in zip(usable, study.runs, strict=True)
        ]
        rows.append(_row(detector, plans, set_aside, days, cause)[0])
    return rows


def checked(runs: Sequence[Run], model: MachineModel) -> tuple[list[Run], list[Cause]]:
    """Runs without the channels that are at fault whatever the model says, and these, as `diagnose` does."""
    return channels_at_fault(runs, judged_channels(runs, model), model.sensors, run_names(runs))


def drawn(detector: Detector, rng: np.random.Generator) -> tuple[Cause, Effect] | None:
    """A fault of the machine at twice its limit: a family, a place and a history by chance, of those at which that is
    a size that physics has. None where there is none."""
    known: dict[str, dict[tuple[str, bool], list[Hypothesis]]] = {}
    for batch, sizes in limits_in(detector):
        for (p, i), limit in np.ndenumerate(sizes):
            size, when = TWICE * float(limit) * (batch.sign or 1), batch.histories[i]
            if batch.family in FAMILIES and batch.unit == FAMILIES[batch.family] and batch.possible(p, size):
                of_place = known.setdefault(batch.family, {}).setdefault((batch.places[p], bool(when.windows)), [])
                of_place.append(Hypothesis(batch, p, when, 0.0, (size,)))
    if not known:
        return None
    places = known[str(rng.choice(sorted(known)))]
    histories = places[sorted(places)[rng.integers(len(places))]]
    h = histories[rng.integers(len(histories))]
    cause = cause_of(Accepted(h, (), np.array(h.amplitude), np.eye(1), 0.0, 0.0, ()), detector.study)
    entry = next(f for f in CATALOGUE if f.name == h.family)
    return cause, entry.edit(cause, detector.study)


def with_difference(run: Run, faulty: Run, plain: Run) -> Run:
    """The measured run with what a fault adds to its temperatures and displacements."""
    assert run.temperatures is not None
    assert run.tcp is not None
    columns = dict(run.temperatures.columns)
    for name in columns:
        if faulty.temperatures is not None and plain.temperatures is not None and name in faulty.temperatures.columns:
            added = faulty.temperatures.columns[name] - plain.temperatures.columns[name]
            columns[name] = columns[name] + np.interp(run.temperatures.time, faulty.temperatures.time, added)
    assert faulty.tcp is not None
    assert plain.tcp is not None
    added = faulty.tcp.displacement - plain.tcp.displacement
    at = np.column_stack([np.interp(run.tcp.time, faulty.tcp.time, c) for c in added.T])
    displacement = run.tcp.displacement + at - at[0]  # they count from the first row
    return replace(
        run, temperatures=replace(run.temperatures, columns=columns), tcp=replace(run.tcp, displacement=displacement)
    )


def _row(
    detector: Detector, plans: list[Measured], set_aside: list[Cause], days: Sequence[str], hidden: Cause | None
) -> tuple[Row, Detector]:
    """A diagnosis, and the detector that it ended with."""
    began = time.perf_counter()
    own = emptied(detector, plans)
    found, dispersion = searched(own, measured_of(with_measured(detector.study, plans)))
    verdict, causes = with_faults(*verdict_of(found, CATALOGUE), set_aside)
    told = None if hidden is None else (hidden.family, hidden.place, hidden.amplitude, hidden.history)
    row: Row = {"days": list(days), "hidden": told, "verdict": verdict, "set aside": [c.place for c in set_aside]}
    row["causes"] = [(c.family, c.place, c.amplitude, c.unit) for c in causes[len(set_aside) :]]
    row["rivals"] = [(r.family, r.place) for c in causes[len(set_aside) :][:1] for r in c.rivals]
    grown = raised(own, dispersion)
    row["best"] = [(h.family, h.name, round(h.statistic)) for h in found.steps[0].ranked[:3]]
    row |= {"dispersion": dispersion.share, "least": grown.least}
    return row | {"seconds": round(time.perf_counter() - began)}, grown


def answer(row: Row) -> str:
    """What a row is worth: its verdict where nothing is named, else as `benchmarks.rows.worth`."""
    if row["hidden"] is None:
        return "nothing" if row["verdict"] in ("nothing", "too_poor") else "false alarm"
    if row["verdict"] in ("nothing", "too_poor", "unknown") or not row["causes"]:  # then channels alone are named
        return row["verdict"].replace("_", " ")
    family, place = row["hidden"][:2]
    rivals = row["rivals"] if row["verdict"] == "ambiguous" else []
    return worth([(c[0], c[1]) for c in row["causes"]], [(r[0], r[1]) for r in rivals], {(family, place)})


def told(rows: Sequence[Row]) -> None:
    """Every diagnosis, and how many there are of each answer."""
    for clean in (True, False):
        own = [r for r in rows if (r["hidden"] is None) == clean]
        answers = [answer(r) for r in own]
        for r, a in zip(own, answers, strict=True):
            hidden = "" if clean else " {} {} {:.3g} {}".format(*r["hidden"])
            told = f"dispersion {r['dispersion']:.1f}, " if "dispersion" in r else ""
            print(f"      {' '.join(r['days'])}{hidden}: {a}, {r['verdict']} {r['causes']} {told}{r['seconds']} s")
        print(f"   {'as measured' if clean else 'a fault at twice its limit'}: {len(own)} diagnoses: {counts(answers)}")


if __name__ == "__main__":
    main()

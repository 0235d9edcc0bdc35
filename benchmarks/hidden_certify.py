"""The reduced truth of hidden-effect trials against the full model of the same mesh, with things hidden in it.

Three draws of parameters, two with sources, films and media at places, one with a lost joint, 12 h each: worst sensor
and worst TCP component must be within a tenth of the measurement noise (rms). Needs gmsh once, and some minutes a draw.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.five_axis import EXPERIMENT
from twin.build.acting import Acting, with_acting
from twin.build.places import pruned
from twin.build.simulate import simulate
from twin.inject.draw.trial import values_of
from twin.inject.experiment import NOISE, RUNS, START, STEP, STEPS, SUBSTEPS, TCP_NOISE
from twin.inject.truth.behaviour import Behaviour, Clean, clean_runs
from twin.inject.truth.reduced import full_with_places, reduced
from twin.logs.signals import signal_values
from twin.rom.apply import with_values
from twin.rom.drive import Drive, evaluate
from twin.rom.rescale import rescaled


@dataclass(frozen=True)
class Case:
    seed: int  # of the parameters
    run: int  # of RUNS
    heats: tuple[str, ...]
    films: tuple[str, ...]
    acting: Callable[[int, Drive], Acting] = lambda _run, _drive: Acting()
    loads: Callable[[int, Drive], Drive] = lambda _run, drive: drive


def _switched(drive: Drive, begin: float, end: float) -> np.ndarray:
    """(n,) 1 from begin to end [h]."""
    hours = drive.time[:-1] / 3600.0
    return ((hours >= begin) & (hours < end)).astype(float)


def _first(_: int, drive: Drive) -> Acting:
    """A source in a window, one that swings, coolant on the table."""
    swing = 12.0 * (1.0 + np.sin(2 * np.pi * drive.time[:-1] / 5400.0))
    return Acting(
        power={"column.right": 12.0 * _switched(drive, 2.0, 5.0), "swivel.back": swing},
        film={"table.top": 60.0 * _switched(drive, 6.0, 8.0)},
        medium={"table.top": np.full(drive.n_steps, 14.0)},
    )


def _second(_: int, drive: Drive) -> Acting:
    """Sun on the bed, a source that follows the spindle, more film on the bed and on the headstock."""
    hours = drive.time[:-1] / 3600.0
    bell = np.clip(np.cos(np.pi * (hours - 6.0) / 5.0), 0.0, None) * (np.abs(hours - 6.0) < 2.5)
    spindle = np.abs(EXPERIMENT.runs[1].loads.columns["spindle_speed"][:STEPS])
    return Acting(
        power={"bed.stem_left": 60.0 * bell, "headstock.front": 25.0 * (spindle / spindle.max()) ** 1.8},
        film={"bed.z_top": np.full(drive.n_steps, 15.0), "headstock.back": 12.0 * _switched(drive, 1.0, 9.0)},
        medium={"bed.z_top": drive.environment[:, 0], "headstock.back": drive.environment[:, 1]},
    )


def _lost(_: int, drive: Drive) -> Drive:
    """The spindle's flange keeps a 44th of its conductance for four hours: temperatures jump where none did."""
    fixed = [name for name, contact in EXPERIMENT.machine.contacts.items() if contact.kind == "fixed"]
    theta = drive.theta.copy()
    kept = 1.0 - (1.0 - 1.0 / 44.0) * _switched(drive, 4.0, 8.0)
    theta[:, len(EXPERIMENT.machine.films) + fixed.index("spindle_flange")] *= kept
    return replace(drive, theta=theta)


CASES = (
    Case(1, 0, ("column.right", "swivel.back"), ("table.top",), _first),
    Case(2, 1, ("bed.stem_left", "headstock.front"), ("bed.z_top", "headstock.back"), _second),
    Case(3, 1, (), (), loads=_lost),
)


def of_full(case: Case, values: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """Temperatures (n + 1, sensors) [degC] and TCP rows (m, 3) [m] of the full model."""
    known = reduced(EXPERIMENT)
    full, _ = full_with_places(EXPERIMENT)
    nominal = pruned(full.thermal, case.heats, case.films)
    there = with_values(nominal, known.parameters, values)
    bare, wanted = pruned(nominal).load_model, pruned(there).load_model
    run = EXPERIMENT.runs[case.run]
    logged = evaluate(bare, run.loads.time, signal_values(run, bare.signals), STEP)
    own = case.loads(case.run, rescaled(logged, bare, wanted))
    drive = with_acting(own, there.load_model, case.acting(case.run, own))
    faulty = replace(full, thermal=there)
    made = simulate(faulty, drive, known.tcp_time[case.run], known.positions[case.run], START, SUBSTEPS)
    return made.temperatures[:, : len(there.sensors)], made.tcp


def main() -> None:
    known = reduced(EXPERIMENT)
    print(f"   {sum(b.n for b in known.model.bodies)} states, {len(known.places)} places, {len(RUNS)} runs")
    for case in CASES:
        values = values_of(EXPERIMENT, "null", case.seed)
        # `simulate` has the structure of the nominal expansions
        values = {k: v for k, v in values.items() if not k.endswith(".expansion")}
        behaviour = Behaviour(heats=case.heats, films=case.films, acting=case.acting, loads=case.loads)
        clean_runs(EXPERIMENT, values, behaviour)  # compiled
        began = time.perf_counter()
        clean: Clean = clean_runs(EXPERIMENT, values, behaviour)[case.run]
        quick = time.perf_counter() - began
        began = time.perf_counter()
        T, tcp = of_full(case, values)
        slow = time.perf_counter() - began
        kelvin = clean.temperatures - T
        rms, each = np.sqrt(np.mean(kelvin**2, axis=0)), np.sqrt(np.mean((clean.tcp - tcp) ** 2, axis=0))
        worst = int(rms.argmax())
        print(
            f"   {RUNS[case.run]}, draw {case.seed}: three runs {quick:.1f} s, the full model's one {slow:.0f} s; worst"
            f" sensor {1e3 * rms[worst]:.1f} mK rms ({known.model.sensors[worst]}; largest difference"
            f" {1e3 * np.abs(kelvin).max():.0f} mK), allowed {1e2 * NOISE:.0f} mK; TCP {1e6 * each.max():.3f} um rms,"
            f" allowed {1e5 * TCP_NOISE:.1f} um",
            flush=True,
        )


if __name__ == "__main__":
    main()

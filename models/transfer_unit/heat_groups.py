"""Passive and dynamic sources switched on and off: heat balance and TCP displacement of each group.

Paper 002 (section 2) splits the heat: passive from the environment (here with the electronics, which run whether the
unit works or not), dynamic from motion and drives. A group is switched off by zero gains of its sources; without the
passive one the room also stays at the temperature of the start, without the dynamic one the unit does not warm the air
around it.

    python models/transfer_unit/heat_groups.py out/transfer_unit.h5 models/transfer_unit/runs/working_day
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

from twin.run.replay import replay  # isort: skip  first: it prepares JAX before NumPy is loaded

import numpy as np

from twin.logs.read import read_run
from twin.logs.run import Run
from twin.rom.artefact import Artefact, read_artefact
from twin.rom.load_model import LoadModel
from twin.run.results import Result

PASSIVE = ("electronics",)
ZONES = {
    "bottom zone": ("bottom",),
    "top zone": ("top",),
    "around the unit": ("table", "column", "x_slide", "y_slide", "headstock", "spindle", "screws"),
}
CASES = {"both": (True, True), "passive": (True, False), "dynamic": (False, True)}


def switched(load: LoadModel, passive: bool, dynamic: bool) -> LoadModel:
    """The load model with the sources of a group on (gain as described) or off (gain 0)."""
    on = {True: passive, False: dynamic}
    return replace(load, sources=tuple(s if on[s.name in PASSIVE] else replace(s, gain=0.0) for s in load.sources))


def air(run: Run, passive: bool, dynamic: bool) -> Run:
    """The run with the air of its case: without the passive group the room stays as at the start, without the dynamic
    one the air around the unit is that of the room."""
    room, cabin = run.loads.columns["room"], run.loads.columns["cabin"]
    warmer = cabin - room if dynamic else np.zeros_like(room)
    outside = room if passive else np.full_like(room, room[0])
    columns = {**run.loads.columns, "room": outside, "cabin": outside + warmer}
    return replace(run, loads=replace(run.loads, columns=columns))


def results(artefact: Artefact, run: Run, dt: float = 60.0) -> dict[str, Result]:
    """The run with both groups, the passive one and the dynamic one alone."""
    found = {}
    for name, (passive, dynamic) in CASES.items():
        model = replace(artefact.model, load_model=switched(artefact.model.load_model, passive, dynamic))
        found[name] = replay(replace(artefact, model=model), air(run, passive, dynamic), dt)
    return found


def heat(result: Result) -> dict[str, float]:
    """Heat over the run [J]: in by group of sources, in by zone of films (negative: out), stored; they balance."""
    dt = np.diff(result.time)
    power = dict(zip(result.sources, result.power.T @ dt, strict=True))
    flow = dict(zip(result.films, result.film_heat.T @ dt, strict=True))
    return {
        "passive sources": sum(power[name] for name in PASSIVE),
        "dynamic sources": sum(q for name, q in power.items() if name not in PASSIVE),
        **{zone: sum(flow[name] for name in names) for zone, names in ZONES.items()},
        "stored": float(result.stored.sum()),
    }


def middle_displacement(result: Result) -> np.ndarray:
    """TCP displacement (n + 1, 3) [m] at the middle pose, from the start of the run."""
    middle = int(np.linalg.norm(result.poses - result.poses.mean(axis=0), axis=1).argmin())
    return result.tcp[:, middle] - result.tcp[0, middle]


def main(artefact: str, run: str) -> None:
    found = results(read_artefact(Path(artefact)), read_run(Path(run)))
    rows = {name: heat(result) for name, result in found.items()}
    print(f"{'heat in [MJ]':18}" + "".join(f"{name:>10}" for name in found))
    for entry in next(iter(rows.values())):
        print(f"{entry:18}" + "".join(f"{1e-6 * row[entry]:10.3f}" for row in rows.values()))
    print(f"{'balance closes to':18}" + "".join(f"{r.balance_error.max():10.0e}" for r in found.values()))
    for c, name in enumerate("xyz"):
        ends = [middle_displacement(r)[-1, c] for r in found.values()]
        print(f"{f'd{name} at the end [um]':18}" + "".join(f"{1e6 * w:10.1f}" for w in ends))


if __name__ == "__main__":
    main(*sys.argv[1:])

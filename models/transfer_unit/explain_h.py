"""What explains the warm top of the machine: a large film coefficient, or heat from the electronics?

Paper 002 calibrates the film of the top zone from 5 to 25 W/(m^2 K) and reads it as calm air; erratum E-002-10: the
electronics that are switched on first heat the top, and a film alone must absorb that. Here the full model with the
electronics' heat and free convection plus radiation is the truth; its top sensors TP4 to TP6 in the run `passive` are
then explained twice by the same model with a constant film h of the top zone: without the electronics, h free, and
with them, h and their heat Q free. The model is linear in Q, so for each h the best Q is a small least-squares problem.

    python models/transfer_unit/explain_h.py
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from twin.build.mesh import load_body_meshes
from twin.build.stepper import CoupledStepper, sensor_temperatures
from twin.build.thermal import assemble_thermal
from twin.logs.read import read_run
from twin.logs.run import Run
from twin.logs.signals import signal_values
from twin.machine.description import Machine
from twin.machine.load import load_machine
from twin.rom.drive import evaluate

FOLDER = Path(__file__).parent
TOP_FILM, TOP_SENSORS = "top", ("TP4", "TP5", "TP6")
SCAN = (3.0, 5.0, 6.0, 7.0, 8.0, 10.0, 12.0, 15.0, 20.0, 25.0, 30.0, 40.0, 60.0)  # W/(m^2 K); 60 is the bound
PHYSICAL = (2.0, 12.0)  # W/(m^2 K): free convection and radiation of painted surfaces at differences below 10 K
STEP = 600.0  # s
SIGMA = 0.05  # K, noise of the sensors


@dataclass(frozen=True)
class Explanation:
    """Best fit over the scan."""

    h: float  # W/(m^2 K)
    power: float  # W of the electronics
    rms: float  # K over the top sensors and all times


@dataclass(frozen=True)
class Top:
    """What a model says of the top zone."""

    temperature: np.ndarray  # (n + 1, 3) degC of the top sensors
    coefficient: float  # W/(m^2 K), mean over the run, radiation included


def with_top_film(machine: Machine, h: float) -> Machine:
    """The machine with a constant film h [W/(m^2 K)], radiation included, in the top zone."""
    change = {"law": "constant_film", "parameters": {"natural": h}, "gain": 1.0, "emissivity": 0.0}
    film = machine.films[TOP_FILM].model_copy(update=change)
    return machine.model_copy(update={"films": machine.films | {TOP_FILM: film}})


def with_electronics(machine: Machine, power: float) -> Machine:
    """The machine with electronics of this heat [W]."""
    source = machine.sources["electronics"]
    changed = source.model_copy(update={"parameters": {"power": power}})
    return machine.model_copy(update={"sources": machine.sources | {"electronics": changed}})


def top_of(machine: Machine, run: Run, dt: float = STEP) -> Top:
    """The full thermal model through a run; no structure, no reduction."""
    model = assemble_thermal(machine, load_body_meshes(machine))
    drive = evaluate(model.load_model, run.loads.time, signal_values(run, model.load_model.signals), dt)
    stepper = CoupledStepper(model)
    start = run.initial_temperature
    if start is None:
        start = float(drive.environment[0, 0])
    columns = [model.sensors.index(name) for name in TOP_SENSORS]
    film = [f.name for f in model.load_model.films].index(TOP_FILM)
    x = stepper.uniform(start)
    rows, coefficients = [sensor_temperatures(model, x)[columns]], []
    for step, after, _ in stepper.run(drive, x, 1):
        coefficients.append(stepper.loads(drive, step, x).theta[film])
        x = after
        rows.append(sensor_temperatures(model, x)[columns])
    return Top(np.array(rows), float(np.mean(coefficients)))


def film_alone(measured: np.ndarray, tops: Sequence[np.ndarray], scan: Sequence[float]) -> Explanation:
    """The h of the scan whose temperatures `tops` (one (n, k) array per h, no electronics) come nearest."""
    rms = [float(np.sqrt(np.mean((top - measured) ** 2))) for top in tops]
    best = int(np.argmin(rms))
    return Explanation(scan[best], 0.0, rms[best])


def film_and_source(
    measured: np.ndarray, tops: Sequence[np.ndarray], per_watt: Sequence[np.ndarray], scan: Sequence[float]
) -> Explanation:
    """The same with Q free: per_watt holds the temperature rise [K/W] that the electronics bring at each h."""
    found = []
    for h, top, slope in zip(scan, tops, per_watt, strict=True):
        Q = max(0.0, float(np.sum(slope * (measured - top)) / np.sum(slope**2)))
        found.append(Explanation(h, Q, float(np.sqrt(np.mean((top + Q * slope - measured) ** 2)))))
    return min(found, key=lambda e: e.rms)


def explain(machine: Machine, run: Run, scan: Sequence[float] = SCAN, seed: int = 0) -> tuple[Explanation, Explanation]:
    """(film alone, film and source) for the top sensors of a simulated measurement with noise."""
    truth = top_of(machine, run).temperature
    measured = truth + SIGMA * np.random.default_rng(seed).standard_normal(truth.shape)
    cold = [top_of(with_electronics(with_top_film(machine, h), 0.0), run).temperature for h in scan]
    hot = [top_of(with_electronics(with_top_film(machine, h), 100.0), run).temperature for h in scan]
    per_watt = [(b - a) / 100.0 for a, b in zip(cold, hot, strict=True)]
    return film_alone(measured, cold, scan), film_and_source(measured, cold, per_watt, scan)


def lumped(time: np.ndarray, room: np.ndarray, h: float, Q: float, capacity: float, area: float) -> np.ndarray:
    """C T' = Q - h A (T - T_room) by the exact step for a room that is constant between samples; starts at room[0].

    time (n,) s, room (n,) degC -> (n,) degC.
    """
    T = np.empty_like(room)
    T[0] = room[0]
    for k in range(1, len(time)):
        end = room[k - 1] + Q / (h * area)
        T[k] = end + (T[k - 1] - end) * np.exp(-h * area / capacity * (time[k] - time[k - 1]))
    return T


def explain_lumped(
    h: float = 6.0, Q: float = 150.0, capacity: float = 2e5, area: float = 8.0, bound: float = 60.0, seed: int = 0
) -> tuple[Explanation, Explanation]:
    """The demonstration of E-002-10 with one capacity: (film alone up to the bound, film and source)."""
    time = np.arange(0.0, 8 * 3600.0, 60.0)
    room = 20.0 + 3.0 * time / time[-1]
    measured = lumped(time, room, h, Q, capacity, area) + SIGMA * np.random.default_rng(seed).standard_normal(len(time))
    scan = np.linspace(1.0, bound, 591)
    tops = [lumped(time, room, x, 0.0, capacity, area) for x in scan]
    slopes = [lumped(time, room, x, 1.0, capacity, area) - top for x, top in zip(scan, tops, strict=True)]
    return film_alone(measured, tops, scan), film_and_source(measured, tops, slopes, scan)


def main() -> None:
    one, two = explain_lumped()
    print(f"one capacity, truth h 6, Q 150: film alone h {one.h:.1f}, rms {one.rms:.2f} K; "
          f"with the source h {two.h:.2f}, Q {two.power:.0f} W, rms {two.rms:.3f} K")  # fmt: skip
    machine, run = load_machine(FOLDER), read_run(FOLDER / "runs" / "passive")
    one, two = explain(machine, run)
    h, Q = top_of(machine, run).coefficient, machine.sources["electronics"].parameters["power"]
    print(f"transfer unit, run passive, {', '.join(TOP_SENSORS)}, noise {SIGMA} K; truth: h {h:.1f} on average, Q {Q}")
    print(f"  film alone:      h {one.h:5.1f} W/(m^2 K), rms {one.rms:.3f} K")
    print(f"  film and source: h {two.h:5.1f} W/(m^2 K), Q {two.power:.1f} W, rms {two.rms:.3f} K")


if __name__ == "__main__":
    main()

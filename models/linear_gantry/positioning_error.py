"""The paper's Figs. 6 to 8 by the full model: highest rise, TCP displacement, positioning error of Y by eq (27).

The machine is stepped as the paper does, 48 steps of 5 min. All figures are changes since the start of the run. Of the
terms of eq (27) only the sum of the first two depends on no choice: the first takes the motors as datum, as if they
held the gantry where they are; the paper does not say what holds it along Y.

Then the run `constant_room` with coolers of other sizes, because the paper rates none.

    python models/linear_gantry/positioning_error.py
    python models/linear_gantry/positioning_error.py --fine        # elements of half the size, once
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from twin.build.cached_models import full_model
from twin.build.encoder import EncoderTerms
from twin.build.full_model import FullModel, assemble
from twin.build.stepper import CoupledStepper, sensor_temperatures
from twin.logs.read import read_run
from twin.logs.run import Run
from twin.logs.signals import signal_values
from twin.machine.description import Machine
from twin.machine.load import load_machine
from twin.physics.motors import motor_winding
from twin.rom.drive import evaluate
from twin.rom.load_model import LoadModel, Source

FOLDER = Path(__file__).parent
COLUMNS = ("column_1", "column_2")
MOTORS = ("y_motor_1", "y_motor_2")
RATED = 24.0  # A rms at nominal force (make_runs.py)
SHARES = (0.95, 0.98, 0.99)  # of the copper loss at 24 degC that the coolers take
RUNS = ("constant_room", "ramped_room", "standing")
DT = 300.0  # s
FAR = {"y": 0.4, "x": 0.0, "z": 0.0}  # m, the paper's position


@dataclass(frozen=True)
class Story:
    """A run, from its start; n + 1 times."""

    time: np.ndarray  # s
    rise: np.ndarray  # (n + 1, n_sensors) K
    tcp: np.ndarray  # (n + 1, 3) m, tool minus work at Y = 400 mm, as the scales make it
    terms: EncoderTerms  # of Y at Y = 400 mm, at the end
    rises: dict[str, float]  # K, the highest in each part, at the end
    power: dict[str, float]  # W, mean over the last step
    copper: float  # W of a Y motor, coolers left out, at the end
    balance: float


def story(full: FullModel, run: Path) -> Story:
    log, load = read_run(run), full.thermal.load_model
    drive = evaluate(load, log.loads.time, signal_values(log, load.signals), DT, None)
    stepper = CoupledStepper(full.thermal)
    assert log.initial_temperature is not None
    first = x = stepper.uniform(log.initial_temperature)
    tcp, sensors = [full.structure.displacement(FAR, x)], [sensor_temperatures(full.thermal, x)]
    balance, power = 0.0, np.zeros(0)
    for _, x, heat in stepper.run(drive, x):  # noqa: B020  x goes on from where it began
        tcp.append(full.structure.displacement(FAR, x))
        sensors.append(sensor_temperatures(full.thermal, x))
        balance, power = max(balance, heat.balance_error), heat.power
    before, after = (full.structure.encoder_terms("y", FAR, fields) for fields in (first, x))
    terms = EncoderTerms(after.tcp - before.tcp, after.reader - before.reader, after.scale - before.scale)
    rises = {
        part.name: float(np.max((now - then)[offset : offset + part.n]))
        for body, now, then in zip(full.bodies, x, first, strict=True)
        for part, offset in zip(body.parts, body.offsets, strict=True)
    }
    return Story(
        drive.time - drive.time[0], np.array(sensors) - sensors[0], np.array(tcp) - tcp[0], terms,
        rises, dict(zip((s.name for s in load.sources), power, strict=True)),
        _copper(load, log, sensor_temperatures(full.thermal, x)[full.thermal.sensors.index("column")]), balance,
    )  # fmt: skip


def _copper(load: LoadModel, log: Run, temperature: float) -> float:
    """W of a Y motor by the last current of a log, at the temperature [degC] beside it."""
    given = next(s.use.parameters for s in load.sources if s.name == MOTORS[0])
    current = float(log.loads.columns["y_current"][-1])
    return float(motor_winding(current, temperature, given["resistance"], given["coefficient"]))


def cooled(full: FullModel, share: float) -> FullModel:
    """The same machine with coolers of the Y motors that take this share of their copper loss at 24 degC."""
    load = full.thermal.load_model
    sources = tuple(s if s.name not in MOTORS else _cooled(s, share) for s in load.sources)
    return replace(full, thermal=replace(full.thermal, load_model=replace(load, sources=sources)))


def _cooled(source: Source, share: float) -> Source:
    given = source.use.parameters
    copper = motor_winding(RATED, 24.0, given["resistance"], given["coefficient"])
    return replace(source, use=replace(source.use, parameters={**given, "cooling_max": share * float(copper)}))


def finer(machine: Machine) -> Machine:
    """The same boxes in elements of half the size."""
    parts = {
        name: part.model_copy(update={"box": part.box.model_copy(update={"divisions": _twice(part.box.divisions)})})
        for name, part in machine.parts.items()
        if part.box is not None
    }
    return machine.model_copy(update={"parts": parts})


def _twice(divisions: tuple[int, int, int]) -> tuple[int, int, int]:
    a, b, c = divisions
    return 2 * a, 2 * b, 2 * c


def main(fine: bool = False) -> None:
    machine = load_machine(FOLDER)
    if fine:
        full = assemble(finer(machine))
        told = story(full, FOLDER / "runs" / RUNS[0])
        end = ", ".join(f"d{axis} {1e6 * w:+.2f}" for axis, w in zip("XYZ", told.tcp[-1], strict=True))
        print(f"{RUNS[0]} with {sum(body.n for body in full.bodies):,} nodes: {end} um")
        return
    full = full_model(machine)
    for name in RUNS:
        told = story(full, FOLDER / "runs" / name)
        end = ", ".join(f"d{axis} {1e6 * w:+.1f}" for axis, w in zip("XYZ", told.tcp[-1], strict=True))
        hour = int(np.searchsorted(told.time, 3600.0))
        print(f"{name}, after {told.time[-1] / 60:.0f} min at Y = 400 mm: {end} um")
        print(f"  error of Y by eq (27): {told.terms}; after 60 min {1e6 * told.tcp[hour, 1]:+.1f} um")
        hottest = max(told.rises, key=lambda part: told.rises[part])
        print(f"  highest rise: {told.rises[hottest]:.2f} K in {hottest}, ", end="")
        print(f"{max(told.rises[c] for c in COLUMNS):.2f} K in a column; sensors: ", end="")
        print(", ".join(f"{s} {r:+.2f}" for s, r in zip(full.thermal.sensors, told.rise[-1], strict=True)) + " K")
        copper, motor = told.copper, told.power[MOTORS[0]]
        print(f"  copper loss of a motor {copper:.0f} W, of which {motor:.1f} W stay; ", end="")
        print("heat: " + ", ".join(f"{s} {p:.1f}" for s, p in told.power.items()) + " W", end="")
        print(f"; balance closes to {told.balance:.0e}")
    print("constant_room again, coolers that take another share of the copper loss:")
    for share in SHARES:
        told = story(cooled(full, share), FOLDER / "runs" / RUNS[0])
        column, dy = max(told.rises[c] for c in COLUMNS), 1e6 * told.tcp[-1, 1]
        power = told.power[MOTORS[0]]
        print(f"  {100 * share:.0f} %: {power:.1f} W per motor, {column:.2f} K in a column, dY {dy:+.1f} um")


if __name__ == "__main__":
    main(sys.argv[1:] == ["--fine"])

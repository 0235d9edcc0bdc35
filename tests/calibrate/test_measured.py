"""What a fit compares, and what it says that it leaves out."""

from __future__ import annotations

from dataclasses import replace

from tests.calibrate import lumped_case
from twin.calibrate.fit.measured import measured
from twin.logs.run import Table
from twin.logs.signals import signal_values
from twin.rom.drive import evaluate


def test_columns_that_nothing_reads_are_counted_and_those_of_signals_are_not():
    """A water temperature that stands beside the sensors is a signal."""
    run, model = lumped_case.truth({}), lumped_case.artefact().model
    loads, temperatures = run.loads, run.temperatures
    assert temperatures is not None
    water = {"coolant_inlet": temperatures.time * 0.0 + 20.0}
    columns = temperatures.columns | water | {"cupboard": water["coolant_inlet"]}
    beside = replace(
        run,
        loads=Table(loads.time, {n: v for n, v in loads.columns.items() if n not in water}, loads.units),
        temperatures=Table(temperatures.time, columns, dict.fromkeys(columns, "degC")),
    )
    drive = evaluate(model.load_model, loads.time, signal_values(beside, model.load_model.signals), 60.0)
    told = [text for text in measured(model, beside, drive, "run").skipped if "sensor of the machine" in text]
    assert told == ["1 column that is no sensor of the machine: cupboard"]

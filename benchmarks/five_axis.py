"""The shipped machine, built once for all benchmarks."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from twin.build.full_model import FullModel
from twin.build.pipeline import BuildOptions, compact_model, full_model, rich_model
from twin.inject.experiment import Experiment
from twin.machine.description import Machine
from twin.machine.load import load_machine
from twin.progress import bar
from twin.rom.model import MachineModel

FOLDER = Path(__file__).parents[1] / "models" / "five_axis"
EXPERIMENT = Experiment(FOLDER)
TRUTHS = Path(__file__).parents[1] / "tests" / "hidden" / "truth"  # of the stored trials


@cache
def machine() -> Machine:
    return load_machine(FOLDER / "machine.toml")


@cache
def full() -> FullModel:
    return full_model(machine(), bar)


@cache
def rich() -> MachineModel:
    return rich_model(machine(), full(), BuildOptions().rich, bar)


@cache
def compact() -> MachineModel:
    return compact_model(machine(), rich(), BuildOptions(), bar)

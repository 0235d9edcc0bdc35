"""A machine drawn from a seed, with the loads of its runs."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal

import numpy as np

from twin.atomic import atomic_folder
from twin.errors import TwinError
from twin.inject.machines.draws import between, one_of
from twin.inject.machines.loads import LoadsOfRun, loads_of_run
from twin.inject.machines.machine_of_boxes import machine_of_boxes
from twin.inject.machines.network import network
from twin.inject.machines.scale import Wanted, power_factor
from twin.logs.read import read_run
from twin.machine.description import Machine
from twin.machine.load import load_machine

Kind = Literal["boxes", "lumped"]
RUNS = ("first", "second", "sealed")  # two to fit to, one to judge by
HOURS = (4, 12)
SAMPLINGS = (60.0, 120.0, 300.0)  # s
WARMEST = (4.5, 9.0)  # K, that the warmest sensor shall rise in the first run
NOISE = ((0.02, 0.1), (0.3e-6, 1.0e-6))  # K, of sensors; m, of TCP rows: standard deviations of usual instruments
ATTEMPTS = 40  # draws of one seed; most succeed in the first three


@dataclass(frozen=True)
class DrawnMachine:
    """A description, the loads of its runs, and how it is measured."""

    seed: int
    kind: Kind  # a machine of boxes, or a lumped one
    text: str  # machine.toml
    runs: tuple[LoadsOfRun, ...]  # in the order of RUNS
    hours: int  # of each run
    sampling: float  # s, of the loads
    noise: tuple[float, float]  # K of sensors, m of the TCP: standard deviations
    sensors: int  # those in the air included
    parts: int  # main parts, or nodes and bars

    def machine(self, folder: Path = Path(".")) -> Machine:
        """The description as loaded; folder: where it lies or would lie."""
        return load_machine(folder / "machine.toml", self.text)

    def write(self, folder: Path | str) -> None:
        """Write machine.toml and runs/NAME into a new folder, whole or not at all.

        Raises TwinError where the folder holds something, or cannot be written.
        """
        folder = Path(folder)
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise TwinError("is in use", str(folder), "name a folder that is not there yet")
        with atomic_folder(folder) as new:
            (new / "machine.toml").write_text(self.text, encoding="utf-8")
            for run in self.runs:
                run.write(new / "runs" / run.name)


def draw_machine(seed: int, kind: Kind | None = None) -> DrawnMachine:
    """The machine of a seed (>= 0): a description without problems, and three runs of loads.

    kind: drawn, too, by default. In the first run the warmest sensor rises by 4 to 11 K and the TCP moves by 8 to
    42 um, as the full model has it in coarse steps of time: draws that do not allow that are discarded. The same seed
    and kind give the same text; where it is computed may move the third digit of powers at most.
    Raises TwinError for negative seeds, and where no draw succeeds.
    """
    if seed < 0:
        raise TwinError(f"{seed} is no seed", "SEED", "give a whole number that is not negative")
    kinds: tuple[Kind, ...] = ("boxes", "lumped")
    own: Kind = kind if kind is not None else one_of(np.random.default_rng(seed), kinds)
    for attempt in range(ATTEMPTS):
        rng = np.random.default_rng([seed, attempt])
        if (found := _attempt(rng, seed, own)) is not None:
            return found
    raise TwinError(f"no machine in {ATTEMPTS} draws", f"seed {seed}", "take another seed")


def main(arguments: list[str]) -> int:
    """SEED FOLDER [boxes|lumped]: write the machine of a seed to a folder; returns the exit status."""
    if len(arguments) not in (2, 3) or not arguments[0].isdigit() or arguments[2:] not in ([], ["boxes"], ["lumped"]):
        print("usage: python -m twin.inject.machines SEED FOLDER [boxes|lumped]", file=sys.stderr)
        return 2
    names: dict[str, Kind] = {"boxes": "boxes", "lumped": "lumped"}
    try:
        drawn = draw_machine(int(arguments[0]), names.get("".join(arguments[2:])))
        drawn.write(arguments[1])
    except TwinError as e:
        print(e, file=sys.stderr)
        return 2
    print(f"{arguments[1]}: {drawn.kind}, {drawn.parts} parts, {drawn.sensors} sensors, runs of {drawn.hours} h")
    return 0


def _attempt(rng: np.random.Generator, seed: int, kind: Kind) -> DrawnMachine | None:
    """One draw, or None where no power brings sensors and TCP into their ranges."""
    hours, sampling = int(rng.integers(HOURS[0], HOURS[1] + 1)), one_of(rng, SAMPLINGS)
    noise = (between(rng, *NOISE[0], 2), between(rng, *NOISE[1], 2))
    wanted = Wanted(between(rng, *WARMEST))
    seeds = [int(s) for s in rng.integers(2**31, size=len(RUNS))]
    made = machine_of_boxes if kind == "boxes" else network
    text, parts = made(rng, f"drawn_{seed}")
    machine = load_machine(Path("machine.toml"), text(1.0))
    runs = tuple(loads_of_run(machine, s, n, hours, sampling) for s, n in zip(seeds, RUNS, strict=True))
    with TemporaryDirectory() as folder:
        runs[0].write(Path(folder) / runs[0].name)
        log = read_run(Path(folder) / runs[0].name)
    factor = power_factor(machine, log, wanted)
    if factor is None:
        return None
    return DrawnMachine(seed, kind, text(factor), runs, hours, sampling, noise, len(machine.sensors), parts)

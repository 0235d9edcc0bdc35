"""Build and verify: the stages in their order, from a description to a certified compact model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from twin.build.cached_models import full_model as full_model  # the first stages, offered beside the others
from twin.build.cached_models import rich_model as rich_model
from twin.build.certificate import Certificate, Comparison, certify, compare
from twin.build.compress import Tolerances, balanced, galerkin, trajectories
from twin.build.rich_basis import RichOptions
from twin.build.scenario import Scenario, draw
from twin.build.workers import LONG
from twin.machine.description import Machine
from twin.progress import Progress, silent
from twin.rom.following import FOLLOW, difference_place
from twin.rom.load_model import LoadModel
from twin.rom.model import MachineModel

LARGE = 10_000  # nodes of a full model of which each scenario takes its own process from the start
TRAINING_SEED = 1000
BUILD_SEED = 5000  # held-out scenarios of `twin build`
TYPICAL_DIFFERENCE = 10.0  # K, and
RADIATION = 6.0  # W/(m^2 K) at emissivity 1: for an estimate of costs only
VERIFY_SEED = 9000  # held-out scenarios of `twin verify`: not even the build has seen them


@dataclass(frozen=True)
class BuildOptions:
    method: Literal["galerkin", "balanced"] = "galerkin"
    states: int = 500  # of the whole machine
    rich: RichOptions = RichOptions()
    training: int = 90  # scenarios: two thirds long ones at twice the step, one third short ones at the substep
    held_out: int = 19
    hours: float = 2.0  # of every held-out scenario; its steady state comes on top
    step: float = 60.0  # s
    substeps: int = 4  # of the held-out scenarios, as many as `twin run` takes


def training_scenarios(load: LoadModel, options: BuildOptions, still: bool = False) -> list[Scenario]:
    """Long ones for the slow modes, short ones at the substep for the fast modes that a load step excites.

    still: with all axes at rest in mid-stroke.
    """
    kinds = [(4.0, 2 * options.step)] * 2 + [(1.0, options.step / options.substeps)]
    return [draw(load, TRAINING_SEED + i, *kinds[i % 3], still) for i in range(options.training)]


def compact_model(
    machine: Machine, rich: MachineModel, options: BuildOptions, progress: Progress = silent
) -> MachineModel:
    """The rich model compressed to `options.states` states; itself where it has no more than that."""
    if rich.n <= options.states:
        return rich
    unit = Tolerances(machine.limits.temperature, machine.limits.displacement)
    scenarios = training_scenarios(rich.load_model, options)
    with progress("training scenarios", len(scenarios)) as advance:
        snapshots = trajectories(rich, scenarios, lambda scenario: advance(scenario.label))
    compress = {"galerkin": galerkin, "balanced": balanced}[options.method]
    return compress(rich, snapshots, options.states, unit)


def held_out(model: MachineModel, options: BuildOptions, seed: int) -> list[Scenario]:
    return [draw(model.load_model, seed + i, options.hours, options.step) for i in range(options.held_out)]


def chosen_for_full(load: LoadModel, scenarios: Sequence[Scenario], count: int) -> list[Scenario]:
    """The scenarios with the fewest changes of theta, one of them with at least one change.

    Each change beyond what a factor bears costs the full model a factorisation. They are chosen by cost, before any
    error is known, so the choice does not flatter the certificate.
    """

    emissivity = np.array([f.emissivity for f in load.films])

    def changes(scenario: Scenario) -> int:
        drive, count = scenario.drive, 0
        place = round(float(difference_place(np, TYPICAL_DIFFERENCE)))
        theta = drive.theta.copy()
        theta[:, list(drive.films.index)] = drive.films.value[:, :, place]
        if drive.radiation:
            theta[:, : len(emissivity)] += RADIATION * emissivity
        held = theta[0]
        for now in theta[1:]:
            if np.any(np.abs(now - held) > FOLLOW * held):
                held, count = now, count + 1
        return count

    ranked = sorted(scenarios, key=changes)
    first_changing = next((s for s in ranked if changes(s)), ranked[-1])
    return [first_changing, *(s for s in ranked if s is not first_changing)][:count]


def certificate(
    machine: Machine,
    rich: MachineModel,
    compact: MachineModel,
    full: MachineModel | None,
    options: BuildOptions,
    seed: int,
    full_scenarios: int = 2,
    progress: Progress = silent,
) -> Certificate:
    """Compact against rich on all held-out scenarios; rich against full on some, where `full` is given."""
    scenarios = held_out(rich, options, seed)
    with progress("compact against rich", len(scenarios)) as advance:
        small = compare(rich, compact, scenarios, options.substeps, advance)
    large: Comparison | None = None
    if full is not None:
        chosen = chosen_for_full(rich.load_model, scenarios, full_scenarios)
        with progress("rich against full", len(chosen)) as advance:
            at_once = 0.0 if full.n > LARGE else LONG
            large = compare(full, rich, chosen, options.substeps, advance, at_once)
    return certify(rich, small, large, machine.limits, options.hours, options.step, options.substeps)

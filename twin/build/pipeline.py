"""Build and verify: the stages in their order, from a description to a certified compact model."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from twin.build.cache import cached, machine_hash
from twin.build.certificate import Certificate, Comparison, certify, compare
from twin.build.compress import Tolerances, balanced, galerkin, trajectories
from twin.build.full_model import FullModel, assemble
from twin.build.project import project
from twin.build.rich_basis import RichOptions, rich_basis
from twin.build.scenario import Scenario, draw, theta_bounds
from twin.machine.description import Machine
from twin.progress import Progress, silent
from twin.rom.load_model import LoadModel
from twin.rom.model import MachineModel

TRAINING_SEED = 1000
BUILD_SEED = 5000  # held-out scenarios of `twin build`
VERIFY_SEED = 9000  # held-out scenarios of `twin verify`: not even the build has seen them


@dataclass(frozen=True)
class BuildOptions:
    method: Literal["galerkin", "balanced"] = "galerkin"
    states: int = 400  # of the whole machine
    rich: RichOptions = RichOptions()
    training: int = 90  # scenarios: two thirds long ones at twice the step, one third short ones at the substep
    held_out: int = 19
    hours: float = 2.0  # of every held-out scenario; its steady state comes on top
    step: float = 60.0  # s
    substeps: int = 4  # of the held-out scenarios, as many as `twin run` takes


def full_model(machine: Machine, progress: Progress = silent) -> FullModel:
    """The assembled full model, cached."""
    return cached("full", (machine_hash(machine),), lambda: assemble(machine, progress))


def rich_model(
    machine: Machine, full: FullModel | None, options: RichOptions, progress: Progress = silent
) -> MachineModel:
    """The full model projected on the rich bases of its bodies, cached."""

    def make() -> MachineModel:
        model = (full or full_model(machine, progress)).thermal
        low, high = theta_bounds(model.load_model)
        bodies = []
        with progress("rich basis", options.samples * len(model.bodies)) as advance:
            for body in model.bodies:
                bodies.append(project(body, rich_basis(body, low, high, options, advance)))
        return replace(model, bodies=tuple(bodies))

    return cached("rich", (machine_hash(machine), options), make)


def training_scenarios(load: LoadModel, options: BuildOptions, still: bool = False) -> list[Scenario]:
    """Long ones for the slow modes, short ones at the substep for the fast modes that a load step excites.

    still: with all axes at rest in mid-stroke.
    """
    kinds = [(4.0, 2 * options.step)] * 2 + [(1.0, options.step / options.substeps)]
    return [draw(load, TRAINING_SEED + i, *kinds[i % 3], still) for i in range(options.training)]


def compact_model(
    machine: Machine, rich: MachineModel, options: BuildOptions, progress: Progress = silent
) -> MachineModel:
    """The rich model compressed to `options.states` states."""
    unit = Tolerances(machine.limits.temperature, machine.limits.displacement)
    scenarios = training_scenarios(rich.load_model, options)
    with progress("training scenarios", len(scenarios)) as advance:

        def reported() -> Iterator[Scenario]:
            for scenario in scenarios:
                yield scenario
                advance(scenario.label)

        snapshots = trajectories(rich, reported())
    compress = {"galerkin": galerkin, "balanced": balanced}[options.method]
    return compress(rich, snapshots, options.states, unit)


def held_out(model: MachineModel, options: BuildOptions, seed: int) -> list[Scenario]:
    return [draw(model.load_model, seed + i, options.hours, options.step) for i in range(options.held_out)]


def chosen_for_full(scenarios: Sequence[Scenario], count: int) -> list[Scenario]:
    """The scenarios with the fewest changes of theta, one of them with at least one change.

    Each change costs the full model a factorisation of every body. They are chosen by cost, before any error is known,
    so the choice does not flatter the certificate.
    """

    def changes(scenario: Scenario) -> int:
        return int(np.any(np.diff(scenario.drive.theta, axis=0) != 0, axis=1).sum())

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
        chosen = chosen_for_full(scenarios, full_scenarios)
        with progress("rich against full", len(chosen)) as advance:
            large = compare(full, rich, chosen, options.substeps, advance)
    return certify(rich, small, large, machine.limits, options.hours, options.step, options.substeps)

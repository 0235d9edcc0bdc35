"""Build and verify: the stages in their order, from a description to a certified compact model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, Protocol

import numpy as np

from twin.build.cached_models import full_model as full_model  # the first stages, offered beside the others
from twin.build.cached_models import rich_model as rich_model
from twin.build.certificate import REDUCTION, RICH, STEP, Certificate, Part, certify
from twin.build.comparison import FINER, TINY, Comparison, Way, compare_ways
from twin.build.compress import Tolerances, balanced, galerkin, trajectories
from twin.build.rich_basis import RichOptions
from twin.build.scenario import Scenario, draw
from twin.build.workers import LONG
from twin.machine.description import Limits
from twin.progress import Progress, silent
from twin.rom.following import FOLLOW, difference_place
from twin.rom.load_model import LoadModel
from twin.rom.model import MachineModel

# Scenarios for the error of the time step are so many times shorter than others, as each of them takes the steps of its
# reference, too, and it is changes of loads that a step resolves badly. Five of twelve such ones show what the shipped
# ball screw needs; of twelve of 1 h it was two.
SHORTER = 6
CHOICE = 9  # training scenarios for the number of substeps
POSITIONS = 20  # between the poses of the grid, where the certificate reads the TCP displacement too
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
    training: int = 90  # scenarios: two thirds long ones at twice the step, one third short ones at a quarter of it
    held_out: int = 19
    hours: float = 2.0  # of every held-out scenario; its steady state comes on top
    step: float = 60.0  # s
    substeps: int | None = None  # of a step, in the certificate and by `twin run`; None: as few as hold the limits
    # Whether environments are unlike each other, as of films that matrices come with: not the zones of one hall.
    air_apart: bool = field(default=False, repr=False)


class Limited(Protocol):
    """What has limits of errors: a machine, or matrices."""

    @property
    def limits(self) -> Limits: ...


def training_scenarios(load: LoadModel, options: BuildOptions, still: bool = False) -> list[Scenario]:
    """Long ones for the slow modes, short ones in short steps for the fast modes that a load step excites.

    still: with all axes at rest in mid-stroke.
    """
    kinds = [(4.0, 2 * options.step)] * 2 + [(1.0, options.step / 4)]
    return [draw(load, TRAINING_SEED + i, *kinds[i % 3], still, options.air_apart) for i in range(options.training)]


def compact_model(
    machine: Limited, rich: MachineModel, options: BuildOptions, progress: Progress = silent
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
    apart = options.air_apart
    return [
        draw(model.load_model, seed + i, options.hours, options.step, air_apart=apart) for i in range(options.held_out)
    ]


def enough_substeps(model: MachineModel, limits: Limits, options: BuildOptions) -> int:
    """As few substeps, of 1, 2 or 4, as keep the error of the time step below half of the limits.

    Judged on training scenarios, drawn at the step that the certificate is for: held-out ones that had a say in the
    choice would not be held out.
    """
    hours = options.hours / SHORTER
    scenarios = held_out(model, replace(options, hours=hours, held_out=CHOICE), TRAINING_SEED)
    ways = [Way(model, FINER), Way(model), Way(model, 2)]
    for substeps, found in zip((1, 2), compare_ways(ways, [(0, 1), (0, 2)], scenarios), strict=True):
        T, u = (e.max(initial=0.0) for e in found.scaled(limits))
        if limits.temperature / 2 >= T and limits.displacement / 2 >= u:
            return substeps
    return 4


def step_halved(model: MachineModel, scenarios: Sequence[Scenario], step: Comparison, substeps: int) -> float:
    """The change of the reference of the time step's error when its steps are halved, as a share of that error.

    In the scenario with the largest error, of a temperature where there are sensors; of temperatures and displacements
    the larger share, each of that scenario.
    """
    by_scenario = [
        e.reshape(len(scenarios), -1).max(axis=1, initial=0.0)
        for e in (step.temperature_error, step.displacement_error)
    ]
    worst = int((by_scenario[0] if by_scenario[0].any() else by_scenario[1]).argmax())
    ways = [Way(model, 2 * FINER), Way(model, FINER)]
    (halved,) = compare_ways(ways, [(0, 1)], [scenarios[worst]], substeps)
    n_poses = halved.displacement_error.shape[1]
    pairs = (
        (halved.temperature_error, step.temperature_error[worst]),
        (halved.displacement_error, step.displacement_error[worst, :n_poses]),
    )
    return max(float(h.max(initial=0.0) / max(e.max(initial=0.0), TINY)) for h, e in pairs)


def in_finer_steps(step: Comparison, halved: float) -> Comparison:
    """The error against steps that do not count: what halving the reference changes is at least half of what is left of
    it in a method of first order or above, as the steps of light nodes come near it."""
    return step.times(1.0 + 2.0 * halved)


def positions_off_grid(model: MachineModel, seed: int, count: int = POSITIONS) -> np.ndarray:
    """Random positions (count, n_axes) [m] between the poses of the grid; none without axes or TCP.

    Of machines whose rotary axes turn with random angles [rad] behind them, (count, n_axes + n_turning).
    """
    low = np.array([nodes[0] for nodes in model.pose_grid])
    high = np.array([nodes[-1] for nodes in model.pose_grid])
    rng = np.random.default_rng([seed, 20261])
    if not model.moves:
        count = 0
    positions = rng.uniform(low, high, (count if len(low) or model.turning else 0, len(low)))
    signals = {s.name: s for s in model.load_model.signals}
    reach = [signals[axis.position] for axis in model.load_model.rotary]
    angles = rng.uniform([s.low for s in reach], [s.high for s in reach], (len(positions), len(reach)))
    return np.hstack([positions, angles])


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
    machine: Limited,
    rich: MachineModel,
    compact: MachineModel,
    full: MachineModel | None,
    options: BuildOptions,
    seed: int,
    full_scenarios: int = 2,
    progress: Progress = silent,
) -> Certificate:
    """Compact against rich on all held-out scenarios, in steps against finer ones on as many shorter ones, and, where
    `full` is given, rich against full on some.
    """
    scenarios, positions = held_out(rich, options, seed), positions_off_grid(rich, seed)
    substeps = options.substeps or enough_substeps(compact, machine.limits, options)
    with progress("compact against rich", len(scenarios)) as advance:
        (reduction,) = compare_ways([Way(rich), Way(compact)], [(0, 1)], scenarios, substeps, positions, advance)
    shorter = replace(options, hours=options.hours / SHORTER)
    stepped = held_out(compact, shorter, seed)
    with progress("compact against finer steps", len(stepped)) as advance:
        ways = [Way(compact, FINER), Way(compact)]
        (step,) = compare_ways(ways, [(0, 1)], stepped, substeps, positions, advance)
    halved = step_halved(compact, stepped, step, substeps)
    parts = [
        Part(REDUCTION, "compact against rich", reduction),
        Part(
            STEP,
            f"steps of {options.step / substeps:g} s against fine ones in {60.0 * shorter.hours:.0f} min",
            in_finer_steps(step, halved),
        ),
    ]
    if full is not None:
        chosen = chosen_for_full(rich.load_model, scenarios, full_scenarios)
        with progress("rich against full", len(chosen)) as advance:
            at_once = 0.0 if full.n > LARGE else LONG
            ways = [Way(full), Way(rich)]
            (large,) = compare_ways(ways, [(0, 1)], chosen, substeps, positions, advance, at_once)
            parts.append(Part(RICH, "rich against full", large))
    return certify(rich, parts, machine.limits, options.hours, options.step, substeps, halved, positions)

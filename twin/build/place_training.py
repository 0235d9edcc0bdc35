"""Trajectories of the rich model with places, on the user's own runs, that a window model is made from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from twin.build.acting import Acting, with_acting
from twin.build.compress import TRAINING_FOLLOW, TRAINING_KEEP
from twin.build.places import Place, pruned
from twin.build.stepper import CoupledStepper
from twin.build.workers import each
from twin.progress import Progress, silent
from twin.rom.apply import with_values
from twin.rom.drive import Drive
from twin.rom.model import MachineModel
from twin.rom.parameter import Parameter
from twin.rom.rescale import rescaled
from twin.rom.tableau import IMPLICIT_EULER

SPREAD = 1.2  # prior standard deviations
DRAWS = 12
ACTIVE = 10  # places with a film in one draw
WARM = 3.0  # K: what a drawn heat would warm its surface by if only a film of 20 W/(m^2 K) took it away
EVERY = 3  # steps between snapshots
ALONE = 10.0  # W at one place, and when: shares of a run
ON = ((0.08, 0.58, 1.0), (0.75, 1.0, 0.5))  # from, to, share of that
LOST, TURN = 0.03, 6  # of a conductance that is left where it is lost; draws after which every contact has been lost


@dataclass(frozen=True)
class Shared:
    """What all draws have in common."""

    rich: MachineModel  # with places
    base: MachineModel  # pruned of all places
    parameters: tuple[Parameter, ...]
    places: tuple[Place, ...]
    drives: tuple[Drive, ...]  # per run, of the description
    starts: tuple[float, ...]  # degC
    every: int = EVERY
    fields: tuple[np.ndarray, ...] = ()  # (N,) K beside where each run starts; none: uniform


@dataclass(frozen=True)
class Draw:
    run: int
    seed: int  # of parameters and places; 0: nominal, nothing acts


def values_of(parameters: Sequence[Parameter], seed: int, spread: float = SPREAD) -> dict[str, float]:
    """Parameters drawn from their priors, within bounds; nominal ones for seed 0.

    In turn some contacts are lost, far beyond their priors: a joint that conducts well has no jump of temperature, and
    in a window that has never seen one a lost joint conducts on.
    """
    if seed == 0:
        return {}
    x = np.clip(spread * np.random.default_rng([seed, 1]).standard_normal(len(parameters)), -2.5, 2.5)
    values = {p.path: float(np.clip(p.value(float(c)), p.low, p.high)) for p, c in zip(parameters, x, strict=True)}
    contacts = [p for p in parameters if p.kind in ("joint", "contact")]
    return values | {p.path: LOST * p.nominal for p in contacts[seed % TURN :: TURN]}


def drawn(places: Sequence[Place], drive: Drive, air: Sequence[float], seed: int) -> Acting:
    """Heat in blocks at every place, a film in blocks at some; air (n,) degC: mean of the environments."""
    if seed == 0:
        return Acting()
    rng = np.random.default_rng([seed, 2])
    n, dt = drive.n_steps, drive.time[1] - drive.time[0]

    def blocks() -> np.ndarray:
        edges = np.cumsum(rng.uniform(1200.0, 10800.0, 1 + int(n * dt / 1200.0)))
        block = np.searchsorted(edges, dt * np.arange(n))
        return (rng.standard_normal(block[-1] + 1) * (rng.random(block[-1] + 1) < 0.6))[block]

    power = {p.name: WARM * 20.0 * min(p.area, 0.05) * blocks() for p in places}
    some = rng.choice(len(places), min(ACTIVE, len(places)), replace=False)
    film = {places[k].name: 10.0 * np.abs(blocks()) for k in some}
    medium = {name: np.asarray(air) + rng.choice([0.0, -4.0, 4.0]) for name in film}
    return Acting(power, film, medium)


def trajectory(shared: Shared, draw: Draw) -> np.ndarray:
    """States (N, m) of one run at one draw."""
    values = values_of(shared.parameters, draw.seed)
    drive = shared.drives[draw.run]
    acting = drawn(shared.places, drive, drive.environment.mean(axis=1), draw.seed)
    warmer = np.random.default_rng([draw.seed, 3, draw.run]).standard_normal(len(shared.rich.bodies))
    beside = np.concatenate([(draw.seed > 0) * by * b.one for by, b in zip(warmer, shared.rich.bodies, strict=True)])
    beside = beside + shared.fields[draw.run] if shared.fields else beside
    return stepped(shared, drive, shared.starts[draw.run], values, acting, beside)


def alone(shared: Shared) -> list[np.ndarray]:
    """Per place (N, m): what heat at it alone changes in the first run of the described machine."""
    drive, model = shared.drives[0], pruned(shared.rich, [p.name for p in shared.places])
    power = heat_alone(drive)
    columns = [np.zeros((body.n, len(model.load_model.sources))) for body in model.bodies]
    for own, body in zip(columns, model.bodies, strict=True):
        own[:, list(body.sources)] = body.B
    B = np.vstack(columns)[:, -len(shared.places) :]
    stepper = CoupledStepper(model, TRAINING_KEEP, TRAINING_FOLLOW, IMPLICIT_EULER)
    first = stepper.uniform(shared.starts[0])
    told = with_acting(drive, model.load_model, Acting())
    every = shared.every
    kept = [X for k, X in stepper.responses(told, first, lambda k: power[k] * B) if k % every == every - 1]
    return list(np.stack(kept, axis=-1).swapaxes(0, 1))


def heat_alone(drive: Drive) -> np.ndarray:
    """(n,) W at one place."""
    power = np.zeros(drive.n_steps)
    for start, end, share in ON:
        power[round(start * len(power)) : round(end * len(power))] = ALONE * share
    return power


def stepped(
    shared: Shared, drive: Drive, start: float, values: Mapping[str, float], acting: Acting, beside: np.ndarray
) -> np.ndarray:
    """States (N, m) from a temperature and a field beside it (N,) [K].

    By implicit Euler: directions of a basis need not the accuracy of the runtime's step, at a sixth of its solves.
    """
    model = pruned(shared.rich, list(acting.power), list(acting.film))
    there = with_values(model, shared.parameters, values)
    base = with_values(shared.base, shared.parameters, values)
    own = rescaled(drive, shared.base.load_model, base.load_model)
    stepper = CoupledStepper(there, TRAINING_KEEP, TRAINING_FOLLOW, IMPLICIT_EULER)
    parts = np.split(beside, np.cumsum([b.n for b in there.bodies])[:-1])
    first = [x + own for x, own in zip(stepper.uniform(start), parts, strict=True)]
    states = [np.concatenate(first)]
    for k, x, _ in stepper.run(with_acting(own, there.load_model, acting), first):
        if k % shared.every == shared.every - 1:
            states.append(np.concatenate(x))
    return np.column_stack(states)


def snapshots(shared: Shared, draws: int = DRAWS, progress: Progress = silent) -> tuple[list[np.ndarray], ...]:
    """(N, m) of every run at the nominal values; at `draws` draws; and what heat does at every place alone.

    Draws heat all places at once, each by its area. The heat of a bearing at a small one is many times as much: a
    window that knew places from draws alone would have the TCP off by a tenth of what that does, and more.
    """
    runs = range(len(shared.drives))
    items = [Draw(run, seed) for seed in range(draws + 1) for run in runs]
    with progress("trajectories with places", len(items) + 1) as advance:
        made = each(trajectory, shared, items, lambda d: advance(f"run {d.run + 1}, draw {d.seed}"))
        heated = alone(shared)
        advance("heat at every place")
    return made[: len(runs)], made[len(runs) :], heated


def nominal(shared: Shared) -> list[np.ndarray]:
    """(N, m) of every run at the nominal values, at every step."""
    items = [Draw(run, 0) for run in range(len(shared.drives))]
    return each(trajectory, replace(shared, every=1), items)

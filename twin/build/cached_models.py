"""The models of a build that take long and depend on the description alone: kept in the cache."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from twin.build.cache import cached, machine_hash
from twin.build.full_model import FullModel, assemble
from twin.build.project import project
from twin.build.rich_basis import RichOptions, basis_of, sample_responses
from twin.build.rich_check import SHARE, check_points, rich_error
from twin.build.scenario import theta_bounds
from twin.build.stored_model import restored, stored
from twin.machine.description import Limits, Machine
from twin.progress import Progress, silent
from twin.rom.model import AffineBody, MachineModel

# States of a body that cost nothing: a step of so few spends its time in calls, not in arithmetic. With fewer, the
# tolerance is halved whatever its error is.
FREE = 30
FINEST = 1e-5  # tolerance: finer directions are those of rounding in the responses


def full_model(machine: Machine, progress: Progress = silent) -> FullModel:
    """The assembled full model, cached."""
    return restored(
        cached("full", stored.__module__, (machine_hash(machine),), lambda: stored(assemble(machine, progress)))
    )


def rich_model(
    machine: Machine, full: FullModel | None, options: RichOptions, progress: Progress = silent
) -> MachineModel:
    """The full model projected on the rich bases of its bodies, cached."""

    def make() -> MachineModel:
        if machine.lumped:  # small already: the rich model is the full one, in coordinates with E = 1
            model = (full or full_model(machine, progress)).thermal
            own = (project(body, np.diag(body.E.diagonal() ** -0.5)) for body in model.bodies)
            return replace(model, bodies=tuple(own))
        assembled = full or full_model(machine, progress)
        return on_rich_bases(assembled.thermal, options, machine.limits, progress)

    return cached("rich", __name__, (machine_hash(machine), options), make)


def on_rich_bases(
    model: MachineModel,
    options: RichOptions,
    limits: Limits,
    progress: Progress = silent,
) -> MachineModel:
    """A sparse model projected on the rich bases of its bodies, fine enough for the limits; not cached."""
    low, high = theta_bounds(model.load_model)
    bodies = []
    with progress("rich basis", options.samples * len(model.bodies)) as advance:
        for body in model.bodies:
            responses = sample_responses(body, low, high, options, advance)
            tolerance = options.tolerance
            V = basis_of(body, responses, tolerance)
            rich = _projected(body, V)
            points = check_points(body, low, high)
            while tolerance > FINEST and (rich.n < FREE or not rich_error(body, rich, points, limits) <= SHARE):
                tolerance /= 2.0
                V = basis_of(body, responses, tolerance)
                rich = _projected(body, V)
            bodies.append(replace(rich, V=V))
    return replace(model, bodies=tuple(bodies))


def _projected(body: AffineBody, V: np.ndarray) -> AffineBody:
    return replace(project(body, V), E=np.eye(V.shape[1]))  # it is, but for the last digits

"""An artefact that does not follow its own full model on the loads of a run: a note says so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.calibrate import lumped_case
from tests.diagnose import small_case
from twin.build.project import orthonormalise, project
from twin.diagnose.faults.coarse_model import Coarse, too_coarse
from twin.rom.model import MachineModel

pytestmark = pytest.mark.long

NOISE = small_case.NOISE, small_case.TCP_NOISE


def with_states(model: MachineModel, n: int) -> MachineModel:
    """The model with n states a body, of random directions and the uniform one."""
    rng = np.random.default_rng(0)
    bodies = tuple(
        project(b, orthonormalise(np.column_stack([b.one, rng.standard_normal((b.n, min(n, b.n) - 1))]), b.E))
        for b in model.bodies
    )
    return replace(model, bodies=bodies)


def test_an_artefact_of_too_few_states_is_told():
    found = too_coarse(with_states(lumped_case.artefact().model, 2), small_case.study(), *NOISE)
    assert found is not None
    assert found.times > 1.0
    assert "--states" in found.note
    assert f"{found.times:.1f} times" in found.note
    # all its states in other coordinates: what is left are steps in time, at bearings of some seconds
    study = small_case.study()
    looked_at = replace(study, probed=replace(study.probed, reduction=(1e-9, 1e-15)))
    whole = too_coarse(with_states(lumped_case.artefact().model, 1000), looked_at, *NOISE)
    assert found.times > 10.0 * (0.0 if whole is None else whole.times)


def test_an_artefact_may_differ_by_the_noise_of_a_reading():
    model, study = with_states(lumped_case.artefact().model, 2), small_case.study()
    found = too_coarse(model, study, *NOISE)
    assert found is not None

    def at(share: float) -> Coarse | None:
        """With noise of which the model differs by this share."""
        return too_coarse(model, study, *(sigma * found.times / share for sigma in NOISE))

    twice = at(2.0)
    assert twice is not None
    assert twice.times == pytest.approx(2.0)
    assert at(0.5) is None


def test_one_of_all_states_is_not():
    assert too_coarse(lumped_case.artefact().model, small_case.study(), *NOISE) is None

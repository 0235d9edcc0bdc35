"""The rich projection against pyMOR's on the same matrices (optional extra `compare`)."""

from __future__ import annotations

import numpy as np
import pytest

from tests.system.conftest import SLIDE
from twin.build.body_matrix import system_matrix
from twin.build.pipeline import full_model
from twin.build.project import project
from twin.build.rich_basis import RichOptions, rich_basis
from twin.build.scenario import theta_bounds
from twin.machine.load import load_machine

pytest.importorskip("pymor")
SHIFTS = (1e-6j, 1e-5j, 1e-4j, 1e-3j, 1e-2j)  # rad/s


def test_same_transfer_function_as_pymor():
    from pymor.core.logger import set_log_levels
    from pymor.models.iosys import LTIModel
    from pymor.reductors.basic import LTIPGReductor

    set_log_levels({"pymor": "ERROR"})
    model = full_model(load_machine(SLIDE)).thermal
    low, high = theta_bounds(model.load_model)
    theta = np.sqrt(low * high)
    for body in model.bodies:
        V = rich_basis(body, low, high, RichOptions(samples=4))
        inputs = np.column_stack([body.B, body.M, body.P])
        lti = LTIModel.from_matrices(-system_matrix(body, theta, 0.0).tocsc(), inputs, body.C, E=body.E.tocsc())
        basis = lti.A.source.from_numpy(V)
        theirs = LTIPGReductor(lti, basis, basis).reduce().transfer_function
        small = project(body, V)
        A, B = -system_matrix(small, theta, 0.0), np.column_stack([small.B, small.M, small.P])
        assert small.n > 20
        for s in SHIFTS:
            H = small.C @ np.linalg.solve(s * small.E - A, B)
            assert np.abs(H - theirs.eval_tf(s)).max() < 1e-8 * np.abs(H).max()

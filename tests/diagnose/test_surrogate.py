"""Outputs far from the description, as the surrogate has them: where a film or a joint is one of several ways out."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.diagnose.model.surrogate import CONDUCTS, Surrogate, make_surrogate
from twin.rom.parameter import OF_LAWS

FAR = 2.5  # prior standard deviations
UNITS = 0.05, 1e-6  # K, m: noise


@cache
def made() -> Surrogate:
    return make_surrogate(small_case.study())


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_one_number_far_off_is_predicted(side):
    study, surrogate = small_case.study(), made()
    unit = study.joined(lambda _: UNITS)
    for j in range(len(study.scale)):
        x = side * FAR * np.eye(len(study.scale))[j]
        exact = study.all_outputs(x)
        change, wrong = (np.linalg.norm(v / unit) for v in (exact - surrogate.y0, surrogate.at(x)[0] - exact))
        p = study.probed.parameters[j]
        assert wrong < max((0.2 if p.kind in OF_LAWS else 0.1) * change, 1.0), p.path


def test_a_share_is_that_of_the_conductance():
    study, surrogate = small_case.study(), made()
    for p, share in zip(study.probed.parameters, surrogate.share, strict=True):
        assert 0.0 <= share <= 1.0
        assert p.kind in CONDUCTS or share == 0.0


def test_its_rate_is_the_derivative_of_its_coordinates():
    surrogate = made()
    x = np.random.default_rng(2).standard_normal(len(surrogate.scale))
    by = 1e-6
    there = (surrogate.t(x + by) - surrogate.t(x - by)) / (2 * by)
    np.testing.assert_allclose(surrogate.rate(x), there, rtol=1e-6)

"""A model without finite derivatives is refused: every statistic of NaN would be zero, and the verdict nothing."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.diagnose.model.surrogate import make_surrogate
from twin.errors import ModelError


def test_derivatives_that_are_not_finite_are_refused_by_the_name_of_the_parameter(monkeypatch):
    study = small_case.study()
    J = np.ones((sum(study.runs[k].size for k in study.fitted), len(study.probed.parameters)))
    J[5, 2] = np.nan
    monkeypatch.setattr(sys.modules[make_surrogate.__module__], "jacobian_of", lambda *_: J)
    with pytest.raises(ModelError, match=f"derivative by {study.probed.parameters[2].path}"):
        make_surrogate(study)

"""Ridge: exact where data are, cautious where they are not, and its strength chosen by groups."""

import numpy as np
import pytest

from twin.calibrate.score.regression import fit_ridge
from twin.errors import ModelError


def test_a_linear_law_is_found():
    rng = np.random.default_rng(1)
    x = rng.standard_normal((200, 3)) * [1.0, 10.0, 0.1] + 20.0
    y = x @ np.array([[1.0, 2.0], [-0.5, 0.0], [7.0, 3.0]]) + [4.0, -1.0]
    found = fit_ridge(x, y)
    unrelated = [fit_ridge(x, rng.standard_normal(200)).strength for _ in range(5)]
    assert found.strength < 0.01 * np.median(unrelated)
    np.testing.assert_allclose(found(x), y, atol=1e-3)
    assert fit_ridge(np.column_stack([x, np.ones(200)]), y).weights[3] == pytest.approx(0.0)  # a constant


def test_strength_is_chosen_by_left_out_groups():
    """Inputs that tell the tests apart and nothing else: only leaving whole tests out shows that they are useless."""
    rng = np.random.default_rng(2)
    groups = np.repeat(np.arange(6), 20)
    x = rng.standard_normal((6, 10))[groups] + 0.01 * rng.standard_normal((120, 10))
    y = rng.standard_normal(6)[groups] + 0.01 * rng.standard_normal(120)
    by_test, by_row = fit_ridge(x, y, groups), fit_ridge(x, y, np.arange(120) % 6)
    assert by_test.strength > 100.0 * by_row.strength


def test_more_inputs_than_rows():
    rng = np.random.default_rng(3)
    x = rng.standard_normal((12, 40))
    found = fit_ridge(x, x[:, 0])
    assert np.isfinite(found.weights).all()
    with pytest.raises(ModelError, match="train"):
        fit_ridge(x[:1], x[:1, 0])

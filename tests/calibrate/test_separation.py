"""What data can and cannot distinguish."""

import numpy as np

from twin.calibrate.fit.separation import sentences, separation


def information(*rows):
    J = np.array(rows, dtype=float)
    return J.T @ J


def test_a_sum_alone_is_seen():
    found = separation(("a", "b", "c"), information([30, 30, 0], [0, 0, 20]))
    assert [set(c.names) for c in found.combinations] == [{"a", "b"}]
    (one,) = found.combinations
    assert np.sign(one.direction[0]) != np.sign(one.direction[1])  # the difference is left to the prior
    assert one.information < 1e-9
    assert found.unseen == ()
    np.testing.assert_allclose(found.learned[:2], 0.5, atol=0.01)  # half of each prior variance is their sum's
    assert found.learned[2] > 0.99
    assert any("a" in line and "b" in line for line in sentences(found))


def test_what_no_datum_touches_is_unseen_and_no_combination():
    found = separation(("a", "b"), information([50, 0]))
    assert found.unseen == ("b",)
    assert found.combinations == ()
    assert "b" in sentences(found)[0]


def test_well_separated_parameters_need_no_words():
    assert sentences(separation(("a", "b"), information([50, 10], [10, 50]))) == []

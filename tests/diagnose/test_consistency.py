"""A property of the machine has one size in all runs; what has another in each is an imitation."""

from __future__ import annotations

import numpy as np
import pytest

from twin.diagnose.evidence.consistency import Size, differs, sizes

ROWS = [slice(0, 150), slice(150, 260), slice(260, 400)]


def case(seed: int, of_runs: np.ndarray) -> tuple[Size, ...]:
    """Sizes by run of the first of two causes, which has another size (3,) in each run."""
    rng = np.random.default_rng(seed)
    N, D = rng.standard_normal((400, 12)), rng.standard_normal((400, 2))
    truth = np.concatenate([np.full(own.stop - own.start, a) for own, a in zip(ROWS, of_runs, strict=True)])
    white = truth * D[:, 0] + 3.0 * D[:, 1] + N @ rng.standard_normal(12) + rng.standard_normal(400)
    return sizes(N, D, white, ROWS, [0, 1])[0]


def test_sizes_of_runs_are_those_of_a_fit_to_each():
    rng = np.random.default_rng(0)
    N, D, white = rng.standard_normal((400, 5)), rng.standard_normal((400, 2)), rng.standard_normal(400)
    found = sizes(N, D, white, ROWS, [0, 1])
    for k, own in enumerate(ROWS):
        inverse = np.linalg.inv(np.eye(own.stop - own.start) + N[own] @ N[own].T)
        F = D[own].T @ inverse @ D[own]
        assert [c[k].amplitude for c in found] == pytest.approx(np.linalg.solve(F, D[own].T @ inverse @ white[own]))
        assert [c[k].sigma for c in found] == pytest.approx(np.sqrt(np.diag(np.linalg.inv(F))))


def test_equal_sizes_pass_as_often_as_said_and_others_do_not():
    alike = [differs(case(seed, np.full(3, 2.0)), own=0.0) for seed in range(400)]
    assert sum(alike) <= 4  # 0.4 expected
    assert all(differs(case(seed, np.array([2.0, 2.0, 4.0])), own=0.05) for seed in range(20))


def test_the_form_of_the_model_may_bend_a_size():
    found = (Size(10.0, 0.1), Size(11.0, 0.1))
    assert differs(found, own=0.0)
    assert not differs(found, own=0.1)


def test_what_is_no_evidence_in_a_poor_model_makes_no_size_differ():
    found = (Size(10.0, 0.1), Size(11.0, 0.1))  # Q = 50
    assert differs(found, own=0.0, least=49.0)
    assert not differs(found, own=0.0, least=51.0)


def test_a_run_in_which_a_cause_does_not_act_tells_nothing():
    rng = np.random.default_rng(1)
    N, D, white = rng.standard_normal((400, 5)), rng.standard_normal((400, 1)), rng.standard_normal(400)
    D[ROWS[1]] = 0.0
    ((first, second, third),) = sizes(N, D, white, ROWS, [0])
    assert np.isfinite([first.sigma, third.sigma]).all()
    assert second.sigma == np.inf
    assert not differs((first, second), own=0.0)
    assert not differs((Size(5.0, 0.1), Size(-300.0, 60.0)), own=0.0)  # told a thousand times worse

"""Interpolation errors of pose grids on functions whose error is known in closed form."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from tests.system.conftest import SLIDE
from twin.build.pipeline import full_model
from twin.build.pose_study import GridError, PoseStudy, fields_of_run, study_grids
from twin.errors import LogError
from twin.logs.read import read_run
from twin.machine.load import load_machine

STROKES = ((-0.4, 0.4), (0.0, 1.0))


def quadratic(p):
    """Case 0: 10 um x^2 along x, in metres of stroke; case 1: linear in both axes."""
    zero = np.zeros(len(p))
    square = np.column_stack([1e-5 * p[:, 0] ** 2, zero, zero])
    return np.stack([square, np.column_stack([zero, p @ [1e-6, 2e-6], zero])])


def test_linear_interpolation_of_a_parabola():
    """Error h^2/8 f'' = h^2/4 * 10 um/m^2 in the middle of an interval h: random poses come close and never above."""
    study = study_grids(("x", "y"), STROKES, quadratic, random=2000, most=5)
    for grid in study.grids:
        h = 0.8 / (grid.counts[0] - 1)
        bound = 1e-5 * h**2 / 4
        assert 0.95 * bound < grid.maximum["linear"] <= bound * (1 + 1e-9)
        assert grid.p95["linear"] < grid.maximum["linear"]
        assert grid.maximum["lagrange"] == pytest.approx(bound if grid.counts[0] == 2 else 0.0, abs=0.05 * bound)


def test_the_smallest_grid():
    study = study_grids(("x", "y"), STROKES, quadratic, random=500, most=5)
    tolerance = 1.01 * 1e-5 * 0.4**2 / 4  # three positions along x do, y needs only its two ends
    fewest, equal = study.smallest(tolerance, "linear"), study.smallest(tolerance, "linear", equal=True)
    assert fewest.counts == (3, 2)
    assert fewest.poses == 6
    assert equal.counts == (3, 3)
    assert [g.counts for g in study.equal] == [(2, 2), (3, 3), (4, 4), (5, 5)]
    assert study.smallest(1e-12, "linear") is None
    assert study.smallest(1e-12, "lagrange").counts == (3, 2)
    assert study.case == pytest.approx(np.abs(quadratic(np.array([[0.4, 1.0]]))).max(), rel=0.05)


def test_equal_input_gives_equal_numbers():
    first, again = (study_grids(("x", "y"), STROKES, quadratic, random=50, most=3, seed=4) for _ in range(2))
    assert first == again
    assert study_grids(("x", "y"), STROKES, quadratic, random=50, most=3, seed=5) != first


def test_ties_go_to_the_smaller_error():
    grids = tuple(
        GridError(counts, {"linear": e, "lagrange": e}, {"linear": e, "lagrange": e})
        for counts, e in (((2, 6), 0.9), ((6, 2), 0.5), ((3, 4), 0.7))
    )
    assert PoseStudy(("x", "y"), 1.0, grids).smallest(1.0, "linear").counts == (6, 2)


@pytest.mark.long
def test_fields_of_a_run_converge_with_the_step():
    """Loads are means over a step, of first order once steps resolve what switches: against 576 steps, half the step
    leaves (4 - 1)/(2 - 1) = 3 times less."""
    full, run = full_model(load_machine(SLIDE)), read_run(SLIDE / "runs" / "short")
    field = {}
    for steps in (144, 288, 576):
        times, fields = fields_of_run(full, run, [1799.0], steps)
        assert times == [1800.0]  # rounded up to the end of a step
        assert [x.shape for x in fields[0]] == [(body.n,) for body in full.thermal.bodies]
        field[steps] = np.concatenate(fields[0])
    coarse, fine = (np.linalg.norm(field[n] - field[576]) for n in (144, 288))
    assert coarse < 0.005 * np.linalg.norm(field[576])
    assert 2.0 < coarse / fine < 4.0


@pytest.mark.parametrize("time", [0.0, -60.0, 3600.0])
def test_times_outside_the_log_are_refused(time):
    run = read_run(SLIDE / "runs" / "short")
    with pytest.raises(LogError, match="the log covers"):
        fields_of_run(SimpleNamespace(), run, [time])

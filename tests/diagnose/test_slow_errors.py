"""What is left of a channel, as a slow error of its own."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.evidence.whiten import measured_of
from twin.diagnose.search.dispersion import modes_of, searched, with_errors
from twin.diagnose.search.look import look
from twin.diagnose.search.policy import POLICY

ROWS = 400


def test_noise_has_no_slow_error():
    kept = [modes_of(np.random.default_rng(seed).standard_normal(ROWS)).shape[1] for seed in range(20)]
    assert np.mean(kept) < 1.0


@pytest.mark.parametrize(("size", "rho"), [(2.0, 0.9), (4.0, 0.95)])
def test_a_slow_error_has_the_variance_and_the_memory_of_what_is_left(size, rho):
    found = []
    for seed in range(20):
        rng, slow = np.random.default_rng(seed), np.zeros(ROWS)
        for i in range(1, ROWS):
            slow[i] = rho * slow[i - 1] + np.sqrt(1.0 - rho**2) * rng.standard_normal()
        modes = modes_of(size * slow + rng.standard_normal(ROWS))
        own = modes @ modes.T
        found.append([np.diag(own).mean(), np.diag(own, 10).mean()])
    variance, later = np.mean(found, axis=0)
    assert variance == pytest.approx(size**2, rel=0.25)
    assert later / variance == pytest.approx(rho**10, abs=0.1)


def test_few_rows_say_nothing():
    assert modes_of(np.full(11, 10.0)).shape == (11, 0)
    assert modes_of(np.zeros(0)).shape == (0, 0)


def test_a_slow_error_is_no_evidence_any_more():
    """A slow error of one channel, once it is model discrepancy, is not left in the misfit."""
    detector = small_case.made_detector()
    study = detector.study
    error = np.zeros(len(measured_of(study)))
    (bins, sensors), _ = study.runs[0].shapes
    error[np.arange(bins) * sensors] = 3.0 * np.sin(np.linspace(0.0, 6.0, bins))
    y = detector.fitter.surrogate.y0 + error

    def left(own):
        fitted = own.fitter(y)
        return float(own.whiten(fitted.residual) @ fitted.projector(own.whiten(fitted.residual)))

    wide = with_errors(detector, detector.whiten(error)[:, None])
    assert left(wide) < 0.2 * left(detector)
    assert wide.poor
    assert not detector.poor


@pytest.mark.long
def test_a_score_beyond_no_conductance_at_all_is_held(monkeypatch):
    """A linear score may say that a joint has less than nothing."""
    detector = small_case.made_detector()
    batch = next(b for b in detector.columns.batches if b.family == "joint")
    h = Hypothesis(batch, 0, batch.histories[0], 1e6, (-3.0,) * batch.q)
    seen, ranked, step = look(detector, detector.fitter(detector.fitter.surrogate.y0))
    monkeypatch.setattr(sys.modules[searched.__module__], "look", lambda *_: (seen, [h, *ranked], step))
    y0 = detector.fitter.surrogate.y0
    y = y0 + 30.0 * detector.whiten.colour(np.random.default_rng(3).standard_normal(len(y0)))
    _, own = searched(detector, y)
    assert own.errors is not None
    assert np.isfinite(own.errors).all()


@pytest.mark.long
def test_measurements_beyond_all_reason_are_no_error():
    """A TCP that is metres off, and temperatures of which no model knows: steps of a refit go too far for the model."""
    detector = small_case.made_detector()
    y0 = detector.fitter.surrogate.y0
    found, own = searched(detector, y0 + 5.0 * np.random.default_rng(3).standard_normal(len(y0)))
    assert np.isfinite(found.residual).any()
    assert own.share > POLICY.dispersed

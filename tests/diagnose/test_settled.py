"""The calibration that is delivered: it predicts a run that it has not seen, whatever model discrepancy may explain."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from tests.diagnose import small_case
from twin.diagnose.evidence.settled import settled_alone, settled_nearly
from twin.diagnose.model.study import Study
from twin.diagnose.search.accepted import settled

HIDDEN = np.array([1.0, -0.8])  # prior standard deviations of the first two sources


@cache
def hidden_parameters() -> np.ndarray:
    study = small_case.study()
    x = np.zeros(len(study.probed.parameters))
    x[[i for i, p in enumerate(study.probed.parameters) if p.kind == "source"][:2]] = HIDDEN
    return x


def measured() -> np.ndarray:
    """Outputs of both fitted runs with other sources and white noise."""
    study, detector = small_case.study(), small_case.made_detector()
    y = np.concatenate([study.outputs(k, hidden_parameters()) for k in study.fitted])
    noise = detector.whiten.colour(np.random.default_rng(0).standard_normal(len(y)))
    return np.where(np.isfinite(noise), y + noise, np.nan)


def held_out(x: np.ndarray) -> float:
    """K rms of the third run's sensors against the truth."""
    study = small_case.study()
    T, truth = (study.runs[2].split(study.outputs(2, own))[0] for own in (x, hidden_parameters()))
    return float(np.sqrt(np.mean((T - truth) ** 2)))


def test_parameters_are_found_and_predict():
    x, covariance = settled(small_case.made_detector(), measured(), ())
    truth = hidden_parameters()
    sigma = np.sqrt(np.diag(covariance))
    assert np.all(sigma < 1.2)
    assert np.mean(np.abs(x - truth) < 2.0 * sigma + 0.1) > 0.9
    assert held_out(x) < 0.35 * held_out(np.zeros(len(x)))


def test_near_a_fit_it_is_known_without_a_step_of_the_model(monkeypatch):
    """Synthetic measurements are settled so, for limits that their spread sets."""
    fitter, y = small_case.made_detector().fitter, measured()
    fitted, exactly = fitter(y), settled_alone(fitter, y)[0]
    monkeypatch.setattr(Study, "outputs", None)
    nearly = settled_nearly(fitter, fitted)
    assert np.abs(nearly - exactly).max() < 0.03
    assert np.abs(exactly).max() > 0.3


def test_model_discrepancy_does_not_take_what_parameters_explain():
    """With form that could explain everything, the fit behind the scores leaves parameters where they were."""
    detector, y = small_case.made_detector(), measured()
    study = detector.study
    _, J = detector.fitter.surrogate.at(np.zeros(len(study.probed.parameters)))
    free = np.hstack([detector.fitter.others, 5.0 * detector.whiten(J)])
    greedy = replace(detector, fitter=replace(detector.fitter, others=free))
    scored, delivered = greedy.fitter(y).x, settled(greedy, y, ())[0]
    assert held_out(scored) > 0.6 * held_out(np.zeros(len(scored)))
    assert held_out(delivered) < 0.8 * held_out(scored)

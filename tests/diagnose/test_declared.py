"""Signals declared wrongly, and sources elsewhere, are judged by the model that has them so."""

from __future__ import annotations

import sys
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.calibrate import lumped_case
from tests.diagnose import small_case
from twin.calibrate.fit.measured import measured
from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.evidence.film_laws import with_film_laws
from twin.diagnose.faults.acted import slots_with, units_of
from twin.diagnose.faults.catalogue import FAMILIES
from twin.diagnose.faults.table import fault_of
from twin.diagnose.model.probed_model import make_probed_model
from twin.diagnose.model.study import Study, make_study
from twin.diagnose.search.accepted import Accepted, exchanged, jacobian
from twin.diagnose.search.contest import _closely
from twin.diagnose.search.declared import (
    _fitted_by,
    declared_candidates,
    declared_exactly,
    misplaced_candidates,
    swapped_candidates,
    with_signal,
)
from twin.diagnose.search.exact import misfit
from twin.diagnose.search.forward import _reads, search
from twin.diagnose.search.look import look
from twin.diagnose.search.start import afresh, begun
from twin.diagnose.search.verdict import verdict_of
from twin.machine.load import load_machine
from twin.machine.parameters import parameters

pytestmark = pytest.mark.long


@cache
def logged(signal: str, factor: float) -> Study:
    """The study of runs whose logs have a signal larger by a factor."""
    runs = tuple(
        replace(run, loads=replace(run.loads, columns={
            name: values * (factor if name == signal else 1.0) for name, values in run.loads.columns.items()
        }))
        for run in small_case.runs()
    )  # fmt: skip
    machine = small_case.machine()
    probed = make_probed_model(machine, parameters(machine), runs)
    plans = [measured(probed.base, run, b.drive, b.name) for run, b in zip(runs, probed.runs, strict=True)]
    return with_film_laws(make_study(probed, plans, range(2)), small_case.form())


def outputs(study: Study, x: np.ndarray) -> np.ndarray:
    return np.concatenate([study.outputs(k, x) for k in study.fitted])


def of_another(signal: str) -> np.ndarray:
    """(m,) of a machine whose parameters are not quite the declared ones, and a signal of which was twice as large as
    the log says."""
    study = logged(signal, 2.0)
    rng = np.random.default_rng(4)
    return with_noise(study, outputs(study, 0.5 * rng.standard_normal(len(study.probed.parameters))), rng)


def with_noise(study: Study, flat: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Outputs (m,) of the fitted runs as sensors and probes read them."""
    sigma = []
    for k in study.fitted:
        (b, s), (rows, _) = study.runs[k].shapes
        sigma.append(np.repeat([small_case.NOISE / np.sqrt(5), small_case.TCP_NOISE], [b * s, 3 * rows]))
    return flat + np.concatenate(sigma) * rng.standard_normal(len(flat))


@pytest.mark.parametrize(("signal", "factor"), [("spindle_current", 2.0), ("x_speed", 0.5), ("spindle_speed", 1.0)])
def test_a_corrected_signal_is_what_a_log_of_it_would_have_given(signal, factor):
    study, described = logged(signal, factor), small_case.study()
    x = 0.5 * np.random.default_rng(1).standard_normal(len(study.probed.parameters))
    corrected = outputs(with_signal(described, signal, factor), x)
    np.testing.assert_allclose(corrected, outputs(study, x), rtol=1e-9, atol=1e-15)
    assert np.allclose(corrected, outputs(described, x), rtol=1e-9) == (factor == 1.0)


def test_the_right_factor_explains_most_by_the_exact_model():
    detector, y = small_case.made_detector(), of_another("spindle_speed")
    fitted = detector.fitter(y)
    exact = {h.name: h.statistic for h in declared_exactly(detector, y, fitted)}
    line = {h.name: h.statistic for h in declared_candidates(detector, y, fitted)}
    right = "signals.spindle_speed*2"
    assert max(exact, key=lambda name: exact[name]) == right
    assert line.get(right, 0.0) < 0.8 * exact[right]
    numbers = int(np.isfinite(y).sum())
    assert misfit(detector, fitted) - exact[right] < numbers + 4.0 * np.sqrt(2.0 * numbers)  # noise


def test_an_exact_fit_of_a_factor_ends_where_it_stays():
    detector, study = small_case.made_detector(), logged("spindle_speed", 2.0)
    rng = np.random.default_rng(4)
    y = with_noise(study, outputs(study, rng.standard_normal(len(study.probed.parameters))), rng)
    corrected = with_signal(detector.study, "spindle_speed", 2.0)
    further = replace(detector, policy=replace(detector.policy, exact_passes=12))
    left, then = (_fitted_by(own, y, corrected, np.inf) for own in (detector, further))
    assert left == pytest.approx(then, abs=detector.policy.close)


def test_an_exact_fit_begins_where_a_surrogate_that_leads_away_has_left_least():
    """As of drawn network 515, where that of a motor of a ninth of its heat turned a fit of 866 units into 169,797."""
    detector, y = small_case.made_detector(), of_another("spindle_speed")
    corrected = with_signal(detector.study, "spindle_speed", 2.0)
    right = _fitted_by(detector, y, corrected, np.inf)
    surrogate = detector.fitter.surrogate
    wrong = replace(surrogate, J=-3.0 * surrogate.J, H=-3.0 * surrogate.H)
    lost = replace(detector, fitter=replace(detector.fitter, surrogate=wrong))
    assert _fitted_by(lost, y, corrected, np.inf) == pytest.approx(right, abs=detector.policy.close)


def test_a_factor_counts_by_its_exact_fit_and_not_by_its_score(monkeypatch):
    detector, y = small_case.made_detector(), of_another("spindle_speed")
    factors = declared_exactly(detector, y, detector.fitter(y))
    less = [replace(h, statistic=1.0) for h in factors if h.statistic > 0.0]
    monkeypatch.setattr(sys.modules[begun.__module__], "declared_exactly", lambda *_: less)
    ranked = {h.name: h.statistic for h in begun(detector, y).glance[1]}
    assert less
    assert all(ranked[h.name] == h.statistic for h in less)


def test_it_is_named_without_another_explanation():
    found = search(small_case.made_detector(), of_another("spindle_speed"))
    verdict, (cause,) = verdict_of(found, FAMILIES)
    assert (verdict, cause.family, cause.place, cause.amplitude) == ("signal", "signal", "signals.spindle_speed", 2.0)
    assert cause.rivals == ()


def test_a_loss_that_does_the_same_has_the_signal_for_a_rival():
    """A current that one winding alone reads: no data tell twice the current from four times the resistance."""
    verdict, (cause,) = verdict_of(search(small_case.made_detector(), of_another("spindle_current")), FAMILIES)
    assert (verdict, cause.family, cause.place) == ("ambiguous", "loss_law", "sources.motor")
    assert "signals.spindle_current" in {r.place for r in cause.rivals}


def test_the_source_that_reads_a_corrected_signal_has_no_other_loss_beside_it():
    detector = small_case.made_detector()
    y = of_another("spindle_current")
    h = declared_exactly(detector, y, detector.fitter(y))[0]
    accepted = [Accepted(h, (), np.ones(1), np.eye(1), h.statistic, 36.0, ())]
    batch = next(b for b in detector.columns.batches if b.kind == "gain")
    losses = [Hypothesis(batch, i, batch.histories[0], 50.0, (0.1,)) for i in range(len(batch.places))]
    assert [h.name for h in losses if _reads(detector.study, h, accepted)] == ["sources.motor"]
    assert not any(_reads(detector.study, h, []) for h in losses)


def test_beside_a_corrected_signal_parameters_do_what_they_do_at_its_heat():
    detector = small_case.made_detector()
    study = detector.study
    y = of_another("spindle_current")
    h = declared_exactly(detector, y, detector.fitter(y))[0]
    x = np.zeros(len(study.probed.parameters))
    slots = [slots_with(study, detector.elements, units_of(study, h), k) for k in study.fitted]
    anew = np.vstack([study.jacobian(k, x, s, [1.0])[:, : len(x)] for k, s in zip(study.fitted, slots, strict=True)])

    def beside(x: np.ndarray, size: float = 1.0) -> np.ndarray:
        return jacobian(detector, x, [(h, np.array([size]))], closely=True)

    def known(x: np.ndarray) -> np.ndarray:
        return detector.fitter.surrogate.at(x)[1]

    made, near, far = beside(x), 0.9 * detector.policy.anew, 1.1 * detector.policy.anew
    np.testing.assert_allclose(made, anew, rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(beside(x + near), made + known(x + near) - known(x), rtol=1e-9, atol=1e-15)
    np.testing.assert_array_equal(beside(x, 1.0 + near), made)
    assert len(detector.derivatives) == 1
    assert np.abs(beside(x, 1.0 + far) - made).max() > 0.0
    further = beside(x + far)
    assert np.abs(further - made).max() > 0.01 * np.abs(made).max()
    assert len(detector.derivatives) == 3
    assert not np.allclose(anew, detector.fitter.surrogate.at(x)[1], rtol=0.2)


@cache
def with_the_front_source_at_the_housing() -> np.ndarray:
    """(m,) of a machine whose front bearing heats the housing."""
    text = (lumped_case.FOLDER / "machine.toml").read_text("utf-8")
    elsewhere = text.replace('surface = "bearing_front"', 'surface = "housing"')
    assert elsewhere != text
    machine = load_machine(lumped_case.FOLDER / "machine.toml", elsewhere)
    own = make_probed_model(machine, parameters(machine), small_case.runs())
    other = with_film_laws(replace(small_case.described(), probed=own), small_case.form())
    x = 0.5 * np.random.default_rng(4).standard_normal(len(small_case.study().probed.parameters))
    return with_noise(small_case.study(), outputs(other, x), np.random.default_rng(5))


def test_all_the_heat_of_a_source_at_another_node_is_judged_from_the_description():
    detector, y = small_case.made_detector(), with_the_front_source_at_the_housing()
    fitted = detector.fitter(y)
    best = max(misplaced_candidates(detector, y, fitted), key=lambda h: h.statistic)
    assert best.name == "sources.front>housing"
    assert best.statistic > 0.9 * (misfit(detector, fitted) - np.isfinite(y).sum())
    verdict, (cause,) = verdict_of(search(detector, y), FAMILIES)
    assert (verdict, cause.family, cause.place, cause.settings["surface"]) == (
        "named", "misplaced_source", "sources.front", "housing"
    )  # fmt: skip
    assert cause.ci95[0] < 1.0 < cause.ci95[1]


def test_a_source_elsewhere_leads_missing_heat_by_what_both_leave():
    detector, y = afresh(small_case.made_detector()), with_the_front_source_at_the_housing()
    fitted = detector.fitter(y)
    elsewhere = max(misplaced_candidates(detector, y, fitted), key=lambda h: h.statistic)
    missing = max(
        (h for h in look(detector, fitted)[1] if h.family == "heat_source" and h.name == "housing"),
        key=lambda h: h.statistic,
    )
    missing = replace(missing, statistic=elsewhere.statistic + 10.0)
    found = _closely(detector, y, fitted, [missing, elsewhere], lambda h: h)
    assert [h.family for h in found] == ["misplaced_source", "heat_source"]
    assert found[0].statistic > elsewhere.statistic > found[1].statistic
    assert found[0].amplitude[0] == pytest.approx(1.0, abs=0.1)


def test_a_signal_is_misread_by_what_its_unit_allows():
    detector = small_case.made_detector()
    units = {s.name: s.unit for s in small_case.study().probed.base.load_model.signals}
    (batch,) = (b for b in detector.columns.batches if b.kind == "signal")
    tried: dict[str, set[float]] = {}
    for place in batch.places:
        signal, factor = fault_of(batch).factor(place)
        tried.setdefault(units[signal.removeprefix("signals.")], set()).add(round(factor, 3))
    assert 1.414 in tried["A"]  # a peak for rms
    assert not {60.0, 0.017} & tried["A"]
    assert tried["m/s"] | tried["1/s"] == {0.5, 2.0, 60.0, 0.017}  # a speed has no peak


def test_two_sensors_with_each_others_name_are_judged_by_putting_them_back():
    """Calibration hides most of it in losses; the linear score, beside these, sees a part of the rest."""
    detector, study = small_case.made_detector(), small_case.study()
    x = 0.5 * np.random.default_rng(8).standard_normal(len(study.probed.parameters))
    y = with_noise(study, outputs(study, x), np.random.default_rng(9))
    batch = next(b for b in detector.columns.batches if b.kind == "swapped")
    front = next(i for i, name in enumerate(batch.places) if "front" in name and "housing" in name)
    h = Hypothesis(batch, front, batch.histories[0], 0.0, (1.0,))
    wrong = exchanged(study, y, [Accepted(h, (), np.ones(1), np.eye(1), 0.0, 0.0, ())])
    fitted = detector.fitter(wrong)
    best = max(swapped_candidates(detector, wrong, fitted), key=lambda h: h.statistic)
    assert best.name == h.name
    assert best.statistic == pytest.approx(misfit(detector, fitted) - misfit(detector, detector.fitter(y)), rel=0.1)
    assert not swapped_candidates(detector, y, detector.fitter(y))


@pytest.mark.parametrize(("without", "counts_from"), [(700.0, 1000.0), (250.0, 250.0)])
def test_a_factor_counts_from_a_fit_by_the_same_derivatives_where_that_explains_most(monkeypatch, without, counts_from):
    """Twice a speed and half of it explained the same of a healthy machine: the derivatives did."""
    detector = small_case.made_detector()
    module, plain = sys.modules[declared_exactly.__module__], detector.study
    monkeypatch.setattr(module, "misfit", lambda *_: 1000.0)
    monkeypatch.setattr(module, "_fitted_by", lambda _, y, study, enough: without if study is plain else 100.0)
    y = plain.joined(lambda p: (p.measured.temperature, p.measured.tcp))
    found = declared_exactly(detector, y, detector.fitter(y))
    assert found
    assert {h.statistic for h in found} == {counts_from - 100.0}

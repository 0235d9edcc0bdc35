"""How far calibrations move numbers that lie within their tolerances, and what is beyond that."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from tests.diagnose import small_case
from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.evidence.fitter import Fitted
from twin.diagnose.evidence.pulls import Loose, Pulls, Spread, as_rare, deviate
from twin.diagnose.evidence.whiten import Projector
from twin.diagnose.faults.catalogue import FAMILIES
from twin.diagnose.search.by_calibration import _told, not_named, strained_of
from twin.diagnose.search.forward import search
from twin.diagnose.search.look import Search
from twin.diagnose.search.loose import beside_free
from twin.diagnose.search.verdict import verdict_of
from twin.machine.parameters import parameters


def test_a_number_is_out_where_few_synthetic_measurements_move_one_so_far():
    known = parameters(small_case.machine())
    rng = np.random.default_rng(1)
    spread = rng.uniform(0.3, 2.0, len(known))
    drawn = rng.uniform(-1.0, 1.0, (2000, len(known)))
    fitted, settled = (spread * rng.standard_normal((2000, len(known))) for _ in range(2))
    pulls = Pulls.of(known, drawn, fitted, settled)
    passing = np.mean([(pulls.fitted.strain(x) >= 1.0).any() for x in spread * rng.standard_normal((2000, len(known)))])
    assert 0.01 < passing < 0.06
    named = next(i for i, p in enumerate(known) if p.kind == "source")
    air = next(i for i, p in enumerate(known) if p.kind == "environment")
    far = np.zeros(len(known))
    far[[named, air]] = 20.0
    strain = pulls.strain(far, far)
    assert strain[named] > 1.0
    assert strain[air] > 1.0
    assert pulls.strain(far, 0.0 * far)[named] > 1.0  # by either calibration
    assert pulls.strain(0.0 * far, far)[named] > 1.0


def test_an_offset_of_air_is_told_in_kelvins_whatever_was_declared():
    detector = small_case.made_detector()
    known = list(detector.study.probed.parameters)
    j = next(i for i, p in enumerate(known) if p.kind == "environment")
    known[j] = replace(known[j], nominal=0.8, sigma=0.05)
    study = replace(detector.study, probed=replace(detector.study.probed, parameters=tuple(known)))
    size, (low, high), unit = _told(replace(detector, study=study), Loose(j, -4.0, 0.5, 2.0))
    assert unit == "K"
    assert (low, size, high) == pytest.approx((0.551, 0.6, 0.649))


def test_the_limit_of_losses_does_not_follow_the_discrepancy_of_films():
    """Losses of a healthy machine lie within their tolerance; films pass theirs in one of ten measurements."""
    known = parameters(small_case.machine())
    kinds = np.array([p.kind for p in known])
    rng = np.random.default_rng(2)
    drawn = rng.uniform(-1.0, 1.0, (400, len(known)))
    x, far = drawn + 0.1 * rng.standard_normal(drawn.shape), kinds == "film"
    x[:, far] *= np.where(rng.random((400, far.sum())) < 0.1, 3.0, 1.0)
    spread = Spread.of(known, drawn, x)
    assert spread.limit[kinds == "source"].max() < 1.3
    assert spread.limit[far].min() > 2.0


def test_what_data_tell_is_out_as_soon_as_it_leaves_its_tolerance():
    """By more than a calibration errs; of what data do not tell, its prior says nothing."""
    known = tuple(p for p in parameters(small_case.machine()) if p.kind == "source")
    rng = np.random.default_rng(3)
    drawn = rng.uniform(-1.0, 1.0, (400, len(known)))
    b, s = np.resize([1.0, 0.9, 0.0], len(known)), np.resize([0.05, 0.2, 0.4], len(known))
    x = b * drawn + s * rng.standard_normal(drawn.shape)
    limit = Spread.of(known, drawn, x).limit
    assert np.all(limit[b == 1.0] < 1.15)
    assert np.all(limit[b == 1.0] > 1.0)
    assert np.all(limit[b == 0.0] > 2.5 * 0.4)
    new = rng.uniform(-1.0, 1.0, (4000, len(known)))
    passing = (np.abs(b * new + s * rng.standard_normal(new.shape)) > limit).any(axis=1).mean()
    assert 0.005 < passing < 0.08


@pytest.mark.parametrize(("b", "s"), [(1.0, 0.1), (0.5, 0.5), (0.0, 2.0)])
def test_deviates_are_normal_where_numbers_lie_anywhere_within_their_tolerances(b, s):
    rng = np.random.default_rng(4)
    x = np.abs(b * rng.uniform(-1.0, 1.0, 200_000) + s * rng.standard_normal(200_000))
    found = deviate(x, np.array(b), np.array(s))
    for most in (1.0, 2.0, 3.0):
        assert (found > most).mean() == pytest.approx(2.0 * norm.sf(most), rel=0.1)
        (back,) = as_rare(most, np.array([b]), np.array([s]))
        assert deviate(np.array([back]), np.array([b]), np.array([s]))[0] == pytest.approx(most, abs=1e-4)


@pytest.mark.long
@pytest.mark.parametrize(("component", "factor"), [("x", 1.7), ("x", 0.3), ("y", 2e-6)])
def test_an_expansion_of_a_node_out_of_its_tolerance_is_told_with_its_size(component, factor):
    """Of a node's row every number is calibrated by itself; one that is declared as nought has no factor."""
    detector = small_case.made_detector()
    study, path = detector.study, f"tcp.expansion.shaft.{component}"
    j, p = next((i, p) for i, p in enumerate(study.probed.parameters) if p.path == path)
    x = np.zeros(len(study.scale))
    x[j] = p.coordinate(factor * (p.nominal or 1.0))
    y = study.all_outputs(x)
    y = y + detector.whiten.colour(np.random.default_rng(5).standard_normal(len(y)))
    verdict, (cause, *_) = verdict_of(search(detector, y), FAMILIES)
    assert verdict == "out_of_tolerance"
    assert (cause.family, cause.place, cause.parameter) == ("expansion", "tcp.expansion.shaft", path)
    assert cause.unit == ("1" if p.nominal else "m/K")
    assert cause.ci95[0] < factor < cause.ci95[1]
    assert cause.amplitude == pytest.approx(factor, rel=0.25)


@pytest.mark.long
def test_a_capacity_out_of_its_tolerance_is_one_of_its_node():
    detector = small_case.made_detector()
    paths = [p.path for p in detector.study.probed.parameters]
    own = Loose(paths.index("nodes.bearing_front.capacity"), 3.0, 0.5, 1.5)
    (cause,) = strained_of(replace(nothing(), loose=(own,)))
    assert (cause.family, cause.place, cause.unit) == ("capacity", "bearing_front", "1")
    assert cause.amplitude == pytest.approx(1.2**3)


@pytest.mark.long
def test_what_may_be_nought_within_its_tolerance_is_told_as_it_is():
    """Minus nine times a tenth of a micrometre per kelvin says less than minus 0.9 um/K."""
    found = nothing()
    study = found.detector.study
    j, p = next((i, p) for i, p in enumerate(study.probed.parameters) if p.path == "tcp.expansion.housing.x")
    known = list(study.probed.parameters)
    known[j] = replace(p, nominal=-1e-7)
    study = replace(study, probed=replace(study.probed, parameters=tuple(known)))
    found = replace(found, detector=replace(found.detector, study=study), loose=(Loose(j, 3.0, 0.5, 1.5),))
    (cause,) = strained_of(found)
    assert cause.unit == p.unit == "m/K"
    assert cause.amplitude == pytest.approx(-1e-7 + 3.0 * p.sigma)


@pytest.mark.long
def test_an_expansion_near_its_bound_has_the_interval_of_its_fit():
    """No family says how far an expansion of a node may be; one metre per kelvin is none."""
    detector = small_case.made_detector()
    j, p = next((i, p) for i, p in enumerate(detector.study.probed.parameters) if p.path == "tcp.expansion.shaft.y")
    (cause,) = strained_of(replace(nothing(), loose=(Loose(j, 9.5, 0.5, 5.0),)))
    assert cause.ci95 == pytest.approx([p.value(9.5 - 1.96 * 0.5), p.value(9.5 + 1.96 * 0.5)])


def nothing() -> Search:
    """The search of measurements without a cause."""
    detector = small_case.made_detector()
    y = detector.study.all_outputs(np.zeros(len(detector.study.scale)))
    return search(detector, y + detector.whiten.colour(np.random.default_rng(6).standard_normal(len(y))))


@pytest.mark.long
@pytest.mark.parametrize(("told", "verdict"), [(20.0, "out_of_tolerance"), (33.0, "ambiguous")])
def test_a_number_that_follows_the_farthest_is_its_doing_or_its_rival(told, verdict):
    detector = small_case.made_detector()
    paths = [p.path for p in detector.study.probed.parameters]
    first, other, apart = (
        paths.index(path) for path in ("tcp.expansion.shaft.x", "tcp.expansion.housing.x", "sources.front.gain")
    )
    loose = (
        Loose(first, 4.0, 0.3, 2.0, told=35.0),
        Loose(other, 3.0, 0.5, 1.4, told=told, follows=True),
        Loose(apart, 3.0, 0.5, 1.3, told=told),
    )
    said, causes = verdict_of(replace(nothing(), loose=loose), FAMILIES)
    assert said == verdict
    assert [c.parameter for c in causes] == [paths[first], paths[apart]]
    assert [r.place for r in causes[0].rivals] == ["tcp.expansion.housing"] * (verdict == "ambiguous")
    assert not causes[1].rivals


def test_others_beside_a_free_number_are_those_of_the_fit_without_its_prior():
    rng = np.random.default_rng(8)
    N, y, j = rng.standard_normal((40, 5)), rng.standard_normal(40), 2
    projector = Projector.of(N)
    fitted = Fitted(projector.most_likely(y), N, y, projector)
    prior = np.eye(5)
    prior[j, j] = 0.0
    np.testing.assert_allclose(beside_free(fitted, j), np.linalg.solve(N.T @ N + prior, N.T @ y), rtol=1e-9)


@pytest.mark.long
def test_what_does_nothing_of_what_a_number_does_is_a_note_and_no_rival():
    """Two findings that have nothing to do with each other are two, and no choice."""
    found, (j, _) = nothing(), small_case.source_off(0.0)
    source = found.detector.study.probed.parameters[j].path.removesuffix(".gain")
    batches = {b.kind: b for b in found.detector.columns.batches if b.q == 1}
    heat = next(h for h in batches["heat"].histories if h.signal)  # the drive of the source, at its bearing
    at = batches["heat"].places.index("bearing_front")
    alike = Hypothesis(batches["heat"], at, heat, 1e3, (10.0,))
    apart = Hypothesis(batches["probe"], 0, batches["probe"].histories[0], 1e3, (1e-10,))
    step = replace(found.steps[-1], ranked=(alike, apart))
    (cause,) = strained_of(replace(found, steps=(step,), loose=(Loose(j, 4.0, 0.3, 2.0, told=1e4),)))
    assert (cause.place, [r.place for r in cause.rivals]) == (source, ["bearing_front"])
    note = not_named(replace(found, steps=(step,)), [cause])
    assert apart.name in note
    assert alike.name not in note
    assert not not_named(found, [cause])

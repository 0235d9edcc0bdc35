"""Prices of freedom, and steps of amplitudes that stay where they mean something."""

from __future__ import annotations

import sys
from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.diagnose.evidence.batch import Batch, History, Hypothesis
from twin.diagnose.faults.acted import slots_with, units_of
from twin.diagnose.faults.table import fault_of
from twin.diagnose.result.diagnosis import Window
from twin.diagnose.search.accepted import Accepted
from twin.diagnose.search.contest import behind, foremost, judged, proof, tried, worth
from twin.diagnose.search.exact import _moved, beginning, exact, lowest, solved
from twin.diagnose.search.forward import _as_refitted
from twin.diagnose.search.look import look
from twin.diagnose.search.policy import POLICY
from twin.diagnose.search.strained import strained
from twin.diagnose.search.verdict import cause_of

pytestmark = pytest.mark.long

SEARCHED = SimpleNamespace(policy=POLICY, study=None, elements=None)  # all that comparing names needs of a detector


def hypothesis(places: int = 1, windows: int = 0, q: int = 1) -> Hypothesis:
    when = History(
        "", np.ones((q, 4)), windows=tuple(Window("a", 3600.0 * i, 3600.0 * i + 60.0) for i in range(windows))
    )
    names = tuple(f"p{i}" for i in range(places))
    batch = Batch("heat_source", "heat", "W", names, np.zeros((places, 4), dtype=int), (when,))
    return Hypothesis(batch, 0, when, 100.0, (1.0,) * q)


def test_freedom_has_its_price():
    assert worth(hypothesis()) == 100.0
    assert worth(hypothesis(places=10)) == pytest.approx(100.0 - 2.0 * np.log(10.0))
    one, two, three = (worth(hypothesis(windows=n)) for n in (1, 2, 3))
    assert one == 100.0
    assert one - two == pytest.approx(two - three)
    assert 4.0 < one - two < 36.0  # more than chance gives, less than a cause
    assert 2.0 < one - worth(hypothesis(q=2)) < 36.0


def test_fitted_edges_and_further_windows_are_no_proof():
    detector = small_case.made_detector()
    name = detector.study.runs[0].run.name

    def windows(*hours: float) -> Hypothesis:
        h = hypothesis()
        own = tuple(Window(name, 3600.0 * hour, 3600.0 * hour + 1800.0) for hour in hours)
        return replace(h, when=replace(h.when, windows=own))

    assert proof(detector, hypothesis()) == 100.0
    one, two = proof(detector, windows(1.0)), proof(detector, windows(1.0, 2.0))
    assert 2.0 < 100.0 - one < 36.0  # its two edges: more than chance gives, less than a cause
    assert one - two == pytest.approx(worth(windows(1.0)) - worth(windows(1.0, 2.0)))  # edges of the second included
    reading = replace(windows(1.0), batch=replace(hypothesis().batch, kind="step"))
    assert proof(detector, reading) == 100.0


@pytest.mark.parametrize("step", [-1e6, -1.0, -0.01, 0.0, 0.01, 1.0, 1e6])
@pytest.mark.parametrize("a", [-0.9, -0.2, 0.0, 3.0])
def test_conductances_stay_positive(a, step):
    (after,) = _moved(np.array([a]), np.array([step]), True, 0)
    assert np.sign(after - a) in (0.0, np.sign(step))
    for _ in range(100):
        assert -0.985 < after < 100.0  # beyond the lower one the time integration has no derivative left
        (after,) = _moved(np.array([after]), np.array([step]), True, 0)


def test_a_small_step_of_a_conductance_is_taken_as_it_is():
    (after,) = _moved(np.array([-0.5]), np.array([1e-4]), True, 0)
    assert after == pytest.approx(-0.5 + 1e-4, abs=1e-6)


def test_a_signed_amplitude_never_goes_through_zero():
    (after,) = _moved(np.array([4.0]), np.array([-100.0]), False, 1)
    assert after == pytest.approx(0.8)


def test_amplitudes_that_would_be_too_low_are_held_and_the_others_make_the_best_of_it():
    rng = np.random.default_rng(0)
    for _ in range(20):
        V = rng.standard_normal((6, 4))
        F, known = V.T @ V, 3.0 * rng.standard_normal(4)
        floor = np.array([-np.inf, 0.2, -np.inf, 0.0])
        a = solved(F, known, floor)
        assert np.all(a >= floor)
        free = a > floor
        np.testing.assert_allclose((F @ a - known)[free], 0.0, atol=1e-9)  # no slope where nothing holds
    np.testing.assert_allclose(solved(F, known, np.full(4, -np.inf)), np.linalg.solve(F, known))


def test_seconds_of_an_edge_are_found_beside_the_share_of_a_conductance():
    """One is known to 30 s, the other to a thousandth: information of 1e-3 and of 1e6."""
    F = np.array([[1e6, 10.0], [10.0, 1e-3]])
    a = np.array([-0.3, 900.0])
    np.testing.assert_allclose(solved(F, F @ a, np.array([-0.97, -np.inf])), a, rtol=1e-9)
    held = solved(F, F @ a, np.array([-0.2, -np.inf]))
    np.testing.assert_allclose(held, [-0.2, (F[1] @ a - F[1, 0] * -0.2) / F[1, 1]], rtol=1e-9)


def test_a_joint_that_is_nearly_gone_is_compared_whatever_it_scores():
    """As of drawn network 501, where the joint lost in a window scored less than heat, suns and coolants elsewhere."""
    detector = small_case.made_detector()
    heat = next(b for b in detector.columns.batches if b.kind == "heat")
    joint = next(b for b in detector.columns.batches if b.kind == "contact")
    scored = [[Hypothesis(heat, 0, heat.histories[0], 900.0 - i, (20.0,))] for i in range(detector.policy.ahead + 3)]
    gone, weaker = ([Hypothesis(joint, 0, joint.histories[0], 90.0, (a,))] for a in (-1.4, -0.4))
    found = foremost(detector, [*scored, gone, weaker, *[gone] * 9])
    assert found[: detector.policy.ahead] == scored[: detector.policy.ahead]
    assert found[detector.policy.ahead :] == [gone] * detector.policy.entrants


def test_the_best_of_every_family_is_compared():
    """Heat, where a dozen places in the sun score more."""
    detector = small_case.made_detector()
    heat = hypothesis()
    suns = [
        replace(heat, batch=replace(heat.batch, family="sun"), statistic=200.0 - i) for i in range(POLICY.ahead + 2)
    ]
    found = [h for (h,) in foremost(detector, [*((h,) for h in suns), (heat,), (replace(heat, statistic=90.0),)])]
    assert found == [*suns[: POLICY.ahead], heat]


def test_what_was_not_refitted_counts_by_what_is_left_of_its_family():
    """Of a capacity, which saturates; heat is as its score says."""
    detector = small_case.made_detector()
    heat = hypothesis(places=3)
    capacity = replace(heat, batch=replace(heat.batch, family="capacity", kind="capacity"), statistic=120.0)
    others = [replace(h, place=place) for h in (capacity, heat) for place in (1, 2)]
    refitted = [replace(capacity, statistic=30.0), replace(capacity, place=1, statistic=90.0)]
    told = _as_refitted(detector, refitted, [[h] for h in (capacity, replace(capacity, place=1))], others)
    assert [h.statistic for h in told] == [90.0, 90.0, 100.0, 100.0]
    least = 120.0 * (1.0 - behind(capacity, POLICY))  # what may overtake a leader by being refitted
    told = _as_refitted(detector, refitted[:1], [[capacity]], others)
    assert [h.statistic for h in told] == [least, least, 100.0, 100.0]
    more = _as_refitted(detector, [replace(capacity, statistic=150.0)], [[capacity]], others)
    assert [h.statistic for h in more] == [h.statistic for h in others]  # never more than they score


def test_what_a_cause_may_be():
    detector = small_case.made_detector()
    coolant = hypothesis(q=2)
    coolant = replace(coolant, batch=replace(coolant.batch, kind="coolant", family="coolant", smallest=5.0))
    np.testing.assert_array_equal(lowest(detector, coolant), [5.0, -np.inf])
    mean, inverse = fault_of(coolant).prior(2)
    assert 20.0 < mean[0] < 200.0  # W/(m^2 K), of a liquid that runs down a wall
    assert inverse[0] ** -0.5 == pytest.approx(mean[0])
    assert (mean[1], inverse[1]) == (0.0, 0.0)  # its heat is left to the data
    sun = hypothesis(q=2)
    assert np.all(lowest(detector, replace(sun, batch=replace(sun.batch, family="sun"))) == 0.0)
    assert np.all(np.isneginf(lowest(detector, sun)))
    assert not np.any(fault_of(sun).prior(2)[1])


def test_a_surface_lacks_no_more_film_than_it_has():
    """The refit stops where nothing is left of the described film, whatever the data ask for."""
    detector = small_case.made_detector()
    study = detector.study
    batch = next(b for b in detector.columns.batches if b.family == "film_gain" and b.kind == "film")
    films = [f.name for f in study.probed.base.load_model.films]
    place = next(p for p in study.probed.places if p.name == batch.places[0])
    h = Hypothesis(batch, 0, batch.histories[0], 100.0, (-1.0,))
    (floor,) = lowest(detector, h)
    own = [detector.nominal[k].total[:, films.index(place.film)] for k in study.fitted]
    assert floor == -max(f.max() for f in own) < 0.0
    wanted = replace(h, amplitude=(3.0 * floor,))
    x = np.zeros(len(study.probed.parameters))
    units = units_of(study, h)
    slots = [slots_with(study, detector.elements, units, k) for k in study.fitted]
    y = np.concatenate(
        [study.by_amplitudes(k, x, s, [3.0 * floor])[0] for k, s in zip(study.fitted, slots, strict=True)]
    )
    assert exact(detector, y, detector.fitter(y), wanted).amplitude[0] >= floor


def test_a_reading_is_refitted_with_the_parameters_that_had_bent_to_it():
    """To first order a drift of 40 K/day explains less than it does, since parameters have moved for it."""
    detector = small_case.made_detector()
    batch, place, when = next(
        (b, i, when) for b in detector.columns.batches if b.family == "sensor" and not b.fixed
        for i, name in enumerate(b.places) if name == "sensors.front" for when in b.histories if when.name == "drift"
    )  # fmt: skip
    study, size, parts = detector.study, 40.0, []
    for k in study.fitted:
        T, w = (v.copy() for v in study.runs[k].split(study.outputs(k, np.zeros(len(study.probed.parameters)))))
        m = study.runs[k].measured
        T[:, m.sensors.index("front")] += size / 86400.0 * (m.bin_time - m.bin_time[0])
        parts += [T.ravel(), w.ravel()]
    y = np.concatenate(parts)
    fitted = detector.fitter(y)
    found = exact(detector, y, fitted, Hypothesis(batch, place, when, 1.0, (0.5 * size,)))
    assert found.amplitude[0] == pytest.approx(size, rel=0.1)
    _, ranked, _ = look(detector, fitted)
    first = next(h for h in ranked if h.family == "sensor" and h.name == "sensors.front")
    assert found.statistic > first.statistic


def a_coolant(place: int, film: float, heat: float) -> Hypothesis:
    """On the small machine, in one window."""
    batch = next(b for b in small_case.made_detector().columns.batches if b.kind == "coolant")
    return Hypothesis(batch, place, batch.histories[0], 100.0, (film, heat))


def test_no_medium_is_frozen():
    detector = small_case.made_detector()
    h = a_coolant(0, 5.0, -1.0)
    area = next(p.area for p in detector.study.probed.places if p.name == h.name)
    above = detector.study.probed.base.reference_temperature  # K above 0 degC, at which water freezes
    cold = -10.0 * area * above
    np.testing.assert_allclose(fault_of(h).limited(detector.study, h.name, np.array([5.0, cold])), [10.0, cold])
    for kept in ([12.0, cold], [5.0, -cold]):
        np.testing.assert_array_equal(fault_of(h).limited(detector.study, h.name, np.array(kept)), kept)
    plain = hypothesis()
    np.testing.assert_array_equal(fault_of(plain).limited(detector.study, plain.name, np.array([-1e9])), [-1e9])


STRAIGHT, BENT = (SimpleNamespace(x=np.array([x])) for x in (0.0, 9.0))  # fits without a cause


def test_where_a_coolant_leads_those_near_it_are_tried_first(monkeypatch):
    """A linear score ranks the face behind first; after some passes from its last start the wetted one leads."""
    contest = sys.modules[worth.__module__]
    behind, wetted = (replace(a_coolant(p, 5.0, -1.0), statistic=s) for p, s in ((0, 1000.0), (1, 900.0)))
    cold = replace(wetted, amplitude=(7.0, -2.0))
    heat = replace(hypothesis(), statistic=850.0)
    passes = []

    def exact(detector, y, fitted, h, most):
        passes.append(most)
        return replace(h, statistic=1100.0 if h is cold else 950.0)

    monkeypatch.setattr(contest, "exact", exact)
    monkeypatch.setattr(contest, "longer", lambda study, elements, h: h)
    monkeypatch.setattr(contest, "without_one", lambda study, h: [])
    nothing = np.zeros(0)
    far = replace(wetted, statistic=0.2 * behind.statistic)
    order = tried(SEARCHED, nothing, STRAIGHT, [(heat,), (behind,), (wetted, cold), (far,)])
    assert order.pop() == (far,)
    assert [starts[0].statistic for starts in order] == [1100.0, 950.0, 850.0]
    assert order[0][0].amplitude == cold.amplitude
    assert len(passes) == 2
    assert passes[0] == passes[1] > 0  # some, not as many as a refit needs
    heat = replace(heat, statistic=2000.0)
    order = tried(SEARCHED, nothing, STRAIGHT, [(behind,), (heat,), (wetted, cold)])
    assert order == [(heat,), (behind,), (wetted, cold)]  # as they were
    assert len(passes) == 2
    assert tried(SEARCHED, nothing, STRAIGHT, []) == []
    monkeypatch.setattr(contest, "shorter", lambda study, h: [])
    monkeypatch.setattr(contest, "edges_tried", lambda detector, y, fitted, h: h)
    heat = replace(heat, statistic=850.0)
    tried(SEARCHED, nothing, BENT, [(heat,), (behind,), (wetted, cold)])
    assert len(passes) == 5  # from all starts, where a fit has bent parameters


def test_a_coolant_is_tried_in_longer_windows_while_they_explain_more(monkeypatch):
    """Twice and four times as long; eight times explains less, and is the last that is tried."""
    contest = sys.modules[worth.__module__]
    length, tries = {1.0: 100.0, 2.0: 300.0, 4.0: 400.0, 8.0: 350.0}, []

    def exact(detector, y, fitted, h, most):
        tries.append(h.amplitude[0])
        return replace(h, statistic=length[h.amplitude[0]])

    monkeypatch.setattr(contest, "exact", exact)
    monkeypatch.setattr(
        contest, "longer", lambda study, elements, h: replace(h, amplitude=(2.0 * h.amplitude[0], -1.0))
    )
    found = contest._in_other_windows(small_case.made_detector(), np.zeros(0), STRAIGHT, a_coolant(1, 1.0, -1.0))
    assert found.statistic == 400.0
    assert tries == [2.0, 4.0, 8.0]


def test_a_coolant_is_tried_without_a_window_that_explains_nothing(monkeypatch):
    contest, detector = sys.modules[worth.__module__], small_case.made_detector()
    first, second = (detector.study.runs[k].run.name for k in detector.study.fitted)
    right, wrong = Window(first, 3600.0, 7200.0), Window(second, 3600.0, 7200.0)
    one = a_coolant(1, 20.0, -20.0)
    one = replace(one, when=replace(one.when, windows=(right,)))
    both = replace(one, when=replace(one.when, windows=(right, wrong)))

    def exact(detector, y, fitted, h, most):
        return replace(h, statistic=150.0 if h.when.windows == (right,) else 50.0)

    monkeypatch.setattr(contest, "exact", exact)
    monkeypatch.setattr(contest, "longer", lambda study, elements, h: h)
    monkeypatch.setattr(contest, "edges_tried", lambda detector, y, fitted, h: h)
    found = contest._in_other_windows(detector, np.zeros(0), STRAIGHT, both)
    assert found.when.windows == (right,)
    assert found.when.name == f"from 1.0 h to 2.0 h of {first}"
    right = replace(right, end=5400.0)  # half of it, where a fit has bent parameters
    assert contest._in_other_windows(detector, np.zeros(0), STRAIGHT, both).when.windows != (right,)
    assert contest._in_other_windows(detector, np.zeros(0), BENT, one).when.windows == (right,)
    right = replace(right, end=6300.0)  # or with an edge a quarter of an hour earlier
    edge_moved = replace(one, when=replace(one.when, windows=(right,)))
    monkeypatch.setattr(contest, "edges_tried", lambda detector, y, fitted, h: edge_moved)
    assert contest._in_other_windows(detector, np.zeros(0), BENT, one).when.windows == (right,)


def test_a_capacity_further_behind_is_refitted(monkeypatch):
    """Heat in many windows explains more; a capacity that scores three quarters of it may explain as much."""
    contest = sys.modules[worth.__module__]
    monkeypatch.setattr(contest, "_closely", lambda detector, y, fitted, order, named: order)
    bent = replace(hypothesis(), batch=replace(hypothesis().batch, kind="moved"))

    def kind(name: str, statistic: float) -> Hypothesis:
        return replace(bent, batch=replace(bent.batch, kind=name), statistic=statistic)

    heat, tank, film = kind("moved", 328.0), kind("capacity", 250.0), kind("film", 250.0)
    monkeypatch.setattr(contest, "exact", lambda detector, y, fitted, h: replace(h, statistic=h.statistic + 1.0))
    nothing = np.zeros(0)
    proved, others = judged(SEARCHED, nothing, None, [(heat,), (tank,), (film,)])
    assert [h.batch.kind for h in proved] == ["moved", "capacity"]
    assert others == [film]


def test_windows_are_compared_before_their_edges_are_fitted(monkeypatch):
    """One gains 20 % by its edges, as the other would; a refit that finds several times more is not brought back."""
    contest = sys.modules[worth.__module__]
    monkeypatch.setattr(contest, "_closely", lambda detector, y, fitted, order, named: order)
    bent = replace(hypothesis(), batch=replace(hypothesis().batch, kind="moved"))
    lead, near, far = (replace(bent, statistic=s) for s in (1000.0, 950.0, 600.0))
    nothing = np.zeros(0)
    monkeypatch.setattr(contest, "exact", lambda detector, y, fitted, h: replace(h, statistic=1.2 * h.statistic))
    proved, others = judged(SEARCHED, nothing, None, [(lead,), (near,), (far,)])
    assert ([h.statistic for h in proved], others) == ([1200.0, 1140.0], [far])
    monkeypatch.setattr(contest, "exact", lambda detector, y, fitted, h: replace(h, statistic=5.0 * h.statistic))
    proved, others = judged(SEARCHED, nothing, None, [(lead,), (near,), (far,)])
    assert ([h.statistic for h in proved], others) == ([5000.0], [near, far])


def test_candidates_of_one_kind_do_not_keep_others_out(monkeypatch):
    contest = sys.modules[worth.__module__]
    monkeypatch.setattr(contest, "_closely", lambda detector, y, fitted, order, named: order)
    bent = replace(hypothesis(), batch=replace(hypothesis().batch, kind="moved"))
    many = [replace(bent, statistic=100.0 - 0.1 * k) for k in range(40)]
    film = replace(bent, batch=replace(bent.batch, kind="film"), statistic=93.0)
    monkeypatch.setattr(contest, "exact", lambda detector, y, fitted, h: h)
    proved, others = judged(SEARCHED, np.zeros(0), None, [(h,) for h in (*many, film)])
    assert 2 <= len(proved) <= 20
    few = len(proved) - 1
    assert proved == [*many[:few], film]
    assert others == many[few:]


def test_a_bent_calibration_is_no_place_to_begin():
    np.testing.assert_array_equal(beginning(np.array([1.0, -1.2])), [1.0, -1.2])
    np.testing.assert_array_equal(beginning(np.array([1.0, -6.0])), [0.0, 0.0])


def test_one_that_leads_by_its_score_is_refitted_beside_one_that_was(monkeypatch):
    """The exact model takes 5 % of either: the one that was refitted first does not lose by that."""
    contest = sys.modules[worth.__module__]
    straight, bent = hypothesis(), replace(hypothesis(), batch=replace(hypothesis().batch, kind="moved"))
    straight, bent = replace(straight, statistic=100.0), replace(bent, statistic=97.0)
    far = replace(hypothesis(), statistic=50.0)
    refitted = []

    def exact(detector, y, fitted, h):
        refitted.append(h)
        return replace(h, statistic=0.95 * h.statistic)

    monkeypatch.setattr(contest, "exact", exact)
    monkeypatch.setattr(contest, "bent", lambda detector, h: h.batch.kind == "moved")
    nothing = np.zeros(0)
    order = contest._fair(SEARCHED, nothing, None, [far, bent, straight], {})
    assert [h.statistic for h in order] == [97.0, 95.0, 50.0]
    assert refitted == [straight]
    assert contest._fair(SEARCHED, nothing, None, [straight, far], {}) == [
        straight,
        far,
    ]  # nothing near it was refitted
    assert refitted == [straight]


def test_those_near_the_leader_are_fitted_closer_before_one_leads(monkeypatch):
    """Strong ones differ by less than what linear models say wrongly; one far behind costs nothing."""
    contest = sys.modules[worth.__module__]
    lead, near, far = (replace(hypothesis(), statistic=s) for s in (1000.0, 950.0, 700.0))
    asked = []

    def closer(detector, y, fitted, h):
        asked.append(h)
        return replace(h, statistic=1100.0) if h is near else h

    monkeypatch.setattr(contest, "closer", closer)
    monkeypatch.setattr(contest, "misfit", lambda detector, fitted: 1500.0)
    fitted = SimpleNamespace(residual=np.zeros(300))
    stays = partial(contest._closely, SEARCHED, np.zeros(0), named=lambda h: h)
    order = stays(fitted, [lead, near, far])
    assert [h.statistic for h in order] == [1100.0, 1000.0, 700.0]
    assert asked == [lead, near]
    assert stays(fitted, []) == []
    enough = SimpleNamespace(residual=np.zeros(450))  # of so many numbers chance leaves as much as the leader
    assert stays(enough, [lead, near]) == [lead, near]
    assert asked == [lead, near]


def test_of_several_strong_ones_each_is_named_before_one_leads(monkeypatch):
    """One leads by what channels show of the other one's response otherwise than the model; alone it costs nothing."""
    contest = sys.modules[worth.__module__]
    lead, near, far = (replace(hypothesis(), statistic=s) for s in (1000.0, 950.0, 700.0))
    asked = []

    def named(h):
        asked.append(h)
        return replace(h, statistic=1200.0 if h is near else 1100.0)

    monkeypatch.setattr(contest, "closer", lambda detector, y, fitted, h: h)
    monkeypatch.setattr(contest, "misfit", lambda detector, fitted: 1500.0)
    fitted = SimpleNamespace(residual=np.zeros(300))
    order = contest._closely(SEARCHED, np.zeros(0), fitted, [lead, near, far], named)
    assert [h.statistic for h in order] == [1200.0, 1100.0, 700.0]
    assert asked == [lead, near]
    assert contest._closely(SEARCHED, np.zeros(0), fitted, [lead, far], named) == [lead, far]
    assert asked == [lead, near]


@pytest.mark.parametrize(("reached", "goes_on"), [(800.0, False), (900.0, True)])
def test_a_window_that_falls_behind_after_few_passes_goes_no_further(monkeypatch, reached, goes_on):
    contest = sys.modules[worth.__module__]
    window, passes = hypothesis(windows=1), []

    def exact(detector, y, fitted, h, most=0):
        passes.append(most)
        return replace(h, statistic=reached + len(passes))

    monkeypatch.setattr(contest, "exact", exact)
    monkeypatch.setattr(contest, "edges_of", lambda study, h: [0])
    found = contest._refitted(SEARCHED, np.zeros(0), None, [window], 1000.0)
    assert found.statistic == reached + len(passes)
    assert passes == [POLICY.trial, 0][: 1 + goes_on]


def test_what_a_leader_gained_by_being_refitted_the_best_of_other_kinds_may_gain_too(monkeypatch):
    """Parameters had bent to either: heat that scores as a misplaced source did explains more once it is refitted."""
    contest = sys.modules[worth.__module__]
    monkeypatch.setattr(contest, "exact", lambda detector, y, fitted, h: replace(h, statistic=2.7 * h.statistic))
    monkeypatch.setattr(contest, "bent", lambda detector, h: h.batch.kind in ("film", "moved"))
    lead = replace(hypothesis(), batch=replace(hypothesis().batch, kind="film"), statistic=630.0)
    heat, second, far = (replace(hypothesis(), statistic=s) for s in (250.0, 248.0, 150.0))
    nothing = np.zeros(0)
    order = contest._fair(SEARCHED, nothing, None, [lead, heat, second, far], {id(lead): 280.0})
    assert [h.statistic for h in order] == [pytest.approx(675.0), 630.0, 248.0, 150.0]
    order = contest._fair(SEARCHED, nothing, None, [lead, heat, far], {id(lead): 620.0})  # which was far ahead before
    assert order == [lead, heat, far]
    known = replace(lead, batch=replace(lead.batch, kind="moved"))  # what is scored from the description: more is near
    order = contest._fair(SEARCHED, nothing, None, [known, heat], {id(known): 400.0})
    assert order[0].statistic == pytest.approx(675.0)


@pytest.mark.parametrize(("alone", "freed", "closes"), [(2900.0, 3000.0, False), (2500.0, 3000.0, True),
                                                        (2900.0, 1100.0, True)])  # fmt: skip
def test_one_cause_that_leaves_chance_alone_beats_a_number_that_leaves_more(monkeypatch, alone, freed, closes):
    """Of 1000 numbers chance leaves 1134 at most; without anything 4000 are left, with a number freed `freed`."""
    module = sys.modules[strained.__module__]
    monkeypatch.setattr(module, "misfit", lambda detector, left: left)
    monkeypatch.setattr(module, "exact", lambda detector, y, fitted, h: replace(h, statistic=alone))
    detector = SimpleNamespace(policy=POLICY, thresholds={"heat_source": 36.0})
    drift, weak = replace(hypothesis(), statistic=2000.0), replace(hypothesis(), statistic=1500.0)
    assert module._explained(detector, np.zeros(1000), 4000.0, freed, [drift]) != closes
    assert not module._explained(detector, np.zeros(1000), 4000.0, freed, [weak])


def test_a_coolants_film_has_a_discrepancy_of_its_own():
    """As a share of it, but of no less than the film that is presumed."""
    study = small_case.made_detector().study

    def half(film: float) -> float:
        """Of the interval where the data leave nothing open."""
        h = a_coolant(0, film, -10.0)
        one = Accepted(h, units_of(study, h), np.array([film, -10.0]), np.zeros((2, 2)), 100.0, 36.0, ())
        cause = cause_of(one, study)
        assert cause.amplitude == film
        low, high = cause.ci95
        assert low == pytest.approx(max(film - (high - film), 0.0))
        return high - film

    assert half(10.0) == pytest.approx(half(20.0))
    assert half(1000.0) == pytest.approx(2.0 * half(500.0))
    assert 0.1 * 500.0 < half(500.0) < 500.0
    assert half(20.0) < half(500.0)

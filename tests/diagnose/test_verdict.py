"""What calibration absorbs is said too: a declared number that cannot hold."""

from __future__ import annotations

import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.diagnose.evidence.batch import Batch, History, Hypothesis
from twin.diagnose.evidence.pulls import Loose
from twin.diagnose.faults.catalogue import FAMILIES
from twin.diagnose.faults.table import OF_KIND
from twin.diagnose.result.spot import Spot
from twin.diagnose.search.accepted import Accepted, parameter_of
from twin.diagnose.search.by_calibration import CALIBRATED, strained_of
from twin.diagnose.search.forward import search
from twin.diagnose.search.limits import limits_at, limits_of, over_histories
from twin.diagnose.search.loose import Freed
from twin.diagnose.search.policy import POLICY
from twin.diagnose.search.rivals import remedy, rival_of
from twin.diagnose.search.start import begun
from twin.diagnose.search.strained import strained
from twin.diagnose.search.verdict import _more_alike, cause_of, verdict_of


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        ("bed.left", "bed.right", True),
        ("bed.left", "column.left", False),
        ("parts.screw", "parts.rail", False),
        ("scales.x", "scales.y", False),
        ("sources.motor>bed.left", "sources.motor>bed.right", True),
    ],
)
def test_faces_of_a_part_have_one_owner_and_two_parts_do_not(one, other, same):
    """Causes of one owner are one answer, others are "ambiguous" where the data do not tell them."""
    assert (Spot.read(one).owner == Spot.read(other).owner) == same


@pytest.mark.parametrize(
    ("kind", "wanted", "low", "high"),
    [  # amplitude 0.5, of which one standard deviation is 0.1
        ("heat", 0.5, 0.304, 0.696),
        ("contact", 1.5, 1.304, 1.696),
        ("gain", np.exp(0.5), np.exp(0.304), np.exp(0.696)),
    ],
)
def test_candidates_and_causes_have_their_sizes_in_the_same_words(kind, wanted, low, high):
    batch = Batch("family", kind, "1", ("p",), np.zeros((1, 1), dtype=int), (History("always", np.ones((1, 1))),))
    found = rival_of(Hypothesis(batch, 0, batch.histories[0], 25.0, (0.5,)), 1.0)
    assert (found.amplitude, found.ci95) == (pytest.approx(wanted), pytest.approx((low, high)))


@pytest.mark.parametrize(("sign", "ends"), [(0, (-0.46, 1.46)), (1, (0.0, 1.46)), (-1, (-1.46, 0.0))])
def test_an_interval_ends_where_physics_does(sign, ends):
    always = (History("always", np.ones((1, 1))),)
    batch = Batch("heat_source", "heat", "W", ("housing",), np.zeros((1, 1), dtype=int), always, sign)
    size = np.array([0.5 * (sign or 1)])
    one = Accepted(Hypothesis(batch, 0, always[0], 9.0, (float(size[0]),)), (), size, 0.24 * np.eye(1), 9.0, 36.0, ())
    found = cause_of(one, small_case.study())
    assert found.ci95 == pytest.approx(ends, abs=0.01)


@pytest.mark.parametrize(
    ("amplitude", "sigma", "ends"), [(1.25, 0.67, (1.24, 4.09)), (-0.7, 0.05, (0.11, 0.49)), (-0.9, 0.09, (0.0, 0.376))]
)
def test_what_a_film_has_gained_is_known_by_a_factor_and_what_it_has_lost_by_a_share(amplitude, sigma, ends):
    """Beside what the form of the model may have wrong, an eighth of either."""
    always = (History("always", np.ones((1, 1))),)
    batch = Batch("film_gain", "group", "1", ("films.air",), np.zeros((1, 1), dtype=int), always)
    h = Hypothesis(batch, 0, always[0], 9.0, (amplitude,))
    found = cause_of(Accepted(h, (), np.array([amplitude]), sigma**2 * np.eye(1), 9.0, 36.0, ()), small_case.study())
    assert found.amplitude == pytest.approx(1.0 + amplitude)
    assert found.ci95 == pytest.approx(ends, abs=0.01)


def test_an_exact_factor_is_told_as_a_factor_without_an_interval():
    always = (History("factor", np.ones((1, 1))),)
    batch = Batch(
        "signal", "signal", "1", ("signals.x_current*0.707",), np.zeros((1, 1), dtype=int), always, fixed=True
    )
    found = rival_of(Hypothesis(batch, 0, batch.histories[0], 25.0, (1.0,)), 1.0)
    assert (found.place, found.amplitude) == ("signals.x_current", 0.707)
    assert np.isnan(found.ci95).all()


@pytest.mark.parametrize(("less", "wanted"), [(3.0, "ambiguous"), (40.0, "signal")])
def test_factors_of_one_signal_that_explain_nearly_the_same_are_ambiguous(less, wanted):
    always = (History("factor", np.ones((1, 1))),)
    places = ("signals.x_current*0.5", "signals.x_current*0.707", "signals.y_current*2")
    batch = Batch("signal", "signal", "1", places, np.zeros((3, 1), dtype=int), always, fixed=True)
    half, root, other = (Hypothesis(batch, i, always[0], 200.0 - i * less, (1.0,)) for i in range(3))
    near = ((root, 0.999), (other, 0.1)) if wanted == "ambiguous" else ((other, 0.1),)
    one = Accepted(half, (), np.ones(1), np.eye(1), 200.0, 36.0, near)
    found = SimpleNamespace(detector=small_case.made_detector(), accepted=(one,), steps=[SimpleNamespace(parts={})])
    verdict, (cause,) = verdict_of(found, FAMILIES)
    assert (verdict, cause.amplitude) == (wanted, 0.5)
    assert cause.ci95 == ((0.5, 0.707) if wanted == "ambiguous" else (0.5, 0.5))


@pytest.mark.parametrize("first", ["heat", "zone"])
def test_another_temperature_of_a_film_s_air_is_told_from_heat_by_that_of_the_air(first):
    batches = {b.kind: b for b in small_case.made_detector().columns.batches if b.q == 1}
    heat, air = (Hypothesis(batches[k], 0, batches[k].histories[0], 800.0, (10.0,)) for k in ("heat", "zone"))
    one, other = (heat, air) if first == "heat" else (air, heat)
    assert remedy(one, other) == f"a temperature sensor in the air at {air.name}"
    assert remedy(heat, replace(heat, place=1)) == f"a temperature sensor between {heat.name} and " + (
        f"{replace(heat, place=1).name}, nearer to one of them"
    )


def test_a_look_tells_where_a_sensor_is_and_a_measurement_whose_number_it_is():
    batches = {b.kind: b for b in small_case.made_detector().columns.batches}
    moved, heat = (Hypothesis(batches[k], 0, batches[k].histories[0], 800.0, (1.0,)) for k in ("elsewhere", "heat"))
    sensor = moved.name.removeprefix("sensors.").partition(">")[0]
    assert remedy(moved, heat) == remedy(heat, moved) == f"a look at where {sensor} is mounted"
    steel, column = (
        replace(heat, batch=replace(heat.batch, places=(name,)))
        for name in ("materials.steel.expansion", "parts.column")
    )
    assert remedy(steel, column) == "a measurement of materials.steel.expansion, or of parts.column, by itself"
    assert "by itself" not in remedy(steel, heat)


@pytest.mark.parametrize(
    ("statistic", "less", "wanted"), [(800.0, 3.0, "ambiguous"), (800.0, 9.0, "named"), (50_000.0, 100.0, "ambiguous")]
)
def test_of_equal_misfits_the_data_have_decided_nothing(statistic, less, wanted):
    """However unlike each other two causes are; of a strong one the error of its response is more than chance."""
    batches = {b.kind: b for b in small_case.made_detector().columns.batches if b.q == 1}
    heat, warmer = (
        Hypothesis(batches[kind], 0, batches[kind].histories[0], s, (10.0,) * batches[kind].q)
        for kind, s in (("heat", statistic), ("contact", statistic - less))
    )
    one = Accepted(heat, (), np.full(1, 10.0), np.eye(1), statistic, 36.0, ((warmer, 0.9),))
    found = SimpleNamespace(detector=small_case.made_detector(), accepted=(one,), steps=[SimpleNamespace(parts={})])
    verdict, (cause,) = verdict_of(found, FAMILIES)
    assert verdict == wanted
    assert bool(cause.rivals[0].remedy) == (wanted == "ambiguous")


@pytest.mark.parametrize(("at", "wanted"), [("bed", "ambiguous"), ("nut", "named")])
def test_heat_where_a_source_is_said_to_be_is_its_rival_below_its_own_threshold(at, wanted):
    """One of many places, so that its threshold is higher; beside that source it is the one place."""
    detector = small_case.made_detector()
    moved = next(b for b in detector.columns.batches if b.kind == "moved")
    heat = next(b for b in detector.columns.batches if b.kind == "heat")
    there = next(i for i, p in enumerate(moved.places) if p.endswith(">bed"))
    lead = Hypothesis(moved, there, moved.histories[0], 40.0, (0.3,))
    other = Hypothesis(heat, heat.places.index(at), heat.histories[0], 42.0, (30.0,))
    one = Accepted(lead, (), np.full(1, 0.3), np.eye(1), 40.0, 36.0, ((other, 0.9),))
    thresholds = detector.thresholds | {"heat_source": 50.0, "misplaced_source": 36.0}
    found = SimpleNamespace(
        detector=replace(detector, thresholds=thresholds), accepted=(one,), steps=[SimpleNamespace(parts={})]
    )
    assert verdict_of(found, FAMILIES)[0] == wanted


def test_limits_of_factors_are_factors():
    detector = small_case.made_detector()
    gain = next(b for b in detector.columns.batches if b.kind == "gain")
    of_gains = (gain.family, "1", False)  # and of none that switches
    at = sorted(size for (family, unit, _, w), size in limits_at(detector).items() if (family, unit, w) == of_gains)
    (limit,) = (x for x in limits_of(detector) if (x.family, x.unit) == (gain.family, "1"))
    assert limit.smallest == pytest.approx(OF_KIND["gain"].curve.told(at[0])) == pytest.approx(np.exp(at[0]))
    assert limit.largest == pytest.approx(np.exp(at[-1]))


@pytest.mark.parametrize(("pull", "wanted"), [(0.8, "nothing"), (4.5, "out_of_tolerance")])
def test_a_source_beyond_its_tolerance_is_out_of_it(pull, wanted):
    detector = small_case.made_detector()
    study = detector.study
    source = next(i for i, p in enumerate(study.probed.parameters) if p.kind == "source")
    x = np.zeros(len(study.probed.parameters))
    x[source] = pull
    y = np.concatenate([study.outputs(k, x) for k in study.fitted])
    noise = detector.whiten.colour(np.random.default_rng(1).standard_normal(len(y)))
    verdict, causes = verdict_of(search(detector, np.where(np.isfinite(noise), y + noise, np.nan)), FAMILIES)
    assert verdict == wanted
    if wanted == "nothing":
        assert causes == ()
        return
    parameter = study.probed.parameters[source]
    (cause,) = causes
    assert (cause.family, cause.place, cause.history) == ("loss_law", parameter.path.removesuffix(".gain"), "always")
    assert cause.statistic > cause.threshold > 1.0
    assert 1.0 < cause.ci95[0] < np.exp(parameter.sigma * pull) < cause.ci95[1]  # freed of its tolerance


def test_films_without_a_declared_gain_are_not_asked_for_it():
    """`[[parameters]]` may leave films out; their hypotheses are there all the same."""
    detector = small_case.made_detector()
    probed = detector.study.probed
    told = tuple(replace(p, path=f"other.{i}") if p.kind == "film" else p for i, p in enumerate(probed.parameters))
    other = replace(detector, study=replace(detector.study, probed=replace(probed, parameters=told)))
    assert {b.kind for b in detector.columns.batches} >= {"gain", "group"}
    film = next(p.path.removesuffix(".gain") for p in probed.parameters if p.kind == "film")
    assert parameter_of(detector.study, film) is not None
    assert parameter_of(other.study, film) is None
    n, films = len(told), [i for i, p in enumerate(told) if p.kind == "film"]
    y = np.concatenate([detector.study.outputs(k, np.zeros(n)) for k in detector.study.fitted])
    start = replace(begun(detector, y), detector=other, loose=(Loose(films[0], 2.0, 0.1, 5.0),))
    assert strained(start, y) is None


def test_a_number_that_runs_to_where_it_changes_nothing_is_not_told(monkeypatch):
    detector = small_case.made_detector()
    study = detector.study
    j = next(i for i, p in enumerate(study.probed.parameters) if p.kind == "source")
    x = np.zeros(len(study.probed.parameters))
    x[j] = 4.5
    y = np.concatenate([study.outputs(k, x) for k in study.fitted])
    start = begun(detector, y)
    freed = strained(start, y)
    assert freed is not None
    module = sys.modules[strained.__module__]
    monkeypatch.setattr(module, "_scored", lambda *_: 0.0)  # by its derivative, as of a film many times as large

    def beside(share: float) -> bool:
        """Whether it is told where something else explains this share of what it does."""
        seen, ranked, step = start.scored
        sure = replace(ranked[0], statistic=share * freed[1].statistic)
        return strained(replace(start, scored=(seen, [sure], step)), y) is not None

    assert beside(0.02)  # its own discrepancy may leave that
    assert not beside(0.5)
    gone = lambda *a: (start.fitted, [replace(a[3][0], covariance=np.zeros((1, 1)))])  # noqa: E731
    monkeypatch.setattr(module, "refit", gone)
    assert strained(replace(start, freed=Freed()), y) is None


def test_contacts_that_calibration_strains_are_told_with_what_they_became():
    detector = small_case.made_detector()
    parameters = detector.study.probed.parameters
    contact = next(i for i, p in enumerate(parameters) if p.kind in ("contact", "joint"))
    y = np.concatenate([detector.study.outputs(k, np.zeros(len(parameters))) for k in detector.study.fitted])
    found = search(detector, y)
    assert strained_of(found) == ()
    (cause,) = strained_of(replace(found, loose=(Loose(contact, -6.0, 0.5, 2.0),)))
    assert (cause.family, cause.parameter, cause.history) == ("joint", parameters[contact].path, CALIBRATED)
    assert cause.statistic > cause.threshold
    assert cause.ci95[0] < cause.amplitude < cause.ci95[1]
    assert cause.amplitude == pytest.approx(np.exp(-6.0 * parameters[contact].sigma))


@pytest.mark.parametrize(("share", "reaches"), [(0.5, False), (0.9, True)])
def test_a_number_at_the_bound_of_its_calibration_may_be_as_far_off_as_physics_allows(share, reaches):
    detector = small_case.made_detector()
    parameters = detector.study.probed.parameters
    j, y = small_case.source_off(0.0)
    p = parameters[j]
    x = share * p.coordinate(p.high)
    (cause,) = strained_of(replace(search(detector, y), loose=(Loose(j, x, 0.01, 2.0),)))
    assert cause.ci95[0] == pytest.approx(np.exp(p.sigma * (x - 1.96 * 0.01)))
    assert cause.ci95[1] == pytest.approx(5.0 if reaches else np.exp(p.sigma * (x + 1.96 * 0.01)))


@pytest.mark.parametrize(
    ("causes", "next_one", "statistic", "left", "wanted"),
    [
        (3, "runs.a.d", 957.0, 247.0, True),  # one more part of the same body
        (3, "runs.a.d", 957.0, 1500.0, False),  # it does not explain what is left
        (3, "runs.b.d", 957.0, 247.0, False),  # in another run
        (2, "runs.a.d", 957.0, 247.0, False),  # the search could have named it
    ],
)
def test_what_one_more_part_of_a_warm_body_explains_is_not_unknown(causes, next_one, statistic, left, wanted):
    def start(name, statistic=500.0):
        return SimpleNamespace(family="initial_state", kind="start", name=name, statistic=statistic)

    accepted = [SimpleNamespace(hypothesis=start(f"runs.a.{part}")) for part in "bcx"[:causes]]
    found = SimpleNamespace(
        detector=SimpleNamespace(policy=POLICY),
        accepted=accepted,
        steps=[SimpleNamespace(ranked=(start(next_one, statistic),))],
    )
    assert _more_alike(found, left) == wanted


def test_a_limit_is_the_median_or_that_of_the_worst_signal():
    always, x, y = (
        History("always", np.ones((1, 1))),
        *(History(name, np.ones((1, 1)), signal=name) for name in ("x_speed", "y_speed")),
    )
    sizes = np.array([[3.0, 8.0, 36.0]])
    assert over_histories([always, x, y], sizes) == 8.0
    assert over_histories([x, y], sizes[:, 1:]) == 36.0
    windows = [replace(always, name=f"window {k}", windows=((0, k, k + 1),)) for k in range(3)]
    assert over_histories(windows, sizes) == 8.0

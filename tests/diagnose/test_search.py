"""From measurements to a verdict on the lumped machine: what is hidden is named, and nothing where nothing is."""

from __future__ import annotations

import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.evidence.leading import channel_of
from twin.diagnose.evidence.whiten import measured_of
from twin.diagnose.faults.acted import slots_with
from twin.diagnose.faults.catalogue import FAMILIES
from twin.diagnose.faults.fault import Unit
from twin.diagnose.faults.readings import play
from twin.diagnose.faults.sensor_readings import _drifts
from twin.diagnose.faults.table import OF_KIND
from twin.diagnose.search.accepted import curved_change, exchanged, motion
from twin.diagnose.search.detector import Detector
from twin.diagnose.search.dispersion import dispersion_of, raised, searched
from twin.diagnose.search.exact import misfit, misfit_of_each
from twin.diagnose.search.forward import search, search_again
from twin.diagnose.search.gain import predicted
from twin.diagnose.search.limits import limits_at, limits_in, limits_of
from twin.diagnose.search.loose import loose_ones
from twin.diagnose.search.policy import POLICY
from twin.diagnose.search.start import begun
from twin.diagnose.search.strained import strained
from twin.diagnose.search.verdict import pulls_of, verdict_of


def measured(kind="", place="", size=0.0, seed=0, levels=(1.0,)):
    """(m,) what the machine shows with noise, and a cause: in every run its size times levels, each as long."""
    study = small_case.study()
    rng = np.random.default_rng(seed)
    x = 0.5 * rng.standard_normal(len(study.probed.parameters))
    steps = [p.run.drive.n_steps for p in study.runs]
    shapes = tuple(np.array(levels)[np.arange(n) * len(levels) // n] for n in steps)
    units = [Unit(OF_KIND[kind], place, -1, shapes)] if kind else []
    parts = []
    for k in study.fitted:
        slots = slots_with(study, small_case.elements(), units, k)
        (b, s), (rows, _) = study.runs[k].shapes
        sigma = np.concatenate([np.full(b * s, small_case.NOISE / np.sqrt(5)), np.full(rows * 3, 3e-7)])
        parts.append(study.outputs(k, x, slots, [size] if units else []) + sigma * rng.standard_normal(len(sigma)))
    return np.concatenate(parts)


def test_nothing_is_found_where_nothing_is():
    found = search(small_case.made_detector(), measured(seed=1))
    assert verdict_of(found, FAMILIES) == ("nothing", ())
    assert not found.accepted
    assert all(abs(p.pull) < 5.0 for p in pulls_of(found))
    models = predicted(found, 2)
    np.testing.assert_array_equal(models.extended, models.recalibrated)


@pytest.mark.parametrize(("kind", "said"), [("slip", "always"), ("probed", "when measured")])
def test_a_play_of_the_machine_is_told_from_one_of_the_measuring_device(kind, said):
    study, seed, size = small_case.study(), 3, 4e-6
    x = 0.5 * np.random.default_rng(seed).standard_normal(len(study.probed.parameters))  # as `measured` draws them
    lag = size * play(study, lambda k: study.states(k, x), kind, "dz", size)
    found = search(small_case.made_detector(), measured(seed=seed) + lag)
    verdict, (cause,) = verdict_of(found, FAMILIES)
    assert (verdict, cause.family, cause.place, cause.history) == ("named", "slip", "tcp.dz", said)
    assert cause.ci95[0] < size < cause.ci95[1]


def test_a_sensor_that_is_off_is_a_sensor_that_is_off():
    study, y = small_case.study(), measured(seed=2)
    first = 0
    for k in study.fitted:
        (b, s), _ = study.runs[k].shapes
        drift = study.runs[k].measured.bin_time * 3.0 / 14400.0
        y[first : first + b * s].reshape(b, s)[:, 1] += drift  # 3 K in four hours
        first += study.runs[k].size
    found = search(small_case.made_detector(), y)
    verdict, causes = verdict_of(found, FAMILIES)
    assert verdict == "sensor"
    assert (causes[0].family, causes[0].place, causes[0].history) == ("sensor", "sensors.housing", "drift")
    assert causes[0].amplitude == pytest.approx(18.0, rel=0.1)  # K/day


def test_a_sensor_that_drifts_in_one_run_alone_is_no_heat():
    """Heat of any history at a part without a sensor beside it does the same."""
    study, y = small_case.study(), measured(seed=2)
    last = study.runs[study.fitted[-1]]
    (b, s), _ = last.shapes
    own = y[study.rows[-1]][: b * s].reshape(b, s)
    own[:, 1] += last.measured.bin_time * 3.0 / 14400.0  # 3 K in four hours
    verdict, (cause,) = verdict_of(searched(small_case.made_detector(), y)[0], FAMILIES)
    assert (verdict, cause.family, cause.place) == ("sensor", "sensor", "sensors.housing")
    assert cause.history == f"drift in {last.run.name}"
    assert cause.amplitude == pytest.approx(18.0, rel=0.1)  # K/day


def test_drifts_of_one_run_are_of_those_that_read_the_sensor():
    """One of three runs has the tool alone, one another sensor."""

    def plan(run: str, *sensors: str) -> SimpleNamespace:
        return SimpleNamespace(run=SimpleNamespace(name=run), measured=SimpleNamespace(sensors=sensors))

    day = np.array([0.0, 86400.0])
    plans = [plan("tool", "a"), plan("monday", "a", "b"), plan("tuesday", "b"), plan("friday", "a", "b")]
    times = [day[:0], day, day, day]
    made = {name: [v.tolist() for v in values] for name, values in _drifts("a", plans, times)}
    assert made == {
        "drift in monday": [[], [0.0, 1.0], [0.0, 0.0], [0.0, 0.0]],
        "drift in monday that stays": [[], [0.0, 1.0], [1.0, 1.0], [1.0, 1.0]],
        "drift in friday": [[], [0.0, 0.0], [0.0, 0.0], [0.0, 1.0]],
    }
    assert _drifts("a", plans[:2], times[:2]) == []  # of one run alone a drift is one in every run


def test_swapped_sensors_are_put_back_and_leave_nothing():
    """Two channels tens of kelvins apart would bend every parameter: with the channels back, nothing else is found."""
    study, y = small_case.study(), measured(seed=4)
    names, first = [], 0
    for k in study.fitted:
        (b, s), _ = study.runs[k].shapes
        names = [*study.runs[k].measured.sensors][:2]
        T = y[first : first + b * s].reshape(b, s)
        T[:, [0, 1]] = T[:, [1, 0]]
        first += study.runs[k].size
    found = search(small_case.made_detector(), y)
    verdict, (cause,) = verdict_of(found, FAMILIES)
    assert (verdict, cause.history, set(cause.place.removeprefix("sensors.").split("<>"))) == (
        "sensor", "swapped", set(names)
    )  # fmt: skip
    assert np.isnan([cause.amplitude, *cause.ci95]).all()  # there is no size
    clean = search(small_case.made_detector(), measured(seed=4))
    np.testing.assert_allclose(found.x, clean.x, atol=0.1)
    np.testing.assert_array_equal(exchanged(study, y, found.accepted), measured(seed=4))


def test_hidden_heat_is_refitted_with_the_exact_model():
    """300 W at the housing: the extended model follows the machine where the recalibrated one cannot."""
    y = measured("heat", "housing", 300.0, seed=3)
    found = search(small_case.made_detector(), y)
    verdict, causes = verdict_of(found, FAMILIES)
    assert verdict in ("named", "ambiguous")
    assert causes[0].statistic > causes[0].threshold
    families = {causes[0].family, *(r.family for r in causes[0].rivals)}
    assert "heat_source" in families
    study = small_case.study()
    left = []
    for k in study.fitted:
        models = predicted(found, k)
        own = y[: study.runs[0].size] if k == 0 else y[study.runs[0].size :]
        T = [study.runs[k].split(own - m)[0] for m in (models.recalibrated, models.extended)]
        left.append([float(np.sqrt(np.nanmean(t**2))) for t in T])
    plain, extended = np.mean(left, axis=0)
    assert plain > 3.0
    assert extended < 0.5 * plain  # the rest counts as model discrepancy, which is large on so coarse a machine


def test_limits_are_sizes_that_would_pass():
    limits = limits_of(small_case.made_detector())
    assert {"heat_source", "film_gain", "sensor"} <= {limit.family for limit in limits}
    for limit in limits:
        assert 0.0 < limit.smallest <= limit.size <= limit.largest, limit
    wide = replace(
        small_case.made_detector(), thresholds={f: 4.0 * t for f, t in small_case.made_detector().thresholds.items()}
    )
    by = {(limit.family, limit.unit): limit.size for limit in limits}
    assert all(limit.size >= by[limit.family, limit.unit] for limit in limits_of(wide))


def test_what_no_machine_can_have_is_seen_at_no_size():
    """Of a model as bad as this an offset would have to be a million kelvins."""
    detector = small_case.made_detector()
    blind = replace(detector, thresholds=dict.fromkeys(detector.thresholds, 1e14))
    limits = {(limit.family, limit.unit): limit for limit in limits_of(blind)}
    assert np.isinf(limits["sensor", "K"].smallest)
    assert np.isinf(limits["measurement", "m/s"].size)
    assert np.isfinite([limit.size for limit in limits_of(detector) if limit.family == "sensor"]).all()


def test_limits_of_lags_hold_at_larger_sizes():
    """What is not in proportion to its size may look more like a parameter the larger it is."""
    detector, tried = small_case.made_detector(), 0
    states = motion(detector, None)
    _, _, projector = detector.fitter.linear(np.zeros(len(detector.study.probed.parameters)))
    for batch, sizes in limits_in(detector):
        needed = np.sqrt(detector.thresholds[batch.family]) + detector.policy.power
        for i, size in enumerate(sizes[:, 0] if (batch.family, batch.unit) == ("sensor", "s") else ()):
            h = Hypothesis(batch, i, batch.histories[0], 0.0, (1.0,))
            for lag in size * np.array([1.0, 1.5, 3.0]) if np.isfinite(size) else ():
                change = detector.whiten(curved_change(detector, h, lag, states))
                assert change @ projector(change) > (0.95 * needed) ** 2, (batch.places[i], lag)
                tried += 1
    assert tried


# --- thresholds grow with what a model that is wrong in its form leaves, but not with what a cause explains


def slow_discrepancy(size: float) -> np.ndarray:
    """(m,) what no cause does: every channel swings slowly in its own way, by size [K], and the tool by as many um."""
    study, parts, phase = small_case.study(), [], 0.0
    for k in study.fitted:
        (b, s), (rows, _) = study.runs[k].shapes
        for n, channels, unit in ((b, s, 1.0), (rows, 3, 1e-6)):
            hours = np.linspace(0.0, small_case.HOURS, n)[:, None]
            lasts = np.linspace(1.1, 2.3, channels)
            parts.append((size * unit * np.sin(2 * np.pi * hours / lasts + lasts * (7.0 + phase))).ravel())
        phase += 3.0
    return np.concatenate(parts)


def test_noise_alone_leaves_a_dispersion_of_hardly_one():
    _, own = searched(small_case.made_detector(), measured(seed=1))
    assert own.share == pytest.approx(0.8, abs=0.2)


def leaps(detector: Detector, size: float) -> np.ndarray:
    """(m,) noise of the first sensor of every run beyond that which it is said to have, in its standard deviations."""
    of_first, rng = np.zeros(len(measured_of(detector.study))), np.random.default_rng(9)
    for own, (sensors, _) in zip(detector.study.rows, detector.whiten.channels, strict=True):
        bins, s = detector.study.runs[0].shapes[0]
        of_first[own][: bins * s : s] = size * sensors.sigma[0] * rng.standard_normal(bins)
    return of_first


def test_what_leaps_from_reading_to_reading_is_noise_of_that_channel():
    """It is weighed by it, and hides nothing elsewhere; errors that last raise what a cause must explain."""
    detector = small_case.made_detector()
    channel, sensors = channel_of(detector.study), detector.study.probed.base.sensors
    y = measured(seed=3) + leaps(detector, 5.0) + 1.5 * (channel == sensors.index("screw_middle"))
    alone = search(detector, y)
    assert dispersion_of(alone).share > 2.0
    found, own = searched(detector, y)
    assert [a.hypothesis.name for a in found.accepted] == ["sensors.screw_middle"]
    assert own.share < 1.2
    assert own.least(POLICY) == 0.0
    weight = found.detector.whiten.weight
    np.testing.assert_array_equal(weight, own.weight)  # by which limits are stated
    assert weight[channel == 0] == pytest.approx(1.0 / np.hypot(1.0, 5.0), rel=0.3)  # the rest is fitted
    assert weight[channel != 0].min() > 0.7  # a fit that leaps have drawn aside leaves more
    _, slow = searched(detector, measured(seed=4) + slow_discrepancy(0.08))
    assert 1.0 < slow.share < POLICY.dispersed
    assert slow.lasting > 0.5 * (slow.left - slow.measured)
    assert slow.least(POLICY) == 0.5 * slow.lasting > 36.0 * slow.share


def test_what_a_cause_explains_does_not_raise_thresholds():
    detector = small_case.made_detector()
    found, own = searched(detector, measured("heat", "housing", 200.0, seed=3))
    assert found.accepted[0].hypothesis.name == "housing"
    assert own.share < POLICY.dispersed
    assert found.detector.thresholds == detector.thresholds


@pytest.mark.long
def test_nothing_is_named_in_a_model_that_is_wrong_in_its_form():
    detector, y = small_case.made_detector(), measured(seed=4) + slow_discrepancy(0.3)
    found, own = searched(detector, y)
    assert own.share > POLICY.dispersed
    assert verdict_of(found, FAMILIES) == ("too_poor", ())
    grown = raised(detector, own)
    assert grown.least == 0.5 * own.beside > 36.0
    assert all(threshold >= grown.least for threshold in grown.thresholds.values())
    before, after = limits_at(detector), limits_at(grown)
    assert all(after[place] >= size for place, size in before.items())
    assert np.median([after[p] / before[p] for p in before if np.isfinite(before[p])]) > 2.5


@pytest.mark.long
def test_slow_errors_of_channels_are_not_held_against_a_cause():
    """Heat at twice its limit is named, which is far from enough to explain more than all that such a model leaves."""
    detector, form = small_case.made_detector(), slow_discrepancy(0.3)
    _, own = searched(detector, measured(seed=4) + form)
    place = ("heat_source", "W", "housing", False)
    limit = limits_at(raised(detector, own))[place]
    assert limit < 0.6 * limits_at(replace(detector, thresholds=dict.fromkeys(detector.thresholds, own.left)))[place]
    found, own = searched(detector, measured("heat", "housing", 2.0 * limit, seed=4) + form)
    assert own.share > POLICY.dispersed
    assert [(a.hypothesis.family, a.hypothesis.name) for a in found.accepted] == [("heat_source", "housing")]
    assert verdict_of(found, FAMILIES)[0] == "named"


@pytest.mark.slow
def test_what_is_left_beyond_noise_must_be_explained_by_less_than_a_cause():
    detector = small_case.made_detector()
    found, own = searched(detector, measured(seed=4) + slow_discrepancy(0.07))
    assert 1.3 < own.share < POLICY.dispersed
    assert verdict_of(found, FAMILIES)[0] != "too_poor"
    least = 0.5 * own.lasting
    assert found.detector.least == least > 36.0
    assert 0.5 * (own.left - own.measured) < own.lasting <= own.left - own.measured
    assert min(found.detector.thresholds.values()) == pytest.approx(max(least, min(detector.thresholds.values())))
    named, same = searched(detector, measured("heat", "housing", 400.0, seed=3) + slow_discrepancy(0.07))
    assert same.share < POLICY.dispersed
    assert [a.hypothesis.name for a in named.accepted] == ["housing"]


def test_where_the_fit_bends_parameters_others_score_little_at_the_description():
    """Heat that a fit without it makes parameters imitate, from where others look half as good."""
    start = begun(small_case.made_detector(), measured("heat", "housing", 400.0, seed=3))
    assert np.abs(start.fitted.x).max() > POLICY.bends
    lead, *others = start.scored[1]
    assert max(h.statistic for h in others) > 0.5 * lead.statistic
    lead, *others = start.glance[1]
    assert (lead.family, lead.name, lead.when.name) == ("heat_source", "housing", "always")
    assert max(h.statistic for h in others) < 0.35 * lead.statistic


@pytest.mark.parametrize(("size", "bent"), [(0.0, False), (2000.0, True)])
def test_what_better_parameters_remove_is_no_causes(size, bent):
    """Where a fit is bent, the description says that another can leave less; else both say the same."""
    detector = small_case.made_detector()
    fitted = detector.fitter(measured("heat", "housing", size, seed=3))
    left = float(misfit_of_each(detector, fitted).sum())
    assert (np.abs(fitted.x).max() > POLICY.bends) == bent
    assert misfit(detector, fitted) == min(left, fitted.reachable)
    assert (fitted.reachable < 0.8 * left) if bent else (fitted.reachable == pytest.approx(left, rel=0.1))


@pytest.mark.long
def test_a_cause_that_explains_more_than_all_that_is_left_is_named_all_the_same():
    y = measured("heat", "housing", 400.0, seed=3) + slow_discrepancy(0.12)
    found, own = searched(small_case.made_detector(), y)
    assert own.share > POLICY.dispersed
    assert [(a.hypothesis.family, a.hypothesis.name) for a in found.accepted] == [("heat_source", "housing")]


def test_where_more_is_left_the_first_search_stands_or_falls_and_nothing_is_fitted_twice(monkeypatch):
    """Of one that still explains enough the causes stay; what no longer does is not named."""
    detector, module = small_case.made_detector(), sys.modules[search.__module__]
    y = measured("heat", "housing", 200.0, seed=3)
    start = begun(detector, y)
    first = search(detector, y, start)
    (one,) = first.accepted
    with monkeypatch.context() as patched:
        patched.setattr(module, "refit", None)
        same = search_again(detector, y, start, first, 0.9 * one.statistic)
    (still,) = same.accepted
    assert (still.hypothesis, still.statistic) == (one.hypothesis, one.statistic)
    assert one.threshold < still.threshold == 0.9 * one.statistic
    assert same.detector.least == 0.9 * one.statistic <= min(same.detector.thresholds.values())
    assert not search_again(detector, y, start, first, 1.5 * one.statistic).accepted


def test_a_declared_number_is_freed_once(monkeypatch):
    detector, (_, y) = small_case.made_detector(), small_case.source_off(4.5)
    start = begun(detector, y)
    first = search(detector, y, start)
    assert first.loose
    assert [a.hypothesis.family for a in first.accepted] == ["loss_law"]
    for by, made in ((loose_ones, "settled_alone"), (strained, "refit")):
        monkeypatch.setattr(sys.modules[by.__module__], made, None)
    again = search_again(detector, y, start, first, 0.5 * first.accepted[0].statistic)
    assert verdict_of(again, FAMILIES)[0] == verdict_of(first, FAMILIES)[0] == "out_of_tolerance"

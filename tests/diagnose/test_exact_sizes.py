"""Causes that are not in proportion to their size come out at their size: clocks, plays, films many times as strong."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.faults.acted import slots_with, units_of
from twin.diagnose.faults.catalogue import FAMILIES
from twin.diagnose.faults.readings import late
from twin.diagnose.faults.sensor_readings import elsewhere
from twin.diagnose.model.study import Planned
from twin.diagnose.search.accepted import Accepted, curved_change, freed, motion, parameter_of
from twin.diagnose.search.exact import exact
from twin.diagnose.search.forward import search
from twin.diagnose.search.gain import channels_of, gains
from twin.diagnose.search.look import sized_candidates
from twin.diagnose.search.policy import POLICY
from twin.diagnose.search.refit import refit
from twin.diagnose.search.verdict import verdict_of

pytestmark = pytest.mark.long


def noise(seed):
    """(m,) of sensors and TCP."""
    study, rng = small_case.study(), np.random.default_rng(seed)
    parts = []
    for k in study.fitted:
        (b, s), (rows, _) = study.runs[k].shapes
        sigma = np.concatenate([np.full(b * s, small_case.NOISE / np.sqrt(5)), np.full(rows * 3, 3e-7)])
        parts.append(sigma * rng.standard_normal(len(sigma)))
    return np.concatenate(parts)


def clean(x=None):
    """(m,) of the fitted runs."""
    study = small_case.study()
    x = np.zeros(len(study.probed.parameters)) if x is None else x
    return np.concatenate([study.outputs(k, x) for k in study.fitted])


def read(sensor: str, shown: Callable[[np.ndarray, Planned], np.ndarray]) -> np.ndarray:
    """(m,) measurements of a machine off by half its tolerances, where a sensor shows something else than its place."""
    study = small_case.study()
    (body,) = study.probed.base.bodies
    x = 0.5 * np.random.default_rng(11).standard_normal(len(study.probed.parameters))
    y, first = clean(x) + noise(11), 0
    for k in study.fitted:
        plan = study.runs[k]
        (b, s), _ = plan.shapes
        i = plan.measured.sensors.index(sensor)
        T = study.states(k, x) @ body.C[plan.measured.column[i]]
        y[first : first + b * s].reshape(b, s)[:, i] += plan.measured.mean_of @ (shown(T, plan) - T)
        first += plan.size
    return y


def following(seconds: float) -> Callable[[np.ndarray, Planned], np.ndarray]:
    """What a sensor shows that follows its place with this time constant [s]; steps of a minute."""

    def shown(T: np.ndarray, _: Planned) -> np.ndarray:
        result, keep = T.copy(), np.exp(-60.0 / seconds)
        for j in range(1, len(T)):
            result[j] = keep * result[j - 1] + (1.0 - keep) * T[j]
        return result

    return shown


def test_a_late_clock_reads_what_was_there_before():
    study = small_case.study()
    k = study.fitted[0]
    x = np.zeros(len(study.probed.parameters))
    whole = late(study, {k: study.states(k, x)}, 600.0) * 600.0
    T = study.runs[k].split(clean()[: study.runs[k].size])[0]
    moved = study.runs[k].split(whole[: study.runs[k].size])[0]
    bins = round(600.0 / float(np.diff(study.runs[k].measured.bin_time)[0]))
    np.testing.assert_allclose((T + moved)[bins + 1 : -1], T[1 : -bins - 1], atol=1e-6)  # the last bin is a half one
    assert not whole[study.runs[k].size :].any()


@pytest.mark.parametrize("seconds", [-60.0, 90.0])
def test_a_clock_is_found_at_its_size(seconds):
    study = small_case.study()
    k = study.fitted[1]
    x = 0.5 * np.random.default_rng(8).standard_normal(len(study.probed.parameters))
    y = clean(x) + seconds * late(study, {k: study.states(k, x)}, seconds) + noise(8)
    verdict, causes = verdict_of(search(small_case.made_detector(), y), FAMILIES)
    assert (verdict, causes[0].history) == ("signal", "clock")
    assert causes[0].place == f"runs.{study.runs[k].run.name}"
    assert causes[0].amplitude == pytest.approx(seconds, rel=0.08)


@pytest.mark.parametrize("share", [0.3, 0.7])
def test_a_play_is_found_at_its_width(share):
    """Made of the displacements alone, row by row: none of the model's own play."""
    study, y = small_case.study(), clean()
    first, total = 0, 0.0
    for k in study.fitted:
        (b, s), shape = study.runs[k].shapes
        own = y[first + b * s : first + study.runs[k].size].reshape(shape)
        total = max(total, float(np.ptp(own[:, 2])))
        first += study.runs[k].size
    width, first = share * total, 0
    for k in study.fitted:
        (b, s), shape = study.runs[k].shapes
        own, held = y[first + b * s : first + study.runs[k].size].reshape(shape), 0.0
        for i, value in enumerate(own[:, 2].copy()):
            held = min(max(held, value - width / 2), value + width / 2)
            own[i, 2] = held
        first += study.runs[k].size
    detector = small_case.made_detector()
    fitted = detector.fitter(y)
    white = detector.whiten(fitted.residual)
    best = max(
        (h for h in sized_candidates(detector, fitted.projector, white) if h.name == "tcp.dz"),
        key=lambda h: h.statistic,
    )
    assert best.statistic > 36.0
    found = exact(detector, y, fitted, best)
    assert found.statistic >= 0.99 * best.statistic
    assert found.amplitude[0] == pytest.approx(width, rel=0.25)


def test_a_film_many_times_as_strong_takes_its_parameter_along():
    """Eight times the film of the structure: far beyond the bounds of the parameter, and told as one number."""
    study = small_case.study()
    j = next(i for i, p in enumerate(study.probed.parameters) if p.path == "films.air.gain")
    x = np.zeros(len(study.probed.parameters))
    x[j] = np.log(8.0) / study.scale[j]
    found = search(small_case.made_detector(), clean(x) + noise(9))
    verdict, causes = verdict_of(found, FAMILIES)
    assert verdict == "out_of_tolerance"
    place = study.probed.parameters[j].path.removesuffix(".gain")
    assert (causes[0].family, causes[0].place) == ("film_gain", place)
    low, high = causes[0].ci95
    assert low < 8.0 < high
    (one,) = found.accepted
    assert freed(study, one.hypothesis) == [j] == [parameter_of(study, place)]
    assert found.x[j] == pytest.approx(0.0, abs=1e-9)


def test_a_contact_that_never_was_takes_its_parameter_along():
    """A tenth of a joint's conductance: calibration alone bends everything else."""
    study = small_case.study()
    j = parameter_of(study, "contacts.front_outer")
    x = np.zeros(len(study.probed.parameters))
    x[j] = np.log(0.1) / study.scale[j]
    verdict, causes = verdict_of(search(small_case.made_detector(), clean(x) + noise(9)), FAMILIES)
    place = study.probed.parameters[j].path.removesuffix(".total")
    assert (verdict, causes[0].family, causes[0].place) == ("out_of_tolerance", "joint", place)
    low, high = causes[0].ci95
    assert low < 0.1 < high


@pytest.mark.parametrize(
    ("source", "factor", "verdict", "rival"),
    [
        ("nut", 2.0, "ambiguous", ("signals.x_speed", 2.0)),  # friction: in proportion to the speed
        ("motor", 3.0, "ambiguous", ("signals.spindle_current", 1.73205)),  # copper: to the current squared
        ("motor", 0.3, "ambiguous", ("signals.spindle_current", 0.57735)),
        ("front", 3.0, "out_of_tolerance", ()),  # three sources read that speed: it would have warmed all
    ],
)
def test_a_wrong_factor_of_the_one_signal_that_a_source_reads_is_its_rival(source, factor, verdict, rival):
    study = small_case.study()
    j = parameter_of(study, f"sources.{source}")
    x = np.zeros(len(study.probed.parameters))
    x[j] = np.log(factor) / study.scale[j]
    said, causes = verdict_of(search(small_case.made_detector(), clean(x) + noise(5)), FAMILIES)
    assert (said, causes[0].family, causes[0].place) == (verdict, "loss_law", f"sources.{source}")
    assert causes[0].amplitude == pytest.approx(factor, rel=0.1)
    rivals = {(r.place, r.amplitude): r.remedy for r in causes[0].rivals}
    assert (rival in rivals) == bool(rival)
    assert all("instrument" in remedy for remedy in rivals.values())


@pytest.mark.parametrize("film", [50.0, pytest.param(200.0, marks=pytest.mark.slow)])
def test_a_liquid_is_found_with_its_film_and_its_temperature_while_the_air_drifts(film):
    study, degrees = small_case.study(), 12.0
    probed, k = study.probed, study.fitted[0]
    p = [q.name for q in probed.places].index("housing")
    slots = study.slots(k)
    n = len(slots.gate)
    slots.A[0], slots.M[0] = probed.A[p], probed.M[p]
    slots.gate[n // 4 : 3 * n // 4, 0] = 1.0  # for two hours
    slots.rise[:, 0] = degrees - probed.base.reference_temperature
    x = 0.5 * np.random.default_rng(9).standard_normal(len(study.probed.parameters))
    wet = study.outputs(k, x, slots, (film,)) - study.outputs(k, x)
    verdict, causes = verdict_of(
        search(small_case.made_detector(), clean(x) + np.pad(wet, (0, len(clean()) - len(wet))) + noise(9)), FAMILIES
    )
    assert (verdict, causes[0].family, causes[0].place) == ("named", "coolant", "housing")
    low, high = causes[0].ci95
    assert low < film < high < 2.0 * film
    sigma = causes[0].settings["temperature_sigma"]
    assert 0.0 < sigma < 1.5
    assert causes[0].settings["temperature"] == pytest.approx(degrees, abs=3.0 * sigma)


@pytest.mark.parametrize("seconds", [900.0, 2400.0])
def test_a_sensor_that_follows_late_is_found_with_its_time_constant(seconds):
    y = read("front", following(seconds))
    verdict, causes = verdict_of(search(small_case.made_detector(), y), FAMILIES)
    assert (verdict, causes[0].place, causes[0].history) == ("sensor", "sensors.front", "lag")
    assert causes[0].amplitude == pytest.approx(seconds, rel=0.1)


def test_a_joint_that_conducts_nothing_any_more_keeps_its_evidence():
    """The time integration holds conductances at two hundredths: beyond, no derivative was left, and the cause was
    dropped.
    """
    study, detector = small_case.study(), small_case.made_detector()
    batch = next(b for b in detector.columns.batches if b.kind == "joint")
    when = next(w for w in batch.histories if w.windows and w.windows[0].run == "run_0" and w.windows[0].start > 3000.0)
    h = Hypothesis(batch, list(batch.places).index("contacts.shrink_fit"), when, 100.0, (-0.95,))
    units, x = units_of(study, h), np.zeros(len(study.probed.parameters))
    y = noise(12)
    y += np.concatenate(
        [study.outputs(k, x, slots_with(study, detector.elements, units, k), [-0.98]) for k in study.fitted]
    )
    _, (found,) = refit(detector, y, x, [Accepted(h, units, np.array([-0.95]), np.eye(1), 100.0, 36.0, ())])
    assert -0.98 < found.amplitude[0] < -0.9  # nearly all of it, and short of where it is held
    assert 0.0 < found.covariance[0, 0] < 0.1


def test_sizes_scored_together_are_scored_as_each_alone():
    detector, study = small_case.made_detector(), small_case.study()
    k, x = study.fitted[0], np.zeros(len(study.probed.parameters))
    fitted = detector.fitter(clean() + 300.0 * late(study, {k: study.states(k, x)}, 300.0) + noise(12))
    white = detector.whiten(fitted.residual)
    found = sized_candidates(detector, fitted.projector, white)
    assert found
    for h in found:
        change = detector.whiten(curved_change(detector, h, h.amplitude[0], motion(detector, None)))
        P = fitted.projector(change)
        assert h.statistic == pytest.approx(float(P @ (2.0 * white - change)), rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("early", [75.0, 80.0])
def test_what_comes_early_in_every_run_is_no_clock(early):
    """A log's clock is off in its own run; the same in all is how fast a part or its sensor responds."""
    study = small_case.study()
    x = 0.5 * np.random.default_rng(8).standard_normal(len(study.probed.parameters))
    y = clean(x) + noise(8)
    for k in study.fitted:
        y -= early * late(study, {k: study.states(k, x)}, -early)
    _, causes = verdict_of(search(small_case.made_detector(), y), FAMILIES)
    assert "clock" not in [c.history for c in causes]


def test_a_sensor_on_another_node_is_named_and_predicts_the_sealed_run():
    """With films, losses and joints half a tolerance off, which what it shows moves with."""
    study = small_case.study()
    x = 0.5 * np.random.default_rng(4).standard_normal(len(study.probed.parameters))
    y = clean(x) + noise(4) + elsewhere(study, lambda k: study.states(k, x), "housing", "bearing_front")
    found = search(small_case.made_detector(), y)
    verdict, (cause,) = verdict_of(found, FAMILIES)
    assert (verdict, cause.place, cause.history) == ("sensor", "sensors.housing", "mounted on another part")
    assert cause.settings == {"mounted": "bearing_front"}
    assert cause.ci95[0] < 1.0 < cause.ci95[1]
    sealed = study.runs[2].measured
    T, w = study.runs[2].split(study.outputs(2, x))
    T = T.copy()  # what JAX gives cannot be written to
    T[:, sealed.sensors.index("housing")] = T[:, sealed.sensors.index("front")]
    T = T + small_case.NOISE / np.sqrt(5) * np.random.default_rng(5).standard_normal(T.shape)
    channels = channels_of(
        found, 2, replace(sealed, temperature=T, tcp=w), (np.full(T.shape[1], 0.05), np.full(3, 3e-7))
    )
    table = {g.channel: g for g in gains(channels, 1, POLICY)}
    assert table["housing"].affected
    assert table["housing"].extended < 0.2 * table["housing"].recalibrated


def test_swapped_sensors_are_swapped_back_on_the_sealed_run():
    study = small_case.study()
    x = 0.5 * np.random.default_rng(4).standard_normal(len(study.probed.parameters))
    y, first = clean(x) + noise(4), 0
    for k in study.fitted:
        (b, s), _ = study.runs[k].shapes
        T = y[first : first + b * s].reshape(b, s)
        T[:, [0, 1]] = T[:, [1, 0]]
        first += study.runs[k].size
    found = search(small_case.made_detector(), y)
    assert [a.hypothesis.batch.kind for a in found.accepted] == ["swapped"]
    sealed = study.runs[2].measured
    T, w = study.runs[2].split(study.outputs(2, x))
    T = T + small_case.NOISE / np.sqrt(5) * np.random.default_rng(5).standard_normal(T.shape)
    sealed = replace(sealed, temperature=T[:, [1, 0, *range(2, T.shape[1])]], tcp=w)
    channels = channels_of(found, 2, sealed, (np.full(T.shape[1], 0.05), np.full(3, 3e-7)))
    table = {g.channel: g for g in gains(channels, 1, POLICY)}
    for name in sealed.sensors[:2]:
        assert table[name].affected
        assert table[name].extended < 0.2 * table[name].recalibrated

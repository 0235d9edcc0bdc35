"""Heat of any history, in blocks of five minutes: where it enters, how much, and that noise is none."""

from __future__ import annotations

import sys
from types import SimpleNamespace

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.diagnose.evidence.any_history import AnyHistory, any_history
from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.evidence.whiten import Projector
from twin.diagnose.faults.catalogue import FAMILIES
from twin.diagnose.search.any_heat import Entering, _responses, entering, heat_blocks, step_of
from twin.diagnose.search.detector import Detector
from twin.diagnose.search.dispersion import _explains_more, searched
from twin.diagnose.search.forward import _may_cover
from twin.diagnose.search.look import look
from twin.diagnose.search.policy import POLICY
from twin.diagnose.search.verdict import unknown_of, verdict_of


def switched(detector: Detector, watts: float, places: tuple[str, ...]) -> tuple[np.ndarray, list[list[np.ndarray]]]:
    """Measurements (m,) of heat that goes on and off at random at places, and its history (n,) in every run."""
    study, rng = detector.study, np.random.default_rng(3)
    histories = []
    for k in study.fitted:
        run = study.runs[k].run
        edges = [np.cumsum(rng.exponential(1500.0, 60) + 600.0) for _ in places]
        histories.append([watts * (np.searchsorted(e, run.drive.time[:-1]) % 2) for e in edges])
    outputs = []
    for k, own in zip(study.fitted, histories, strict=True):
        slots = study.slots(k)
        for s, (place, history) in enumerate(zip(places, own, strict=True)):
            p = [spot.name for spot in study.probed.places].index(place)
            slots.forcing[:, s] = history[:, None] * study.probed.B[p]
        outputs.append(study.outputs(k, np.zeros(len(study.scale)), slots, [1.0] * len(places)))
    y = np.concatenate(outputs)
    return y + detector.whiten.colour(np.random.default_rng(5).standard_normal(len(y))), histories


def watts(detector: Detector, histories: list[list[np.ndarray]]) -> np.ndarray:
    """(b,) of the first place, in blocks."""
    return np.array([histories[i][0][a:b].mean() for i, a, b in heat_blocks(detector.study)])


@pytest.mark.long
@pytest.mark.parametrize("places", [("slide",), ("housing", "slide")])
def test_heat_that_switches_at_random_is_unknown_and_told_with_its_watts(places):
    """Blocks of an hour follow less than half of it: the model was too poor then."""
    detector = small_case.made_detector()
    y, histories = switched(detector, 60.0, places)
    found, left = searched(detector, y)
    assert verdict_of(found, FAMILIES) == ("unknown", ())
    assert left.share < detector.policy.dispersed
    assert {own.surface for own in found.entering} == set(places)
    unknown = unknown_of(found)
    assert unknown is not None
    assert {unknown.surface, *unknown.besides} == set(places)
    heat = np.concatenate([W for _, W, _ in unknown.history.values()])
    sigma = np.concatenate([s for _, _, s in unknown.history.values()])
    if len(places) == 1:  # two of so many tolerances bend the calibration, which then takes some of the mean
        assert np.corrcoef(heat, watts(detector, histories))[0, 1] > 0.7
        assert np.mean(np.abs(heat - watts(detector, histories)) < 2.0 * sigma) > 0.8


@pytest.mark.long
def test_a_second_place_may_have_little_of_the_heat():
    """A twentieth of what the first one has, and far more than noise: the model was too poor without it."""
    detector = small_case.made_detector()
    study, rng, outputs = detector.study, np.random.default_rng(3), []
    names = [spot.name for spot in study.probed.places]
    for k in study.fitted:
        slots, time = study.slots(k), study.runs[k].run.drive.time[:-1]
        for s, (place, size) in enumerate((("stator", 200.0), ("slide", 30.0))):
            on = np.searchsorted(np.cumsum(rng.exponential(1500.0, 60) + 600.0), time) % 2
            slots.forcing[:, s] = size * on[:, None] * study.probed.B[names.index(place)]
        outputs.append(study.outputs(k, np.zeros(len(study.scale)), slots, [1.0, 1.0]))
    y = np.concatenate(outputs)
    y = y + detector.whiten.colour(np.random.default_rng(5).standard_normal(len(y)))
    found, left = searched(detector, y)
    assert verdict_of(found, FAMILIES) == ("unknown", ())
    assert [own.surface for own in found.entering] == ["stator", "slide"]
    assert left.share < 1.5


@pytest.mark.long
def test_what_switches_at_a_light_part_begins_in_the_hours_of_its_heat():
    """From the windows of full hours alone it ends as unknown."""
    detector, hours = small_case.made_detector(), ((1.3, 2.4), (0.6, 3.1))
    study, outputs = detector.study, []
    place = [spot.name for spot in study.probed.places].index("stator")
    for k, (first, end) in zip(study.fitted, hours, strict=True):
        slots, time = study.slots(k), study.runs[k].run.drive.time[:-1]
        on = (time >= 3600.0 * first) & (time < 3600.0 * end)
        slots.forcing[:, 0] = 60.0 * on[:, None] * study.probed.B[place]
        outputs.append(study.outputs(k, np.zeros(len(study.scale)), slots, [1.0]))
    y = np.concatenate(outputs)
    y = y + detector.whiten.colour(np.random.default_rng(5).standard_normal(len(y)))
    verdict, (cause,) = verdict_of(searched(detector, y)[0], FAMILIES)
    assert (verdict, cause.family, cause.place) == ("named", "heat_source", "stator")
    assert cause.amplitude == pytest.approx(60.0, rel=0.1)
    for w, (first, end) in zip(cause.windows, hours, strict=True):
        assert (w.start, w.end) == pytest.approx((3600.0 * first, 3600.0 * end), abs=600.0)


@pytest.mark.long
def test_noise_is_no_heat_of_any_history():
    detector = small_case.made_detector()
    study, rng = detector.study, np.random.default_rng(8)
    D = _responses(detector, ["bed"])("bed")
    blocks = [(i, (a + b) / 2.0 * study.fitted_runs[i][1]) for i, a, b in heat_blocks(study)]
    projector = Projector.of(detector.fitter.others)
    evidence = [any_history(D, blocks, projector, rng.standard_normal(len(D))).evidence for _ in range(20)]
    assert np.median(evidence) == 0.0
    assert max(evidence) < 10.0
    y = study.all_outputs(np.zeros(len(study.scale)))
    fitted = detector.fitter(y)
    seen, _, step = look(detector, fitted)
    assert entering(detector, y, fitted, seen, step.parts) == ()


@pytest.mark.parametrize(("first", "end", "size"), [(18, 43, 10.0), (18, 43, -3.0), (0, 20, 3.0), (50, 72, 5.0)])
def test_the_step_is_found_beside_what_drifts(first, end, size):
    heat = 4.0 - 0.2 * np.arange(72) + 0.3 * np.random.default_rng(1).standard_normal(72)
    heat[first:end] += size
    assert step_of(heat) == (first, end)


def test_of_two_halves_the_one_with_more_heat_is_that_of_the_step():
    assert step_of(np.repeat([-3.0, 0.0], [20, 52])) == (20, 72)


def test_what_acts_in_hours_is_refitted_only_where_it_may_explain_such_heat():
    detector = small_case.made_detector()
    batch = next(b for b in detector.columns.batches if b.family == "heat_source")
    always = next(h for h in batch.histories if not h.windows and not h.signal)
    hours = next(h for h in batch.histories if h.windows)
    told = AnyHistory(1000.0, np.zeros(0), np.zeros(0), np.zeros((0, 0)))
    heat = (Entering("housing", "housing", told, told.evidence),)

    def may(when, *statistics: float, beside=heat) -> bool:
        return _may_cover([Hypothesis(batch, 0, when, s, (1.0,)) for s in statistics], beside, POLICY)

    assert may(always, 50.0)
    assert may(hours, 50.0, beside=())
    assert not may(hours, 50.0, 100.0)
    assert may(hours, 50.0, 900.0)  # of one of its starts


@pytest.mark.parametrize(
    ("left", "by_hour", "more"), [((), 0.0, True), ((60.0,), 0.0, False), ((), 60.0, False), ((20.0,), 20.0, True)]
)
def test_heat_alone_is_held_against_what_is_named_and_the_heat_that_this_leaves(monkeypatch, left, by_hour, more):
    """Of a freed number that is told by the hour alone."""

    def heat(evidence: float) -> Entering:
        return Entering("bed", "bed", AnyHistory(evidence, np.zeros(0), np.zeros(0), np.zeros((0, 0))), evidence)

    monkeypatch.setattr(sys.modules[searched.__module__], "misfit", lambda _, fitted: fitted)
    start = SimpleNamespace(detector=SimpleNamespace(policy=POLICY), fitted=1000.0)
    parts = {"bed": by_hour} if by_hour else {}
    found = SimpleNamespace(fitted=150.0, entering=tuple(map(heat, left)), steps=[SimpleNamespace(parts=parts)])
    assert _explains_more((heat(900.0),), start, found) == more
    assert not _explains_more((), start, found)

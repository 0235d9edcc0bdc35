"""What a cause leaves is no second one; what switches too often has no name; a number that something else seen
explains better is not out of its tolerance."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from tests.diagnose import small_case
from tests.diagnose.test_search import measured
from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.evidence.pulls import Loose
from twin.diagnose.faults.acted import units_of
from twin.diagnose.faults.catalogue import FAMILIES
from twin.diagnose.faults.table import fault_of
from twin.diagnose.result.diagnosis import Window
from twin.diagnose.result.spot import Spot
from twin.diagnose.search.accepted import Accepted, as_scored, misfits, possible
from twin.diagnose.search.companions import limits_beside
from twin.diagnose.search.contest import bent
from twin.diagnose.search.detector import Detector
from twin.diagnose.search.forward import _leaking, _restless, refit, search
from twin.diagnose.search.look import Search
from twin.diagnose.search.loose import Freed, loose_ones, untied
from twin.diagnose.search.start import begun
from twin.diagnose.search.strained import _weak, closed, strained
from twin.diagnose.search.verdict import verdict_of

pytestmark = pytest.mark.long


def in_windows(n: int) -> Accepted:
    """Heat that switches n times."""
    detector = small_case.made_detector()
    batch = next(b for b in detector.columns.batches if b.kind == "heat" and b.family == "heat_source")
    at = next(k for k, when in enumerate(batch.histories) if when.windows)
    windows = tuple(Window("run_0", 3600.0 * k, 3600.0 * k + 1800.0) for k in range(n))
    h = Hypothesis(batch, 0, replace(batch.histories[at], windows=windows), 100.0, (10.0,))
    return Accepted(h, units_of(detector.study, h), np.array([10.0]), np.eye(1), 100.0, 36.0, ())


@pytest.mark.parametrize(("windows", "left", "restless"), [(4, 2.0, 1), (4, 0.3, 0), (1, 5.0, 0)])
def test_what_switches_often_must_leave_nothing_anywhere(windows, left, restless):
    detector = small_case.made_detector()
    accepted = [in_windows(windows)]
    assert len(_restless(detector, accepted, {"elsewhere": left * detector.thresholds["unknown"]})) == restless
    strong = [replace(accepted[0], statistic=1e5 * detector.thresholds["unknown"])]  # whose misfits they may be
    assert not _restless(detector, strong, {"elsewhere": left * detector.thresholds["unknown"]})


def test_one_window_may_leave_no_heat_but_a_strong_ones_misfits():
    detector = small_case.made_detector()
    detector = replace(detector, thresholds={**detector.thresholds, "unknown": 36.0})
    amounts = np.geomspace(0.01, 1e6, 400)

    def allowed(statistic: float, kind: str = "heat", factor: float = 1.0) -> float:
        """The most heat that one window may leave."""
        one = replace(in_windows(1), statistic=statistic)
        one = replace(one, hypothesis=replace(one.hypothesis, batch=replace(one.hypothesis.batch, kind=kind)))
        of = replace(detector, thresholds={**detector.thresholds, "unknown": factor * 36.0})
        return max(left for left in amounts if not _leaking(of, [one], {"elsewhere": left}))

    weak, strong = allowed(100.0), allowed(1e5)
    assert 0.2 * 36.0 < weak < 36.0  # less than what would be named
    assert allowed(100.0, factor=2.0) == pytest.approx(2.0 * weak, rel=0.1)
    assert 0.001 * 1e5 < strong < 0.02 * 1e5
    assert allowed(3e5) == pytest.approx(3.0 * strong, rel=0.1)
    assert allowed(1e5, "coolant") > 1.2 * strong  # whose film is known less
    assert allowed(100.0, "coolant") == weak
    one = in_windows(1)
    always = replace(one, hypothesis=replace(one.hypothesis, when=replace(one.hypothesis.when, windows=())))
    assert not _leaking(detector, [always], {"elsewhere": amounts[-1]})


@pytest.mark.parametrize(
    ("watts", "leave"), [(60.0, True), (60.0, False), pytest.param(300.0, False, marks=pytest.mark.slow)]
)
def test_heat_that_goes_down_by_steps_is_no_window(watts, leave, monkeypatch):
    """It is named as one only where windows may leave what they like."""
    if leave:
        monkeypatch.setattr(sys.modules[search.__module__], "_leaking", lambda *_: [])
    found = search(small_case.made_detector(), measured("heat", "housing", watts, 3, (0.0, 1.0, 0.3, 0.3)))
    assert bool(found.accepted) == leave
    assert (verdict_of(found, FAMILIES)[0] == "unknown") != leave


@pytest.mark.parametrize(("share", "verdict"), [(0.3, "named"), (0.5, "unknown")])
def test_what_calibration_had_imitated_is_no_small_part_of_what_is_left(share, verdict):
    """What is left counts against what the cause explains, also where a fit without it leaves little heat."""
    found = search(small_case.made_detector(), measured("heat", "housing", 400.0, seed=3))
    left = {"housing": share * found.accepted[0].statistic}
    steps = tuple(replace(step, parts=left) for step in found.steps)
    assert min(left.values()) > found.detector.thresholds["unknown"]
    assert verdict_of(replace(found, steps=steps), FAMILIES)[0] == verdict


def test_a_second_cause_explains_more_than_the_first_ones_misfits(monkeypatch):
    study, y = small_case.study(), measured("heat", "housing", 400.0, seed=3)
    first = 0
    for k in study.fitted:
        (b, s), _ = study.runs[k].shapes
        y[first : first + b * s].reshape(b, s)[:, 1] += study.runs[k].measured.bin_time * 2.0 / 14400.0
        first += study.runs[k].size
    both = search(small_case.made_detector(), y).accepted
    assert {a.hypothesis.family for a in both} == {"heat_source", "sensor"}

    def families(times: float) -> list[str]:
        """Those named where the first cause is taken for so many times as strong."""

        def stronger(*arguments):
            fitted, accepted = refit(*arguments)
            return fitted, [replace(a, statistic=(times if a.units else 1.0) * a.statistic) for a in accepted]

        monkeypatch.setattr(sys.modules[search.__module__], "refit", stronger)
        return [a.hypothesis.family for a in search(small_case.made_detector(), y).accepted]

    assert families(10.0) == ["heat_source", "sensor"]
    assert families(1000.0) == ["heat_source"]


def test_what_is_named_beside_another_cause_is_well_above_its_threshold():
    detector = small_case.made_detector()
    h = in_windows(1).hypothesis

    def weak(times: float, misfits: float = 0.0) -> bool:
        return _weak(detector, [replace(h, statistic=times * detector.thresholds[h.family])], misfits)

    assert weak(1.3)
    assert not weak(10.0)
    assert weak(10.0, misfits=11.0 * detector.thresholds[h.family])  # of the other one


@pytest.mark.parametrize("stays", [True, False])
def test_a_number_is_not_out_of_tolerance_where_something_seen_explains_more(stays, monkeypatch):
    """Also where that is too weak to be named beside another cause."""
    detector = small_case.made_detector()
    _, y = small_case.source_off(4.5)
    start = begun(detector, y)
    seen, ranked, step = start.glance
    relaxed = strained(start, y)
    assert relaxed is not None
    module = sys.modules[closed.__module__]
    monkeypatch.setattr(module, "misfit", lambda *_: 0.0)  # the number itself removes nothing of what was left
    monkeypatch.setattr(module, "_stays", lambda *_: stays)
    other = next(h for h in ranked if h.family not in ("loss_law", "signal"))
    alarm = replace(other, statistic=1.3 * detector.thresholds[other.family])
    ended = closed(replace(start, glance=(seen, [alarm], step)), y, relaxed)
    assert (ended is not None) == stays
    chance = float(np.quantile(detector.nulls[other.family], 0.97))
    for statistic, told in ((0.5 * (chance + detector.thresholds[other.family]), not stays), (0.9 * chance, False)):
        quiet = replace(other, statistic=statistic)  # too weak to be named
        ended = closed(replace(start, glance=(seen, [quiet], step)), y, relaxed)
        assert ended is not None
        rivals = {h.name for h, _ in ended.accepted[0].rivals}
        assert (other.name in rivals) == told


def relaxed_source() -> tuple[Detector, list[Hypothesis], Callable[[list[Hypothesis]], Search | None]]:
    """A source 4.5 tolerances off: the detector, all hypotheses there, and what `closed` says of those that it is
    given."""
    detector = small_case.made_detector()
    _, y = small_case.source_off(4.5)
    start = replace(begun(detector, y), declared=[])
    seen, ranked, step = start.scored
    relaxed = strained(start, y)
    assert relaxed is not None
    return detector, ranked, lambda some: closed(replace(start, glance=(seen, some, step)), y, relaxed)


def test_what_bends_is_no_rival_by_its_score_alone(monkeypatch):
    """A joint in windows scores by its derivative, and removes next to nothing when it is refitted."""
    detector, ranked, ended = relaxed_source()
    module = sys.modules[closed.__module__]
    monkeypatch.setattr(module, "_stays", lambda *_: False)
    monkeypatch.setattr(module, "exact", lambda d, y, f, h: replace(h, statistic=0.0))
    joint = next(h for h in ranked if bent(detector, h))
    straight = next(h for h in ranked if not bent(detector, h) and h.family not in ("loss_law", "signal"))
    many = 1e9
    scored = replace(joint, statistic=many)
    assert ended([scored]) is not None
    scored = replace(straight, statistic=many)
    assert ended([scored]) is None


def test_another_cause_at_the_place_of_a_number_is_its_rival_by_what_it_removes(monkeypatch):
    """Motion that cools a film is more of that film, or less: where it removes as much but for chance, and of a number
    that removes little at least half of that."""
    _, ranked, ended = relaxed_source()
    module = sys.modules[closed.__module__]
    monkeypatch.setattr(module, "_explained", lambda *_: False)
    monkeypatch.setattr(module, "_stays", lambda *_: False)
    film = next(h for h in ranked if h.family == "forced_convection")
    there = replace(film, batch=replace(film.batch, places=("sources.front",) * len(film.batch.places)), statistic=1.0)
    for number, removes, told in ((20.0, 13.0, False), (20.0, 15.0, True), (6.0, 1.0, False), (6.0, 4.0, True)):
        before_and_after = iter((number, 0.0))
        monkeypatch.setattr(module, "misfit", lambda *_, left=before_and_after: next(left))
        monkeypatch.setattr(module, "exact", lambda d, y, f, h, removes=removes: replace(h, statistic=removes))
        found = ended([there])
        assert found is not None
        assert ("forced_convection" in [h.family for h, _ in found.accepted[0].rivals]) == told


def test_a_factor_is_no_rival_of_a_number_that_it_does_not_bring_back():
    """Of a parameter that is estimated within its prior there is little left to explain, and any factor does that."""
    detector = small_case.made_detector()
    _, y = small_case.source_off(4.5)
    start = begun(detector, y)
    relaxed = strained(start, y)
    assert relaxed is not None
    factors = [h for h in start.scored[1] if fault_of(h).corrects]
    every = [replace(h, statistic=1e9) for h in factors]
    found = closed(replace(start, glance=(*start.glance[:1], [], start.glance[2]), declared=every), y, relaxed)
    assert found is not None
    (one,) = found.accepted
    told = {fault_of(h).factor(h.name)[0] for h, _ in one.rivals if fault_of(h).corrects}
    source = next(
        s for s in detector.study.probed.base.load_model.sources if one.hypothesis.name == f"sources.{s.name}"
    )
    read = {f"signals.{name}" for name in source.use.signals.values()}
    asked = {fault_of(h).factor(h.name)[0] for h in factors}
    assert asked - read
    assert told <= read


def test_no_more_is_refitted_than_decides(monkeypatch):
    """Each refit takes seconds, and a machine of parts has a hundred joints and windows that score."""
    detector, ranked, ended = relaxed_source()
    module = sys.modules[closed.__module__]
    refitted = []
    monkeypatch.setattr(module, "misfit", lambda *_: 0.0)
    monkeypatch.setattr(module, "exact", lambda d, y, f, h: refitted.append(h) or h)
    joint = next(h for h in ranked if bent(detector, h))
    limit = detector.thresholds[joint.family]
    for share, stays, refits in ((0.9, False, 0), (1.1, True, 0), (1.1, False, 1)):
        monkeypatch.setattr(module, "_stays", lambda *_, stays=stays: stays)
        refitted.clear()
        several = [replace(joint, statistic=share * limit) for _ in range(100)]
        assert (ended(several) is None) == (refits > 0)
        assert len(refitted) == refits


def test_without_its_tolerance_a_number_is_what_the_data_alone_say():
    """Of the fit that finds causes: as with a prior a hundred times as wide, but for its bounds."""
    detector = small_case.made_detector()
    j, y = small_case.source_off(0.3)
    fitted = detector.fitter(y)
    value, sigma = untied(fitted, j)
    N, white = fitted.projector.N, detector.whiten(fitted.residual)
    precision = np.ones(N.shape[1])
    precision[j] = 1e-4
    covariance = np.linalg.inv(np.diag(precision) + N.T @ N)
    assert value == pytest.approx((covariance @ (N.T @ white))[j], rel=1e-3)
    assert sigma == pytest.approx(np.sqrt(covariance[j, j]), rel=1e-3)


def test_a_number_that_one_fit_alone_is_sure_of_stands_where_the_other_does_not_contradict(monkeypatch):
    """The settled calibration may know next to nothing of a small source, and then says nothing against it."""
    detector = small_case.made_detector()
    j, y = small_case.source_off(4.5)
    fitted, n = detector.fitter(y), len(detector.study.probed.parameters)
    own, moves = untied(fitted, j)[0], np.where(np.arange(n) == j, -0.01 * np.sign(fitted.x), 0.0)

    def found(share: float, sigma: float) -> dict[int, Loose]:
        said = np.where(np.arange(n) == j, share * own, 0.0), (sigma * own) ** 2 * np.eye(n)
        monkeypatch.setattr(sys.modules[loose_ones.__module__], "settled_alone", lambda *_: said)
        return {loose.index: loose for loose in loose_ones(detector, y, fitted, moves, Freed())}

    for share, sigma in ((0.6, 0.5), (0.4, 0.5), (-0.6, 1.0)):
        loose = found(share, sigma)[j]
        assert not loose.settled
        assert loose.x > 1.96 * loose.sigma
    assert j not in found(0.2, 0.1)  # what it says lies within 0.0 and 0.4
    assert j not in found(-0.6, 0.5)


@pytest.mark.parametrize(("less", "first"), [(5.0, "sources.front"), (7.0, "sources.rear")])
def test_of_two_that_leave_as_much_the_one_farther_out_counts(less, first, monkeypatch):
    """Six likelihood-ratio units decide nothing, and what synthetic measurements show does; the other is its rival."""
    detector = small_case.made_detector()
    _, y = small_case.source_off(4.5)
    start = begun(detector, y)
    paths = [p.path for p in detector.study.probed.parameters]
    loose = [Loose(paths.index(f"sources.{n}.gain"), 3.0, 0.3, strain) for n, strain in (("front", 1.5), ("rear", 1.2))]
    left = {"sources.front": 100.0, "sources.rear": 100.0 - less}
    fits = {name: replace(start.fitted, reachable=value) for name, value in left.items()}
    module = sys.modules[strained.__module__]
    monkeypatch.setattr(module, "misfit", lambda _, of: of.reachable)
    monkeypatch.setattr(
        module,
        "_freed",
        lambda _d, _y, _f, h, _k: (fits[h.name], as_scored(detector.study, replace(h, statistic=50.0))),
    )
    monkeypatch.setattr(module, "_scored", lambda *_: 1e6)
    fit, one = strained(replace(start, loose=loose), y)
    assert (one.hypothesis.name, fit.reachable) == (first, left[first])
    assert [h.name for h, _ in one.rivals] == (["sources.rear"] if less < 6.0 else [])
    assert all(h.statistic == one.statistic for h, _ in one.rivals)


def test_a_size_is_refused_where_its_interval_lies_beyond_physics():
    """A film of nine times is fitted as ten, and known to an eighth."""
    detector = small_case.made_detector()
    batch = next(b for b in detector.columns.batches if b.family == "film_gain" and b.kind == "group")
    h = Hypothesis(batch, 0, batch.histories[0], 100.0, (1.0,))
    assert batch.largest[0] == 9.0  # of a relative change
    assert possible(detector, h, 9.4)
    assert not possible(detector, h, 12.0)


def test_a_companion_at_the_same_part_or_in_the_same_history_needs_more_than_the_error_of_the_response():
    """Of all the response, which parameters may imitate: its error they do not."""
    detector = small_case.made_detector()
    one = in_windows(1)
    batch, when = one.hypothesis.batch, one.hypothesis.when
    other = next(i for i, name in enumerate(batch.places) if Spot.read(name).part != Spot.read(batch.places[0]).part)
    switched = next(h for h in batch.histories if h.windows and h.name != when.name)
    sensor = next(b for b in detector.columns.batches if b.kind == "offset")

    def needed(size: float, h: Hypothesis) -> float:
        return limits_beside(detector, [replace(one, amplitude=np.array([size]))])(h)

    same_part = replace(one.hypothesis, when=switched)
    same_hours = replace(one.hypothesis, place=other)
    apart = replace(one.hypothesis, place=other, when=switched)
    for h in (same_part, same_hours):
        assert needed(1e4, h) - detector.thresholds[h.family] == pytest.approx(
            misfits(detector, one.hypothesis, [1e4])
        )  # fmt: skip
        assert needed(2e4, h) > 3.0 * needed(1e4, h) > 10.0 * needed(1.0, h)
    for h in (apart, Hypothesis(sensor, 0, sensor.histories[0], 100.0, (1.0,))):
        assert needed(1e4, h) == needed(1.0, h) > detector.thresholds[h.family]
    assert limits_beside(detector, [])(apart) == detector.thresholds[apart.family]

"""Of several causes that the sealed run refutes together, those stay that it does not refute without the weakest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.diagnose import small_case
from tests.diagnose.test_strong_causes import outputs
from twin.calibrate.fit.measured import Measured
from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.faults.acted import lasts, slots_with, units_of
from twin.diagnose.faults.catalogue import FAMILIES
from twin.diagnose.faults.sensor_readings import elsewhere
from twin.diagnose.result.diagnosis import Gain
from twin.diagnose.search.accepted import Accepted
from twin.diagnose.search.forward import search
from twin.diagnose.search.look import Search
from twin.diagnose.search.policy import POLICY
from twin.diagnose.search.sealed import _worse, judged
from twin.diagnose.search.standing import standing
from twin.diagnose.search.verdict import cause_of

pytestmark = pytest.mark.long


def always(place: str, power: float, statistic: float) -> Accepted:
    """Heat [W] in every run, the sealed one too."""
    detector = small_case.made_detector()
    batch = next(b for b in detector.columns.batches if b.family == "heat_source")
    when = next(w for w in batch.histories if not w.windows and not w.signal and w.bell is None)
    h = Hypothesis(batch, batch.places.index(place), when, statistic, (power,))
    return Accepted(h, units_of(detector.study, h), np.array([power]), np.eye(1), statistic, 36.0, ())


def found_beside(*others: Accepted) -> tuple[Search, np.ndarray, list[Measured]]:
    """The search that finds 400 W at the housing, and has named something else besides; the sealed run."""
    detector, rng = small_case.made_detector(), np.random.default_rng(5)
    study, true = detector.study, always("housing", 400.0, 1.0)
    x = np.zeros(len(study.probed.parameters))
    slots = slots_with(study, small_case.elements(), true.units, 2)
    T, w = study.runs[2].split(study.outputs(2, x, slots, true.amplitude))
    y = outputs(true.hypothesis, x)
    y = y + detector.whiten.colour(rng.standard_normal(len(y)))
    found = search(detector, y)
    assert [a.hypothesis.name for a in found.accepted] == ["housing"]
    opened = [replace(study.runs[2].measured, temperature=T, tcp=w)]
    return replace(found, accepted=(*found.accepted, *others)), y, opened


def test_two_causes_that_are_alike_are_two():
    """One of two in the same windows is dropped."""
    one, other = always("slide", 50.0, 40.0), always("slide", 50.0, 40.0)
    assert one not in [other]
    assert [one, other].index(other) == 1


def test_the_weakest_is_withdrawn_alone():
    """5 kW at the slide that are not there: without them the other cause predicts the sealed run."""
    found, y, opened = found_beside(always("slide", 5000.0, 40.0))
    now, told = standing(found, y, FAMILIES, (), opened, 1)
    assert (told.verdict, [c.place for c in told.causes], told.note) == ("named", ["housing"], "")
    assert told.less.startswith("withdrawn: missing heat source at slide")
    assert [a.hypothesis.name for a in now.accepted] == ["housing"]
    assert now.accepted[0].amplitude[0] == pytest.approx(400.0, rel=0.1)


def test_the_last_one_is_withdrawn_as_a_whole():
    found, y, opened = found_beside(always("slide", 5000.0, 40.0))
    alone = replace(found, accepted=found.accepted[1:])
    now, told = standing(alone, y, FAMILIES, (), opened, 1)
    assert (told.verdict, told.causes, told.less) == ("unknown", (), "")
    assert told.note.startswith("withdrawn: missing heat source at slide")
    assert now is alone


def test_what_ended_with_the_runs_that_were_looked_at_is_told_until_then():
    """Heat from an hour of the first run on, which is gone in the sealed run."""
    detector, rng = small_case.made_detector(), np.random.default_rng(6)
    study = detector.study
    batch = next(b for b in detector.columns.batches if b.family == "heat_source")
    when = next(w for w in batch.histories if w.name == "from 2.0 h of run_0 on")
    true = Hypothesis(batch, batch.places.index("housing"), when, 1.0, (400.0,))
    y = outputs(true, np.zeros(len(study.probed.parameters)))
    found = search(detector, y + detector.whiten.colour(rng.standard_normal(len(y))))
    assert [lasts(study, a.hypothesis.when.windows) for a in found.accepted] == [True]
    T, w = study.runs[2].split(study.outputs(2, np.zeros(len(study.probed.parameters))))
    opened = [replace(study.runs[2].measured, temperature=T, tcp=w)]
    now, told = standing(found, y, FAMILIES, (), opened, 1)
    assert (told.verdict, [c.place for c in told.causes], told.note) == ("named", ["housing"], "")
    assert told.less.startswith("named until the end of the diagnosed runs: missing heat source at housing")
    (one,) = now.accepted
    assert not lasts(study, one.hypothesis.when.windows)
    assert not one.units[0].shapes[2].any()
    assert told.causes[0].history == "from 2.0 h of run_0 to the end of run_1"


@pytest.mark.parametrize(("bent", "refuted"), [(0.0, False), (3.0, True)])
def test_a_cause_that_ends_before_the_sealed_run_is_judged_there_by_the_calibration_beside_it(bent, refuted):
    """Heat for an hour of the first run: a false one would have led a source's number astray."""
    found, y, opened = found_beside()
    study = found.detector.study
    batch = found.accepted[0].hypothesis.batch
    when = next(w for w in batch.histories if w.name == "from 1.0 h to 2.0 h of run_0")
    h = Hypothesis(batch, batch.places.index("housing"), when, 500.0, (50.0,))
    one = replace(
        found.accepted[0], hypothesis=h, units=units_of(study, h), amplitude=np.array([50.0]), statistic=500.0
    )
    T, w = study.runs[2].split(study.outputs(2, found.x0))
    x = found.x0.copy()
    x[next(j for j, p in enumerate(study.probed.parameters) if p.kind == "source")] += bent
    measured = [replace(opened[0], temperature=T, tcp=w)]
    told = judged(replace(found, accepted=(one,), x=x), y, "named", [cause_of(one, study, POLICY)], FAMILIES,
                  measured, 1)  # fmt: skip
    assert told.refuted is refuted


def switching(power: float) -> tuple[Search, np.ndarray, list[Measured]]:
    """A search that has named 100 W for two hours of every run that was looked at; power [W]: of the sealed run, in the
    same hours."""
    found, y, opened = found_beside()
    study, batch = found.detector.study, found.accepted[0].hypothesis.batch
    when = next(w for w in batch.histories if w.name == "from 1.0 h to 3.0 h of run_0")

    def heat(*runs: str) -> Hypothesis:
        windows = tuple(replace(when.windows[0], run=run) for run in runs)
        return Hypothesis(batch, batch.places.index("housing"), replace(when, windows=windows), 500.0, (100.0,))

    h = heat("run_0", "run_1")
    one = replace(
        found.accepted[0], hypothesis=h, units=units_of(study, h), amplitude=np.array([100.0]), statistic=500.0
    )
    slots = slots_with(study, small_case.elements(), units_of(study, heat("run_2")), 2)
    T, w = study.runs[2].split(study.outputs(2, found.x0, slots, (power,)))
    return replace(found, accepted=(one,), x=found.x0), y, [replace(opened[0], temperature=T, tcp=w)]


@pytest.mark.parametrize(("power", "stays"), [(100.0, True), (0.0, False)])
def test_what_switches_in_every_run_may_do_so_in_the_sealed_run(power, stays):
    """100 W for two hours of every run, of the sealed one, too: without it the calibration that has taken some of it
    for a source's predicts that run. Where nothing is in that run, a calibration beside a false cause is astray."""
    found, y, measured = switching(power)
    study, astray = found.detector.study, found.x0.copy()
    astray[next(j for j, p in enumerate(study.probed.parameters) if p.kind == "source")] += 0.5
    told_of = replace(found, x0=astray) if stays else replace(found, x=astray)
    causes = [cause_of(told_of.accepted[0], study, POLICY)]
    assert judged(told_of, y, "named", causes, FAMILIES, measured, 1).refuted
    now, told = standing(told_of, y, FAMILIES, (), measured, 1)
    assert told.refuted is not stays
    assert (now is told_of) is not stays
    if stays:
        assert told.less == "the sealed run is predicted with what switches, at its hours of run_0"
        assert [{w.run for w in c.windows} for c in told.extension] == [{"run_0", "run_1"}]


@pytest.mark.parametrize("power", [100.0, 0.0])
def test_where_the_sealed_run_speaks_for_hours_of_the_others_it_is_predicted_with_them(power):
    """A calibration beside the cause is as far from that run as one without it: nothing is refuted."""
    found, y, measured = switching(power)
    causes = [cause_of(found.accepted[0], found.detector.study, POLICY)]
    without = judged(found, y, "named", causes, FAMILIES, measured, 1)
    assert (without.refuted, without.confirmed) == (False, False)
    now, told = standing(found, y, FAMILIES, (), measured, 1)
    assert told.confirmed is (now is not found) is bool(told.less) is (power > 0.0)


def test_what_is_not_refuted_stays_as_it_was_found():
    found, y, opened = found_beside()
    now, told = standing(found, y, FAMILIES, (), opened, 1)
    assert now is found
    assert (told.verdict, told.less, told.note) == ("named", "", "")


@pytest.mark.parametrize("again", [True, False])
def test_swapped_sensors_have_each_others_names_in_the_sealed_run_too(again: bool):
    """Where they have not there, the fault is withdrawn with a note: two channels tens of kelvins off are no chance."""
    study, rng = small_case.study(), np.random.default_rng(4)
    x = 0.5 * rng.standard_normal(len(study.probed.parameters))
    y = study.all_outputs(x)
    y = y + small_case.made_detector().whiten.colour(rng.standard_normal(len(y)))
    for _, T, _ in study.split(y):
        T[:] = T[:, [1, 0, *range(2, T.shape[1])]]
    found = search(small_case.made_detector(), y)
    assert [a.hypothesis.batch.kind for a in found.accepted] == ["swapped"]
    sealed = study.runs[2].measured
    T, w = study.runs[2].split(study.outputs(2, x))
    T = T[:, [1, 0, *range(2, T.shape[1])]] if again else T
    now, told = standing(found, y, FAMILIES, (), [replace(sealed, temperature=T, tcp=w)], 1)
    if again:
        assert (now, told.verdict, told.less) == (found, "sensor", "")
        return
    assert not [a for a in now.accepted if a.hypothesis.batch.kind == "swapped"]
    assert told.less.startswith("withdrawn: sensor front<>housing (swapped), with which the sealed run is less likely")
    assert "swapped" not in [c.history for c in told.causes]


def test_a_sensor_that_reads_too_much_stays_though_it_was_repaired():
    """1.5 K too much in the runs that were looked at, and right in the sealed one: its own channel says nothing."""
    study, rng = small_case.study(), np.random.default_rng(7)
    x = 0.5 * rng.standard_normal(len(study.probed.parameters))
    y = study.all_outputs(x)
    y = y + small_case.made_detector().whiten.colour(rng.standard_normal(len(y)))
    for _, T, _ in study.split(y):
        T[:, 1] += 1.5
    found = search(small_case.made_detector(), y)
    assert [a.hypothesis.name for a in found.accepted] == ["sensors.housing"]
    T, w = study.runs[2].split(study.outputs(2, x))
    now, told = standing(found, y, FAMILIES, (), [replace(study.runs[2].measured, temperature=T, tcp=w)], 1)
    assert (now, told.verdict, told.less) == (found, "sensor", "")


@pytest.mark.parametrize("again", [True, False])
def test_a_sensor_on_another_part_is_there_in_the_sealed_run_too(again: bool):
    study, rng = small_case.study(), np.random.default_rng(4)
    x = 0.5 * rng.standard_normal(len(study.probed.parameters))
    y = study.all_outputs(x) + elsewhere(study, lambda k: study.states(k, x), "housing", "bearing_front")
    y = y + small_case.made_detector().whiten.colour(rng.standard_normal(len(y)))
    found = search(small_case.made_detector(), y)
    assert [a.hypothesis.name for a in found.accepted] == ["sensors.housing>bearing_front"]
    sealed = study.runs[2].measured
    T, w = (np.array(own) for own in study.runs[2].split(study.outputs(2, x)))
    if again:
        T[:, sealed.sensors.index("housing")] = T[:, sealed.sensors.index("front")]
    now, told = standing(found, y, FAMILIES, (), [replace(sealed, temperature=T, tcp=w)], 1)
    if again:
        assert (now, told.verdict, told.less) == (found, "sensor", "")
    else:
        assert not now.accepted
        assert told.less.startswith("withdrawn: sensor housing (mounted on another part), with which the sealed run is")


@pytest.mark.parametrize(("better", "bad"), [(4.0, "dx of friday"), (9.0, "")])
def test_what_all_channels_together_are_predicted_worse_with(better: float, bad: str):
    """dx by 3 um worse, significantly; dy by less or more than that better."""
    worse = Gain("friday", "dx", "m", 9e-6, 5e-6, 8e-6, (-4e-6, -2e-6), True)
    other = Gain("friday", "dy", "m", 9e-6, better * 1e-6, 1e-6, (-1e-6, 4e-6), True)
    kelvin = Gain("friday", "front", "K", 3.0, 2.0, 0.1, (1.8, 2.0), True)
    told = _worse([worse, other, kelvin])
    assert told.startswith(bad) if bad else told == ""

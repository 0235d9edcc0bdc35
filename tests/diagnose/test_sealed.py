"""What the sealed runs refute is withdrawn, and something is left to be explained."""

from __future__ import annotations

import twin.run.jax_setup  # noqa: F401  isort: skip

import sys
from dataclasses import replace

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.evidence.pulls import Loose
from twin.diagnose.faults.acted import units_of
from twin.diagnose.faults.catalogue import FAMILIES
from twin.diagnose.result.diagnosis import Rival
from twin.diagnose.search.accepted import Accepted, settled
from twin.diagnose.search.by_calibration import strained_of
from twin.diagnose.search.forward import search
from twin.diagnose.search.gain import Channel, channels_of, likelihood_ratio
from twin.diagnose.search.look import Search
from twin.diagnose.search.policy import POLICY
from twin.diagnose.search.sealed import judged, other_sizes
from twin.diagnose.search.verdict import verdict_of

pytestmark = pytest.mark.long


def test_a_name_that_makes_the_sealed_run_worse_is_withdrawn(monkeypatch):
    detector = small_case.made_detector()
    y = small_case.source_off(4.5)[1]
    found = search(detector, y)
    verdict, causes = verdict_of(found, FAMILIES)
    assert verdict == "out_of_tolerance"
    (cause,) = causes
    sealed = [detector.study.runs[2].measured]

    def opened(gain: float, smaller: float | None = None) -> tuple[str, int, str]:
        """gain: share of a sensor's error that the cause takes from it in the sealed run; smaller: a smaller one."""

        def channels(of: Search, *_: object) -> tuple[Channel, ...]:
            own = gain if of.accepted is found.accepted or smaller is None else smaller
            errors = [np.full(10, e) for e in (1.0, 1.0, 1.0 - own)]
            return (Channel("sealed", "housing", "K", 300.0 * np.arange(10), errors, True, 0.1),)

        monkeypatch.setattr(sys.modules[judged.__module__], "channels_of", channels)
        told = judged(found, y, verdict, causes, FAMILIES, sealed, 1)
        return told.verdict, len(told.extension), told.note or told.size

    assert opened(0.5)[:2] == ("out_of_tolerance", 1)
    refuted, extension, note = opened(-0.5)
    assert (refuted, extension) == ("unknown", 0)
    assert cause.place in note
    assert "most of all housing: residual 1.50 K (rms) with it, 1.00 K recalibrated" in note
    assert "nearly as likely" not in note
    rival = Rival("joint", "contacts.rail", "always", 0.5, "1", 40.0, 0.99, "")
    told = judged(found, y, verdict, [replace(cause, rivals=(rival, rival))], FAMILIES, sealed, 1)
    others = "Not tested on the sealed run, and nearly as likely in the others"
    assert told.note == f"{note}. {others}: wrong joint conductance at contacts.rail"
    none = dict.fromkeys(found.steps[0].parts, 0.0)  # no heat of any history, and a name that has just passed
    faint = replace(
        found, steps=(replace(found.steps[0], parts=none),),
        accepted=tuple(replace(a, statistic=1.2 * a.threshold) for a in found.accepted),
    )  # fmt: skip
    told = judged(faint, y, verdict, causes, FAMILIES, sealed, 1)
    assert (told.verdict, told.causes, told.refuted) == ("nothing", (), True)
    assert told.note.startswith("withdrawn: ")
    kept, extension, note = opened(-0.5, smaller=0.2)  # the cause predicts the sealed run, and its size does not
    assert (kept, extension) == (verdict, 0)
    assert note.startswith("not written")


@pytest.mark.parametrize("sealed", [4.5, 0.0])
def test_a_number_by_calibration_that_predicts_the_sealed_run_worse_is_withdrawn(sealed):
    """The diagnosed runs say that a source is 4.5 standard deviations off, the sealed one says so, too, or does not."""
    detector = small_case.made_detector()
    j, y = small_case.source_off(4.5)
    study, x = detector.study, np.zeros(len(detector.study.probed.parameters))
    found = replace(search(detector, y), accepted=(), x=x, x0=x, loose=(Loose(j, 4.5, 0.3, 1.5),))
    causes = strained_of(found)
    x = x.copy()
    x[j] = sealed
    T, w = study.runs[2].split(study.outputs(2, x))
    opened = [replace(study.runs[2].measured, temperature=T, tcp=w)]
    told = judged(found, y, "out_of_tolerance", causes, FAMILIES, opened, 1)
    if sealed:
        assert (told.verdict, told.causes, told.note) == ("out_of_tolerance", causes, "")
        assert judged(found, y, "out_of_tolerance", causes, FAMILIES, (), 1).causes == causes  # without a sealed run
    else:
        assert (told.verdict, told.causes) == ("nothing", ())
        assert causes[0].place in told.note
        faulty = replace(causes[0], family="sensor", history="offset", parameter="")
        assert judged(found, y, "sensor", (faulty, *causes), FAMILIES, opened, 1).verdict == "sensor"


def test_other_sizes_are_the_smallest_and_that_of_the_settled_calibration():
    detector = small_case.made_detector()
    _, y = small_case.source_off(4.5)
    found = search(detector, y)
    (one,) = found.accepted
    (least,), (settled,) = other_sizes(found, y)
    sigma = np.sqrt(one.covariance[0, 0])
    assert one.amplitude[0] - 2.5 * sigma < least.amplitude[0] < one.amplitude[0] - 1.9 * sigma
    assert settled.amplitude[0] == pytest.approx(4.5 * detector.study.scale[small_case.source_off(4.5)[0]], rel=0.05)
    unsure = replace(found, accepted=(replace(one, covariance=1e6 * one.covariance),))
    assert next(other_sizes(unsure, y))[0].amplitude[0] == 0.0


def test_a_declared_number_is_judged_beside_a_calibration_of_all_others():
    """The calibration without a cause moves the number itself and predicts as well as the model that is told."""
    detector = small_case.made_detector()
    j, y = small_case.source_off(4.5)
    study, x = detector.study, np.zeros(len(detector.study.scale))
    found = search(detector, y)
    assert found.x0[j] > 2.0
    x[j] = 4.5
    T, w = study.runs[2].split(study.outputs(2, x))
    opened = [replace(study.runs[2].measured, temperature=T, tcp=w)]
    told = judged(found, y, *verdict_of(found, FAMILIES), FAMILIES, opened, 1)
    held = settled(found.detector, y, [replace(a, amplitude=np.zeros(1)) for a in found.accepted])[0]
    assert held[j] == 0.0
    at = study.runs[2].split(study.outputs(2, held))[0]
    for i, name in enumerate(study.runs[2].measured.sensors):
        own = next(g for g in told.gains if g.channel == name)
        assert own.recalibrated == pytest.approx(float(np.sqrt(np.mean((T[:, i] - at[:, i]) ** 2))))
    assert len(told.extension) == 1
    assert sum(g.ci95[0] > 0.0 for g in told.gains if g.affected) > sum(
        g.ci95[1] < 0.0 for g in told.gains if g.affected
    )


def test_an_expansion_is_not_judged_by_temperatures():
    """They differ between both calibrations, and no expansion moves them."""
    detector = small_case.made_detector()
    study = detector.study
    _, y = small_case.source_off(4.5)
    batch = next(b for b in detector.columns.batches if b.family == "expansion")
    h = Hypothesis(batch, 0, batch.histories[0], 50.0, (0.3,))
    one = Accepted(h, units_of(study, h), np.array([0.3]), np.eye(1), 50.0, 36.0, ())
    found = replace(search(detector, y), accepted=(one,))
    m = study.runs[2].measured
    T, w = study.runs[2].split(study.outputs(2, found.x))
    sigma = np.full(len(m.sensors), 0.01), np.full(3, 1e-8)
    channels = channels_of(found, 2, replace(m, temperature=T, tcp=w), sigma)
    assert {c.unit for c in channels if c.moved} == {"m"}
    assert any(np.abs(c.errors[1] - c.errors[2]).max() > 0.01 for c in channels if c.unit == "K")


def channel(before: np.ndarray, after: np.ndarray, run: str = "sealed", moved: bool = True) -> Channel:
    return Channel(run, "housing", "K", 300.0 * np.arange(len(before)), [before, before, after], moved, 0.1)


def test_the_sealed_runs_are_judged_by_likelihood():
    rng = np.random.default_rng(5)
    noise = 0.1 * rng.standard_normal(144)  # 12 h, six blocks
    half = channel(0.5 + noise, noise), channel(noise, 0.1 + noise), channel(noise, 0.1 + noise)
    low, high = likelihood_ratio(half, 1, POLICY)
    told = 0.5 * sum(float(np.sum(c.errors[1] ** 2 - c.errors[2] ** 2)) for c in half) / 0.1**2
    assert 0.0 < low < told < high  # the error that is gone outweighs both that are made
    assert likelihood_ratio((channel(noise, 0.1 + noise),), 1, POLICY)[1] < 0.0
    assert likelihood_ratio((channel(noise, 0.1 + noise, moved=False),), 1, POLICY) == (0.0, 0.0)
    once = np.where(np.arange(144) < 24, 0.5, 0.0)  # better in one block, and much: that may be chance
    low, high = likelihood_ratio((channel(once + noise, noise + 0.01),), 1, POLICY)
    assert low < 0.0 < high
    gap = np.where(np.arange(144) < 100, np.nan, noise)
    assert np.isfinite(likelihood_ratio((channel(gap, 0.1 + noise),), 1, POLICY)).all()
    one, two = (channel(0.5 + noise, noise, run) for run in ("sealed", "other"))
    assert np.mean(likelihood_ratio((one, two), 1, POLICY)) == pytest.approx(
        2.0 * np.mean(likelihood_ratio((one,), 1, POLICY)), rel=0.05
    )

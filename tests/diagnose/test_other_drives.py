"""Two signals at one place: which of them drives a cause, or that data do not tell."""

from __future__ import annotations

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.faults.acted import Unit, slots_with, units_of
from twin.diagnose.faults.catalogue import FAMILIES
from twin.diagnose.search.accepted import readings_columns
from twin.diagnose.search.detector import Detector
from twin.diagnose.search.forward import search
from twin.diagnose.search.look import look, other_drives
from twin.diagnose.search.start import begun
from twin.diagnose.search.verdict import verdict_of

DRIVES = "spindle_current", "spindle_speed"


def mixed(detector: Detector, share: float, size: float = 15.0) -> np.ndarray:
    """Measurements (m,) of heat at the nut: that of a current by a share, the other by a speed; size: what either
    alone would score, as a deviate."""
    study = detector.study
    batch = next(b for b in detector.columns.batches if b.family == "heat_source" and "nut" in b.places)
    place, zeros = batch.places.index("nut"), np.zeros(len(study.scale))
    y = study.all_outputs(zeros)
    projector, sizes, units = detector.fitter(y).projector, list[float](), list[Unit]()
    for signal, part in zip(DRIVES, (share, 1.0 - share), strict=True):
        h = Hypothesis(batch, place, next(w for w in batch.histories if w.signal == signal), 0.0, (1.0,))
        D = readings_columns(detector, h)[:, 0]
        sizes.append(part * size / np.sqrt(float(D @ projector(D))))
        units += units_of(study, h)
    slots = [slots_with(study, detector.elements, units, k) for k in study.fitted]
    return np.concatenate([study.outputs(k, zeros, own, sizes) for k, own in zip(study.fitted, slots, strict=True)])


@pytest.mark.long
def test_heat_that_two_signals_tell_alike_is_that_of_either():
    detector = small_case.made_detector()
    found = search(detector, mixed(detector, 0.5))
    verdict, (cause,) = verdict_of(found, FAMILIES)
    assert verdict == "ambiguous"
    assert (cause.family, cause.place) == ("heat_source", "nut")
    told = {cause.signal} | {r.history.partition("^")[0] for r in cause.rivals if r.place == "nut"}
    assert told == set(DRIVES)
    assert any("work alone" in r.remedy for r in cause.rivals)


@pytest.mark.long
def test_heat_that_one_signal_tells_is_that_one_s():
    detector = small_case.made_detector()
    verdict, (cause,) = verdict_of(search(detector, mixed(detector, 0.0)), FAMILIES)
    assert (verdict, cause.signal) == ("named", "spindle_speed")
    assert not [r for r in cause.rivals if r.place == "nut" and r.family == "heat_source"]


@pytest.mark.long
def test_other_drives_are_those_that_score_nearly_as_much():
    detector = small_case.made_detector()
    for share, drives in ((0.5, 1), (0.0, 0)):
        start = begun(detector, mixed(detector, share))
        seen, ranked, _ = look(start.detector, start.fitted)
        lead = next(h for h in ranked if h.when.signal and h.name == "nut")
        others = other_drives(seen, lead, detector.policy)
        assert len(others) == drives
        assert all(o.statistic <= lead.statistic and o.when.signal != lead.when.signal for o in others)

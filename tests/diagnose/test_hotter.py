"""Model discrepancy grows where channels get far hotter than described, and nowhere else."""

from __future__ import annotations

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.diagnose.search.accepted import parameter_of
from twin.diagnose.search.hotter import hotter


@pytest.mark.long
def test_the_described_machine_keeps_its_detector():
    detector = small_case.made_detector()
    assert hotter(detector, np.zeros(len(detector.study.probed.parameters))) is detector


@pytest.mark.long
def test_channels_of_a_stronger_source_are_wrong_by_as_much_more_as_they_rise():
    detector = small_case.made_detector()
    study = detector.study
    x = np.zeros(len(study.probed.parameters))
    j = parameter_of(study, "sources.motor")
    x[j] = np.log(6.0) / study.scale[j]
    after = hotter(detector, x)
    size = np.linalg.norm(detector.fitter.others, axis=1)
    times = np.where(size > 0.0, np.linalg.norm(after.fitter.others, axis=1) / np.maximum(size, 1e-30), 1.0)
    (bins, sensors), _ = study.runs[0].shapes
    f, f0 = (study.runs[0].split(v[: study.runs[0].size])[0] for v in (detector.fitter.surrogate.at(x)[0],
                                                                      detector.fitter.surrogate.y0))  # fmt: skip
    ratios = []
    for s in range(sensors):
        rise, described = (np.sqrt(np.mean((v[:, s] - v[0, s]) ** 2)) for v in (f, f0))
        assert described > 3.0  # K: enough for a ratio
        ratios.append(rise / described)
        measured = size[: bins * sensors].reshape(bins, sensors)[:, s] > 0.0
        own = times[: bins * sensors].reshape(bins, sensors)[measured, s]
        np.testing.assert_allclose(own, own[0], rtol=1e-6)
        if ratios[-1] > 1.8:
            assert own[0] == pytest.approx(ratios[-1], rel=1e-6)
        else:
            assert own[0] == pytest.approx(1.0, rel=1e-6) or own[0] == pytest.approx(ratios[-1], rel=1e-6)
    assert max(ratios) > 1.8
    # what scores are made with follows
    wanted = after.fitter.others.T @ after.columns.raw.astype(float)
    np.testing.assert_allclose(after.columns.others, wanted, rtol=1e-6, atol=1e-6 * np.abs(wanted).max())
    assert after.thresholds == detector.thresholds


@pytest.mark.long
@pytest.mark.parametrize("factor", [0.2, 1.05])
def test_a_source_within_its_tolerance_or_a_colder_one_changes_nothing(factor):
    detector = small_case.made_detector()
    study = detector.study
    x = np.zeros(len(study.probed.parameters))
    j = parameter_of(study, "sources.motor")
    x[j] = np.log(factor) / study.scale[j]
    assert hotter(detector, x) is detector

"""A detector with gaps is the one that uses nothing of what is missing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.diagnose.evidence.whiten import measured_of, missing
from twin.diagnose.model.study import with_measured
from twin.diagnose.search.detector import emptied


@pytest.mark.long
def test_what_is_missing_counts_nowhere():
    detector = small_case.made_detector()
    plans = [planned.measured for planned in detector.study.runs]
    T = plans[0].temperature.copy()
    T[5:, 1] = np.nan
    gaps = [replace(plans[0], temperature=T), *plans[1:]]
    after = emptied(detector, gaps)
    lost = missing(with_measured(detector.study, gaps))
    assert lost.sum() > missing(detector.study).sum()
    assert not np.any(after.columns.raw[lost])
    assert not np.any(after.fitter.others[lost])
    np.testing.assert_array_equal(after.columns.raw[~lost], detector.columns.raw[~lost])
    gram, own = after.columns.grams[0][0], after.columns.raw[:, after.columns.batches[0].columns[0]].astype(float)
    np.testing.assert_allclose(gram, own.T @ own)
    # whatever would have been read there, the fit is the same
    y = measured_of(detector.study)
    other = np.where(lost, y + 7.0, y)
    np.testing.assert_array_equal(after.fitter(y).x, after.fitter(other).x)

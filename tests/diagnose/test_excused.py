"""What causes explain that were found without a channel is no fault of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.diagnose import small_case
from tests.diagnose.test_standing import always, found_beside
from tests.diagnose.test_strong_causes import outputs
from tests.diagnose.test_witness import DRIFT, UNSURE, as_measured, findings
from twin.calibrate.channels.judge import Judgement
from twin.diagnose.search.excused import excused

pytestmark = pytest.mark.long


@pytest.mark.parametrize("drift", [0.0, DRIFT])
def test_a_channel_is_at_fault_by_what_the_causes_leave_of_it(drift: float):
    """Heat of 400 W warms a sensor for hours, as a drift does."""
    x = np.zeros(len(small_case.study().probed.parameters))
    warmer = outputs(always("housing", 400.0, 1.0).hypothesis, x) - small_case.study().all_outputs(x)
    runs, name = as_measured(drift, more=warmer)
    told, _ = findings(name, runs, UNSURE)
    rises = np.ptp(small_case.study().split(warmer)[0][1][:, small_case.study().runs[0].measured.sensors.index(name)])
    judgement = Judgement((replace(told, size=drift or float(rises)),), (), ())
    assert judgement.findings[0].size > 1.0
    found, _, _ = found_beside()
    assert excused(found, runs, judgement).findings == (judgement.findings if drift else ())
    assert excused(replace(found, accepted=()), runs, judgement) is judgement

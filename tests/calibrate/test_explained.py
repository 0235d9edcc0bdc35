"""What a light bearing does when its spindle starts looks like a fault to all others; the model knows better."""

from __future__ import annotations

import numpy as np
import pytest

from tests.diagnose.test_lumped import loads, twin
from tests.diagnose.test_time_step import with_bearing
from twin.calibrate.channels.explained import judge_beside
from twin.calibrate.channels.judge import judge
from twin.inject.damage.channels import Damage
from twin.inject.damage.kinds import damaged
from twin.logs.read import read_run
from twin.rom.artefact import read_artefact

HOUR = 3600.0


@pytest.fixture(scope="module")
def spindle(tmp_path_factory):
    """The artefact, and a day of which the bearing is 15 K warmer within ten minutes: loads begin after an hour."""
    out = tmp_path_factory.mktemp("bearing")
    machine = with_bearing(out / "machine", 1.6)
    twin("build", machine, "-o", out / "m.h5")
    twin("simulate", machine, loads(out / "day", 0), "-o", out / "shown", "--noise", "0.05 K")
    return read_artefact(out / "m.h5"), read_run(out / "shown")


def test_what_the_machine_does_itself_is_no_fault(spindle):
    artefact, run = spindle
    (told,) = judge([run], sensors=artefact.model.all_sensors).findings
    assert set(told.channels) == {"motor", "bearing"}
    assert judge_beside(artefact, [run]).findings == ()


def test_what_it_does_not_stays_one(spindle):
    artefact, run = spindle
    bad = damaged(run, Damage("sensor", "sensors.column", 6.0, "offset", start=4 * HOUR))
    found = judge_beside(artefact, [bad]).findings
    assert [(f.what, f.channels) for f in found] == [("leap", ("column",))]
    swapped = damaged(run, Damage("sensor", "sensors.bearing", np.nan, "swapped", other="sensors.bed"))
    (pair,) = judge_beside(artefact, [swapped]).findings
    assert pair.what == "swapped"
    assert "bed" in pair.channels  # motor and bearing are much alike

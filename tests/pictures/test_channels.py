"""The picture of measured beside computed: a panel per channel, what is wrong first, readings set aside in sight."""

from __future__ import annotations

import numpy as np
import pytest

from twin.logs.trace import Trace
from twin.pictures.channels import ASIDE, channel_figure, shown, write_channels

TIME = np.arange(0.0, 7200.0, 300.0)


def trace(channel="PT01", run="monday", unit="degC", off=0.1, wrong=""):
    computed = (20.0 if unit == "degC" else 0.0) + np.linspace(0.0, 5.0, len(TIME)) * (1.0 if unit == "degC" else 1e-6)
    logged = computed + off
    return Trace(run, channel, unit, TIME, logged, logged.copy(), computed, wrong)


def test_rms_is_of_what_was_compared():
    t = trace(off=0.3)
    assert t.rms == pytest.approx(0.3)
    t.used[5:] = np.nan
    t.logged[5:] = 850.0
    assert t.rms == pytest.approx(0.3)
    assert t.as_logged.sum() == 5
    t.used[:] = np.nan
    assert np.isnan(t.rms)


def test_a_correction_is_no_reading_as_logged():
    t = trace()
    t.used[3] += 2.0
    assert not t.as_logged[3]
    assert t.as_logged.sum() == len(TIME) - 1


def test_what_is_wrong_comes_first_then_displacements_then_what_is_met_worst():
    traces = [trace("a", off=0.1), trace("b", off=0.5), trace("dx", unit="m", off=1e-6), trace("c", wrong="noise")]
    assert [group[0].channel for group in shown(traces)] == ["c", "dx", "b", "a"]
    many = [trace(f"t{k}") for k in range(200)]
    assert 1 < len(shown(many)) < len(many)


def test_a_reading_set_aside_is_drawn_and_does_not_flatten_the_rest(tmp_path):
    bad = trace("PT05", wrong="rests at 850 degC")
    bad.logged[10:] = 850.0
    bad.used[10:] = np.nan
    drawn = channel_figure([bad, trace("PT05", run="tuesday"), trace("dx", unit="m", off=1e-6)])
    panels = [a for a in drawn.axes if a.get_visible()]
    assert [a.get_title(loc="left").split(" ")[0] for a in panels] == ["PT05", "dx"]
    assert panels[0].get_title(loc="left").endswith("!")
    assert panels[0].get_ylim()[1] < 40.0
    aside = [line for line in panels[0].lines if line.get_color() == ASIDE]
    assert sum(int(np.isfinite(line.get_ydata()).sum()) for line in aside) > 0
    hours = max(float(np.max(line.get_xdata())) for line in panels[0].lines)
    assert hours > 3.5  # tuesday follows monday
    write_channels(tmp_path / "channels.png", [bad])
    assert (tmp_path / "channels.png").read_bytes()[:4] == b"\x89PNG"

"""Peaks declared as rms and the reverse: evidence from names, signs, limits, and a second channel."""

from __future__ import annotations

import numpy as np
import pytest

from tests.logs.test_check import Signal
from twin.logs.check import check_run
from twin.logs.run import Run, Table

TIME = np.arange(300.0)
RMS = np.minimum(12.0, 7.0 + 6.0 * np.sin(TIME / 20.0) ** 2 + 0.1 * np.random.default_rng(0).random(300))
ROOT = np.sqrt(2.0)


def told(columns: dict[str, np.ndarray], *signals: Signal) -> list[str]:
    return [p.what for p in check_run(Run(Table(TIME, columns, dict.fromkeys(columns, "A"))), signals)]


def signal(column: str, kind: str, high: float = 12.0) -> Signal:
    return Signal(column, column, "A", kind, 0.0, high)


@pytest.mark.parametrize(("kind", "factor"), [("rms", 1.0), ("peak", ROOT)])
def test_what_is_declared_right_is_silent(kind, factor):
    assert told({"x_current": factor * RMS}, signal("x_current", kind)) == []


def test_a_current_that_rests_at_the_other_limit():
    what = told({"x_current": ROOT * RMS}, signal("x_current", "rms"))
    assert any("rests at 16.97 A, sqrt 2 times the 12 A that it is certified for as rms" in w for w in what)
    (what,) = told({"x_current": RMS}, signal("x_current", "peak"))
    assert "rests at 12 A, its limit as rms, and is declared as peak" in what


@pytest.mark.parametrize(
    ("column", "kind", "says"),
    [
        ("x_current_peak", "rms", "is called peak and declared as rms"),
        ("x_Iq", "rms", "is called peak and declared as rms"),
        ("x_I_eff", "peak", "is called rms and declared as peak"),
        ("x_current", "rms", ""),
        ("x_peaked", "rms", ""),
    ],
)
def test_names_that_contradict_the_kind_are_told(column, kind, says):
    # below every limit, so that names alone speak
    what = told({column: 0.5 * RMS}, signal(column, kind))
    assert [says in w for w in what] == ([True] if says else [])


def test_an_rms_value_has_no_sign():
    signed = 0.5 * RMS * np.sign(np.sin(TIME / 15.0))
    what = told({"x_current": signed}, signal("x_current", "rms"))
    assert any("declared as rms and negative" in w for w in what)


def test_two_channels_of_one_drive():
    what = told({"x_current": 0.5 * RMS, "x_limit": 0.5 * ROOT * RMS})
    assert what == ["'x_limit' is sqrt 2 times 'x_current' in every row: the one is the peak of the other"]
    assert told({"x_current": 0.5 * RMS, "y_limit": 0.5 * ROOT * RMS}) == []  # of different drives

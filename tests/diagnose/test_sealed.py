"""What the sealed runs refute is withdrawn, and something is left to be explained."""

from __future__ import annotations

import twin.run.jax_setup  # noqa: F401  isort: skip

import sys

from tests.diagnose import small_case
from twin.diagnose.faults.catalogue import FAMILIES
from twin.diagnose.result.diagnosis import Gain
from twin.diagnose.search.forward import search
from twin.diagnose.search.sealed import judged
from twin.diagnose.search.verdict import verdict_of


def test_a_name_that_makes_the_sealed_run_worse_is_withdrawn(monkeypatch):
    detector = small_case.made_detector()
    found = search(detector, small_case.source_off(4.5)[1])
    verdict, causes = verdict_of(found, FAMILIES)
    assert verdict == "out_of_tolerance"
    (cause,) = causes

    def opened(gain: float) -> tuple[str, int, str]:
        """gain: share of a sensor's error that the cause takes from it in the sealed run."""
        table = (Gain("sealed", "housing", "K", 1.0, 1.0, 1.0 - gain, (gain - 0.1, gain + 0.1), True),)
        monkeypatch.setattr(sys.modules[judged.__module__], "gains", lambda *_: table)
        told = judged(found, verdict, causes, FAMILIES, [detector.study.runs[2].measured], 1)
        return told.verdict, len(told.extension), told.note

    assert opened(0.5)[:2] == ("out_of_tolerance", 1)
    refuted, extension, note = opened(-0.5)
    assert (refuted, extension) == ("unknown", 0)
    assert cause.place in note

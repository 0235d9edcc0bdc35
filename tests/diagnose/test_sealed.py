"""What the sealed runs refute is withdrawn; what is left of it depends on what had passed before."""

from __future__ import annotations

import twin.run.jax_setup  # noqa: F401  isort: skip

import sys
from dataclasses import replace

import numpy as np

from tests.diagnose import small_case
from twin.diagnose.faults.catalogue import FAMILIES
from twin.diagnose.result.diagnosis import Gain
from twin.diagnose.search.forward import search
from twin.diagnose.search.sealed import judged
from twin.diagnose.search.verdict import verdict_of


def test_a_refuted_name_leaves_nothing_where_nothing_had_passed_its_threshold(monkeypatch):
    detector = small_case.made_detector()
    study = detector.study
    x = np.zeros(len(study.probed.parameters))
    x[next(i for i, p in enumerate(study.probed.parameters) if p.kind == "source")] = 4.5
    found = search(detector, np.concatenate([study.outputs(k, x) for k in study.fitted]))
    verdict, causes = verdict_of(found, FAMILIES)
    assert verdict == "out_of_tolerance"
    (cause,) = causes

    def opened(gain: float, observed: float) -> tuple[str, int, str]:
        """gain: share of a sensor's error that the cause takes from it in the sealed run."""
        table = (Gain("sealed", "housing", "K", 1.0, 1.0, 1.0 - gain, (gain - 0.1, gain + 0.1), True),)
        monkeypatch.setattr(sys.modules[judged.__module__], "gains", lambda *_: table)
        first = replace(found.steps[0], observed={cause.family: observed})
        told = judged(
            replace(found, steps=(first, *found.steps[1:])), verdict, causes, FAMILIES, [study.runs[2].measured], 1
        )
        return told.verdict, len(told.extension), told.note

    threshold = detector.thresholds[cause.family]
    assert opened(0.5, 2.0 * threshold)[:2] == ("out_of_tolerance", 1)
    refuted, extension, note = opened(-0.5, 2.0 * threshold)
    assert (refuted, extension) == ("unknown", 0)
    assert cause.place in note
    assert opened(-0.5, 0.5 * threshold)[:2] == ("nothing", 0)

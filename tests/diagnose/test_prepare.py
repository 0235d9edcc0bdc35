"""What a cached detector belongs to."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.build.test_cache_codec import equal
from tests.diagnose import small_case
from twin.build.cache_file import read_entry, write_entry
from twin.diagnose import pipeline as diagnose
from twin.diagnose.faults.catalogue import FAMILIES
from twin.diagnose.model.probed_model import ProbedModel
from twin.diagnose.search.detector import instruments_of, make_detector, stored
from twin.diagnose.search.policy import POLICY

pytestmark = pytest.mark.long


@pytest.fixture
def keys(monkeypatch):
    """The keys that detectors are looked for by; none is made."""
    seen = []

    def cached(stage, module, inputs, make):
        seen.append(inputs)
        raise InterruptedError

    monkeypatch.setattr(diagnose, "cached", cached)
    return seen


def turned(probed: ProbedModel) -> ProbedModel:
    """The same machine in coordinates of the other sign."""
    (body,) = probed.base.bodies
    return replace(probed, B=-probed.B, base=replace(probed.base, bodies=(replace(body, B=-body.B, C=-body.C),)))


def test_a_detector_belongs_to_the_coordinates_it_was_made_in(keys, monkeypatch):
    """A window that is made anew, on other cores, may have others; at the reference temperature all starts are zero."""
    runs, make = small_case.runs(), diagnose.make_probed_model
    for other in (None, None, turned):
        if other is not None:
            monkeypatch.setattr(diagnose, "make_probed_model", lambda *given: turned(make(*given)))
        with pytest.raises(InterruptedError):
            diagnose.prepare(small_case.machine(), runs[:2], runs[2:], diagnose.Settings())
    first, again, apart = keys
    assert first == again != apart


def test_a_detector_comes_back_from_its_entry_as_it_was_made(tmp_path):
    study = small_case.study()
    made = make_detector(study, FAMILIES[:4], instruments_of(study, 0.05, 0.3e-6), POLICY, counts=(2, 4))
    write_entry(tmp_path / "entry.npz", stored(made), 10**9)
    read = read_entry(tmp_path / "entry.npz").of(study, POLICY)
    assert equal(stored(read), stored(made))
    assert read.study is read.fitter.study is read.whiten.study is study

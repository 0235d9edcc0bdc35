"""Detection limits of declared numbers, which calibration sees as well."""

from __future__ import annotations

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.diagnose.evidence.batch import Batch
from twin.diagnose.evidence.sight import sight
from twin.diagnose.faults.table import fault_of
from twin.diagnose.search.accepted import parameter_of, settled
from twin.diagnose.search.limits import deviations_needed, limits_at, seen_from
from twin.diagnose.search.loose import Freed, loose_ones, variance_of

pytestmark = pytest.mark.long


def informed(place: str) -> tuple[Batch, int, np.ndarray, int]:
    """Of a declared number: its batch, its number there, the information (h,) of its histories, and its parameter."""
    detector = small_case.made_detector()
    f, _, projector = detector.fitter.linear(np.zeros(len(detector.study.probed.parameters)))
    for own in sight(detector.columns, projector, np.zeros(len(f))).ready:
        if fault_of(own.batch).declared and place in own.batch.places:
            p, j = own.batch.places.index(place), parameter_of(detector.study, place)
            assert j is not None
            return own.batch, p, own.information[p], j
    raise AssertionError(place)


def out_of_tolerance(j: int, x: float, seed: int) -> bool:
    """Whether a machine whose parameter j lies so many prior standard deviations off is seen to, others drawn."""
    detector, rng = small_case.made_detector(), np.random.default_rng(seed)
    study = detector.study
    there = 0.5 * rng.standard_normal(len(study.probed.parameters))
    there[j] = x
    y = np.concatenate([study.outputs(k, there) for k in study.fitted])
    y += detector.whiten.colour(rng.standard_normal(len(y)))
    own = loose_ones(detector, y, detector.fitter(y), settled(detector, y, ())[0], Freed())
    return j in [loose.index for loose in own]


@pytest.mark.parametrize("place", ["sources.front", "sources.nut", "materials.steel.expansion"])
def test_a_declared_number_is_seen_from_its_limit_on(place):
    detector = small_case.made_detector()
    batch, p, information, j = informed(place)
    (size,) = seen_from(detector, batch, p, information, batch.histories)
    assert size < 0.6 * deviations_needed(detector, batch) / np.sqrt(information[0])  # by its statistic alone
    assert size == limits_at(detector)[batch.family, batch.unit, place, False]
    x = fault_of(batch).log_change(size)[0] / detector.study.scale[j]
    assert sum(out_of_tolerance(j, x, seed) for seed in range(8)) >= 7
    assert sum(out_of_tolerance(j, x / 3.0, seed) for seed in range(4)) <= 1


def test_losses_are_seen_by_calibration_where_their_statistics_say_at_no_size():
    """As factors, of which a source may have 5."""
    detector = small_case.made_detector()
    alone, seen = [], []
    for name in ("nut", "motor", "front", "rear"):
        batch, _, information, _ = informed(f"sources.{name}")
        alone.append(np.exp(deviations_needed(detector, batch) / np.sqrt(information[0])))
        seen.append(np.exp(limits_at(detector)[batch.family, batch.unit, f"sources.{name}", False]))
    assert min(alone) == pytest.approx(5.6, abs=0.05)
    assert seen == pytest.approx([1.37, 2.24, 2.23, 4.95], abs=0.01)


def test_information_says_how_sure_calibration_is():
    """1 - v = s^2 I (module docstring of `limits`)."""
    detector = small_case.made_detector()
    _, _, information, j = informed("sources.front")
    fitted = detector.fitter(detector.fitter.surrogate.y0)
    certain = detector.study.scale[j] ** 2 * information[0]
    assert 1.0 - variance_of(fitted, j) == pytest.approx(certain, rel=1e-3)
    assert 0.1 < certain < 0.95


def test_a_number_that_switches_is_seen_by_its_statistic_alone():
    detector = small_case.made_detector()
    batch, p, information, _ = informed("contacts.flange")
    sizes = seen_from(detector, batch, p, information, batch.histories)
    windowed = np.array([bool(h.windows) for h in batch.histories])
    alone = deviations_needed(detector, batch) / np.sqrt(information)
    assert windowed.any()
    np.testing.assert_array_equal(sizes[windowed], alone[windowed])

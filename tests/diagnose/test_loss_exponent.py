"""Friction whose heat goes with another power of the speed than described: of a source's form, and no cause."""

from __future__ import annotations

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.diagnose.evidence.loss_exponents import other_exponents
from twin.diagnose.evidence.nulls import Form, emitted
from twin.diagnose.evidence.speeds import log_speed, relative_speed, rubs
from twin.diagnose.faults.catalogue import FAMILIES
from twin.diagnose.search.forward import search
from twin.diagnose.search.verdict import verdict_of


def number(source: str) -> int:
    return [s.name for s in small_case.study().probed.base.load_model.sources].index(source)


def steeper(exponent: float) -> np.ndarray:
    """(m,) without noise, where the friction of the front bearing goes with so much more of an exponent of its speed,
    and is as described at the mean of its logarithm."""
    study, j, parts = small_case.study(), number("front"), []
    x = np.zeros(len(study.probed.parameters))
    for k in study.fitted:
        slots = study.slots(k)
        slots.forcing[:, 0] = np.expm1(exponent * log_speed(study, k, j))[:, None] * emitted(study, k, j)
        parts.append(study.outputs(k, x, slots, (1.0,)))
    return np.concatenate(parts)


def test_another_exponent_is_what_a_little_more_of_it_does():
    """In standard deviations; of sources that read speeds alone, each for itself."""
    study, form = small_case.study(), Form()
    found = other_exponents(study, form)
    change = (steeper(1e-3) - steeper(0.0)) / 1e-3
    rubbing = [s.name for j, s in enumerate(study.probed.base.load_model.sources) if rubs(study, j)]
    assert rubbing == ["front", "rear", "nut"]
    assert len(found) == len(rubbing)
    limit = 2e-3 * np.abs(change).max()
    np.testing.assert_allclose(found[0].known[:, 0], form.loss_exponent * change, rtol=0.0, atol=limit)
    drawn = [found[0].drawn(np.random.default_rng(seed), np.zeros(len(study.scale))) for seed in range(400)]
    np.testing.assert_allclose(np.std(drawn, axis=0), np.abs(found[0].known[:, 0]), rtol=0.15, atol=1e-12)


def test_speeds_are_of_the_largest_of_the_fitted_runs_and_say_nothing_at_rest():
    study, j = small_case.study(), number("front")
    speeds = relative_speed(study, ["spindle_speed"])
    logs = [log_speed(study, k, j) for k in study.fitted]
    assert max(float(speeds[k].max()) for k in study.fitted) == 1.0
    assert abs(sum(speeds[k] @ log for k, log in zip(study.fitted, logs, strict=True))) < 1e-9
    for k, log in zip(study.fitted, logs, strict=True):
        rest = speeds[k] == 0.0
        assert not log[rest].any()
        np.testing.assert_allclose(np.exp(log[~rest] - log.max()), speeds[k][~rest] / speeds[k].max())


@pytest.mark.long
@pytest.mark.parametrize(("exponent", "verdicts"), [(0.3, {"nothing"}), (1.0, {"named", "ambiguous"})])
def test_a_little_more_of_it_is_no_cause_and_much_more_is(exponent, verdicts):
    """Without the column an exponent 0.15 larger has a statistic of some 800, of 36 that are needed."""
    detector, rng = small_case.made_detector(), np.random.default_rng(3)
    y = steeper(exponent)
    verdict, causes = verdict_of(search(detector, y + detector.whiten.colour(rng.standard_normal(len(y)))), FAMILIES)
    assert verdict in verdicts
    assert all((c.family, c.place) == ("loss_law", "sources.front") for c in causes)

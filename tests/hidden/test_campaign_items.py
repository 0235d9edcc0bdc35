"""The trials of a campaign, in the order in which they are made."""

from __future__ import annotations

from tests.hidden.trials import EXPERIMENT
from twin.inject.draw.trial import FAMILIES, part_of
from twin.inject.judge.items import EACH, NULLS, items

FIRST = 5800


def test_what_has_no_size_is_tried_once():
    seeds = range(FIRST, FIRST + EACH)
    seed = next(s for s in seeds if part_of(EXPERIMENT, "sensor", 1.0, s).hidden[0].history == "stuck")
    tried = {(family, size) for family, size, s in items(EXPERIMENT, ["heat_source", "sensor"], FIRST) if s == seed}
    assert ("sensor", 1.0) in tried
    assert not {("sensor", 0.5), ("sensor", 2.0)} & tried
    assert {("heat_source", 0.5), ("heat_source", 1.0), ("heat_source", 2.0)} <= tried


def test_every_trial_is_made_once_and_families_that_cannot_be_drawn_are_left_out():
    found = items(EXPERIMENT, ["coarse_model", "heat_source"], FIRST)
    assert len(set(found)) == len(found)
    assert {family for family, _, _ in found} <= {*FAMILIES}
    assert sum(family == "null" for family, _, _ in found) == NULLS

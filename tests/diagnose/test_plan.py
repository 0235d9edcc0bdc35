"""The plan of the next experiment: what adds to the information of today, for which suspicions, by which names."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.diagnose.made_up import planned
from tests.diagnose.small_case import NOISE, machine, made_detector, runs
from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.faults.catalogue import FAMILIES
from twin.diagnose.plan.plan import Basis, make_plan
from twin.diagnose.plan.suspicion import known_family, known_suspicions, named, worst_of_machine
from twin.diagnose.report.plan import plan_lines, plan_section
from twin.diagnose.result.plan import Foresight, Plan
from twin.diagnose.search.limits import limits_of
from twin.errors import TwinError

pytestmark = pytest.mark.long

ASKED = ("heat_source bed", "heat_source slide", "joint contacts.screw_bearing", "coolant bed", "sensor sensors.front")


def hypothesis(place: str, amplitude: float) -> Hypothesis:
    """Heat at a place, always, as a search would have found it."""
    batch = next(b for b in made_detector().columns.batches if b.family == "heat_source")
    return Hypothesis(batch, batch.places.index(place), batch.histories[0], 200.0, (amplitude,))


@cache
def plan() -> Plan:
    detector = made_detector()
    suspicions = [s for text in ASKED for s in named(text, detector)]
    pairs = [(hypothesis("bearing_front", 9.0), hypothesis("shaft", 9.0))]
    return make_plan(detector, machine(), runs()[:2], suspicions, pairs, NOISE)


def of(family: str, place: str) -> Foresight:
    return next(f for f in plan().suspicions if (f.family, f.place) == (family, place))


def test_todays_limits_are_those_of_the_diagnosis():
    detector = made_detector()
    for limit in limits_of(detector):
        sizes = [s for s in known_suspicions(detector) if (s.family, s.unit) == (limit.family, limit.unit)]
        assert limit.place in {s.place for s in sizes}
    today = {(f.family, f.place, f.unit): f.today for f in plan().suspicions}
    for family, place in (("heat_source", "bed"), ("coolant", "bed")):  # one goes on, the other switches
        (suspicion,) = named(f"{family} {place}", detector)
        assert today[family, place, suspicion.unit] == pytest.approx(known_suspicions(detector)[suspicion])


def test_one_more_run_never_tells_less_and_the_best_comes_first():
    for f in plan().suspicions:
        gains = [p.gain for p in f.proposals]
        assert gains == sorted(gains, reverse=True)
        assert gains[-1] > 1.0 - 1e-9
        assert f.again <= f.today * (1.0 + 1e-9)
        assert {"x to and fro", "long rest", "warm start", "again"} <= {p.experiment for p in f.proposals}


def test_a_sensor_where_heat_is_suspected_helps_most_and_one_far_away_as_much_as_none():
    bed = of("heat_source", "bed")
    sensors = [p for p in bed.proposals if p.experiment.startswith("sensor")]
    assert sensors[0].experiment == "sensor at bed"
    assert bed.proposals[0].gain > 1.5
    assert sensors[-1].limit == pytest.approx(bed.again, rel=0.1)


@pytest.mark.slow
def test_what_switches_is_seen_in_the_hours_that_the_new_run_has_of_it():
    coolant = of("coolant", "bed")
    assert coolant.switches
    assert coolant.again < 0.9 * coolant.today  # the same hours once more
    assert not of("heat_source", "bed").switches


def test_an_hour_of_the_new_run_is_one_in_however_many_runs_something_acts():
    first, other = ("heat", "bed", 0), ("heat", "bed", 60)
    basis = Basis((4, 5, 6, 7), (first, other, first, None))
    spread = basis.spread(np.arange(4, 8), np.array([[1.0, 0.0, 2.0, 3.0], [0.0, 5.0, 1.0, 0.0]]))
    assert spread[:, :4].tolist() == [[1.0, 0.0, 2.0, 3.0], [0.0, 5.0, 1.0, 0.0]]
    assert spread[0, 4:].tolist() == [0.0, 0.0, 2.0, 0.0]  # the stronger one; what goes on has no hour
    assert spread[1, 4:].tolist() == [0.0, 5.0, 0.0, 0.0]  # that hour is the first amplitude's


def test_a_sensor_between_two_causes_separates_them():
    (apart,) = plan().pairs
    assert (apart.first, apart.second) == ("heat_source bearing_front", "heat_source shaft")
    best = apart.separations[0]
    assert best.expected > apart.today
    assert best.experiment in ("sensor at bearing_front", "sensor at shaft")
    assert best.expected >= max(s.expected for s in apart.separations)


def test_names_are_those_of_report_json_and_the_nearest_one_is_told():
    detector = made_detector()
    (worst,) = named("heat_source", detector)
    assert known_suspicions(detector)[worst] == max(
        size for s, size in known_suspicions(detector).items() if s.family == "heat_source"
    )
    assert {s.unit for s in named("sensor sensors.front", detector)} == {"K", "K/day", "s", "1"}
    with pytest.raises(TwinError, match="did you mean 'heat_source'"):
        named("heat_sorce bed", detector)
    with pytest.raises(TwinError, match="did you mean 'bearing_front'"):
        named("heat_source bearing_fron", detector)
    with pytest.raises(TwinError, match="did you mean 'heat_source'"):
        known_family("heat_sorce", FAMILIES)
    with pytest.raises(TwinError, match="no detection limit"):
        named("coarse_model", detector)  # which is no cause


def test_without_a_name_each_family_of_the_machine_has_its_worst_place():
    chosen = worst_of_machine(made_detector(), FAMILIES)
    assert {"heat_source", "film_gain", "joint", "coolant"} <= {s.family for s in chosen}
    assert not {"sensor", "signal", "slip", "measurement"} & {s.family for s in chosen}
    assert len({(s.family, s.unit) for s in chosen}) == len(chosen)


def test_a_terminal_gets_a_table_by_gain_and_the_page_a_section():
    lines = plan_lines(replace(planned(), pairs=()))
    assert (
        lines[0]
        == "Next experiment for heat_source bed.left: detection limit 40.0 W today, 20.0 W with the longest run again"
    )
    assert lines[1].split()[:4] == ["8.00", "x", "5.00", "W,"]
    assert "detection limit above 5.00 times the declared today" in lines[3]
    html = plan_section(planned())
    assert html.count("<details>") == 4
    assert "sensor at bed.left" in html
    assert "the same noise" in html
    assert plan_section(None) == ""

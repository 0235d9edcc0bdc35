"""The figures of a campaign, counted by hand on made-up trials."""

from __future__ import annotations

import math

import pytest
from scipy.stats import binom

from tests.hidden.trials import EXPERIMENT
from twin.diagnose.faults.catalogue import FAMILIES
from twin.diagnose.result.diagnosis import Limit
from twin.inject.judge.figures import goals, lower, per_family, recovered, several, upper
from twin.inject.judge.match import Known, covered, effect, known_of, place_of, said, same_part, same_place, size_of
from twin.inject.judge.page import confusion, mistakes, page

TABLES = {"films": {"bed": {"surfaces": ["bed.*", "rail.*"]}}, "sources": {"x_motor": {"surface": "bed.x_motor"}}}
NAMES = tuple(f.name for f in FAMILIES)
PREDICTS = tuple(f.name for f in FAMILIES if f.group in ("machine", "signal"))
# every signal reaches 2; the bed carries a rail
KNOWN = Known(TABLES, {"bed": "bed", "rail": "other"}, lambda _signal: 2.0, NAMES, PREDICTS)


def hidden(family, place, size, unit, history="always", windows=(), signal="", exponent=1.0, **settings):
    return {"family": family, "place": place, "history": history, "size": size, "unit": unit, "windows": list(windows),
            "signal": signal, "exponent": exponent, "settings": settings}  # fmt: skip


def cause(family, place, amplitude, unit, half=0.0, history="always", rivals=()):
    return {"family": family, "place": place, "history": history, "amplitude": amplitude,
            "ci95": [amplitude - half, amplitude + half], "unit": unit, "statistic": 50.0, "threshold": 20.0,
            "rivals": list(rivals)}  # fmt: skip


FLAT = (1.0, 1.0, 1.0)  # recalibrated, extended, without what is hidden


def trial(family, truth=(), causes=(), verdict="named", factor=1.0, variance=FLAT, unknown=None, seconds=4.0):
    return {"family": family, "factor": factor, "seed": 0, "truth": list(truth), "verdict": verdict,
            "causes": list(causes), "unknown": unknown, "evidence": 0.0, "observed": {}, "variance": list(variance),
            "seconds": seconds}  # fmt: skip


HEAT = hidden("heat_source", "bed.left", 12.0, "W")
RESULTS = [
    *[trial("null", verdict="nothing") for _ in range(9)],
    trial("null", causes=[cause("film_gain", "films.bed", 1.3, "1")]),
    trial("null_law", verdict="nothing", variance=(1.2, 1.2, 1.2)),
    # right, half of the reducible variance recovered; interval holds the size
    trial("heat_source", [HEAT], [cause("heat_source", "bed.left", 11.0, "W", 2.0)], variance=(3.0, 2.0, 1.0)),
    # right, all recovered; interval too narrow
    trial("heat_source", [HEAT], [cause("heat_source", "bed.left", 9.0, "W", 1.0)],
          variance=(2.0, 1.0, 1.0), seconds=8.0),
    # another face of the part
    trial("heat_source", [HEAT], [cause("heat_source", "bed.right", 12.0, "W", 1.0)], factor=2.0),
    # ambiguous, with the truth among the rivals
    trial("heat_source", [HEAT], [cause("sun", "bed.left", 20.0, "W", rivals=[("heat_source", "bed.left")])],
          "ambiguous", 0.5),
    trial("heat_source", [HEAT], verdict="nothing", factor=0.5),
    trial("heat_source", [HEAT], verdict="unknown", unknown=["bed", "bed.left", 60.0], factor=0.5),
    {"family": "heat_source", "factor": 1.0, "seed": 3, "error": "ValueError: no"},
    trial("outside", [hidden("outside", "column.top", 25.0, "W")], verdict="unknown", unknown=["column", "", 90.0]),
    trial("outside", [hidden("outside", "column.top", 25.0, "W")], verdict="unknown", unknown=["bed", "", 90.0]),
    trial("two", [HEAT, hidden("sensor", "sensors.a", 1.0, "K", "offset")],
          [cause("sensor", "sensors.a", 1.0, "K", history="offset")]),
]  # fmt: skip
LIMITS = (Limit("heat_source", "bed.left", 6.0, 2.0, 9.0, "W"),)


def values(rows):
    return {row[0]: (row[1], row[3]) for row in rows}


def test_goals_are_counted_rightly():
    found = values(goals(RESULTS, LIMITS, KNOWN))
    assert found["false alarms"] == ("0.091", "1 of 11")
    assert found["false alarms: named"] == ("0.091", "1 of 11")
    assert found["false alarms of null_law"] == ("0.000", "0 of 1")
    assert found["false alarms, upper 95 % bound"][0] == f"{upper(1, 11):.3f}"
    assert found["family right, of detected"] == ("0.600", "3 of 5")
    assert found["family right or in the ambiguous set"] == ("0.800", "4 of 5")
    assert found["place right, of detected"] == ("0.400", "2 of 5")
    assert found["part right, of detected"] == ("0.600", "3 of 5")
    assert found["detected at nominal size"] == ("0.667", "2 of 3")
    assert found["detected at half size"] == ("0.667", "2 of 3")
    assert found["detected at twice size"] == ("1.000", "1 of 1")
    assert found["detected at twice the stated limit and more"] == ("0.833", "5 of 6")
    assert found["outside the catalogue: flagged unknown"] == ("1.000", "2 of 2")
    assert found["outside the catalogue: right part"] == ("0.500", "1 of 2")
    assert found["false unknown, cause in the catalogue"] == ("0.143", "1 of 7")
    assert found["size within its 95 % interval"] == ("0.500", "1 of 2")
    assert found["reducible held-out variance recovered (median)"] == ("0.750", "2")
    assert found["seconds per diagnosis, thresholds ready (median)"][0] == "4.0"


def test_failed_trials_stand_beside_their_figure():
    rows = {row[0]: row for row in goals(RESULTS, LIMITS, KNOWN)}
    assert rows["detected at nominal size"][4] == "1"
    assert rows["detected at half size"][4] == "0"
    (row,) = per_family(RESULTS, KNOWN)
    assert row[:9] == ["heat_source", "7", "1", "2 of 3", "2 of 3", "1 of 1", "3 of 5", "2 of 5", "3 of 5"]
    assert several(RESULTS, KNOWN) == [["two", "1", "0", "0 of 1", "1 of 1", "0 of 1"]]


def test_confusion():
    header, rows = confusion(RESULTS, KNOWN)
    table = {row[0]: dict(zip(header[1:], row[1:], strict=True)) for row in rows}
    assert table["heat_source"]["heat_source"] == "3"
    assert table["heat_source"]["error"] == "1"
    assert table["null"]["nothing"] == "9"
    assert table["null"]["film_gain"] == "1"
    assert table["outside"]["unknown"] == "2"
    assert said(RESULTS[14]) == "sun"


@pytest.mark.parametrize(("k", "n"), [(0, 200), (6, 200), (1, 11), (10, 11)])
def test_bounds_are_those_of_clopper_and_pearson(k, n):
    assert binom.cdf(k, n, upper(k, n)) == pytest.approx(0.05)
    if k:
        assert binom.sf(k - 1, n, lower(k, n)) == pytest.approx(0.05)
    assert (lower(0, n), upper(n, n)) == (0.0, 1.0)


def test_recovered_is_what_the_machine_without_the_effect_would_leave():
    assert recovered(trial("sun", variance=(3.0, 1.5, 1.0)), KNOWN) == pytest.approx(0.75)
    assert recovered(trial("sun", variance=(1.04, 0.9, 1.0)), KNOWN) is None  # hardly any
    assert recovered(trial("sensor", variance=(3.0, 1.5, 1.0)), KNOWN) is None  # not the machine
    unseen = hidden("zone", "environment.room", 2.5, "K", "in windows")
    assert recovered(trial("zone", [unseen], variance=(3.0, 1.5, 1.0)), KNOWN) is None  # nobody can foresee it


@pytest.mark.parametrize(
    ("truth", "place", "right", "part"),
    [
        (hidden("film_gain", "films.bed", 3.0, "1"), "films.bed", True, True),
        (hidden("film_gain", "films.bed", 3.0, "1"), "bed.left", False, True),
        (hidden("film_gain", "films.bed", 3.0, "1"), "column.left", False, False),
        (hidden("loss_law", "sources.x_motor", 2.0, "1"), "sources.y_motor", False, False),
        (hidden("initial_state", "runs.a", 1.5, "K", "offset", body="bed"), "runs.a.bed", True, True),
        (hidden("initial_state", "runs.a", 1.5, "K", "offset", body="bed"), "runs.a.rail", False, True),
        (hidden("initial_state", "runs.a", 1.5, "K", "offset", body="bed"), "runs.b.bed", False, False),
        (hidden("measurement", "tcp.dx", 2e-5, "1", "frame", axis="y"), "tcp.dx:y", True, True),
        (hidden("measurement", "tcp.dx", 2e-5, "1", "frame", axis="y"), "tcp.dx:x", False, True),
        (hidden("measurement", "tcp.dx", 2e-9, "m/s", "drift"), "tcp.dx", True, True),
        (hidden("not_thermal", "tcp.dz", 6e-7, "m/A", "load", signal="x_current"), "tcp.dz:x_current", True, True),
        (hidden("sensor", "sensors.b", 1.0, "1", "swapped", other="sensors.a"), "sensors.a<>b", True, True),
        (hidden("sensor", "sensors.b", 1.0, "1", "swapped", other="sensors.a"), "sensors.a<>c", False, False),
    ],
)
def test_places(truth, place, right, part):
    there = cause(truth["family"], place, 1.0, "1")
    assert same_place(truth, there, KNOWN) is right, place_of(truth)
    assert same_part(truth, there, KNOWN) is part


def test_sizes_are_compared_in_one_unit_or_not_at_all():
    day = cause("sensor", "sensors.a", 1.2, "K/day", 0.1, "drift")
    assert covered(hidden("sensor", "sensors.a", 1.2 / 86400, "K/s", "drift"), day, KNOWN) is True
    assert covered(hidden("sensor", "sensors.a", 1.2, "K", "offset"), day, KNOWN) is None
    # 10 W/(m^2 K) at 1 m/s with an exponent of 0.7 are 16.2 at 2 m/s
    wind = hidden("forced_convection", "bed.left", 10.0, "W/(m^2*K)", "v^0.7", (), "v", 0.7)
    blown = cause("forced_convection", "bed.left", 15.0, "W/(m^2*K)", 2.0, "v^0.6")
    assert size_of(wind, blown, KNOWN) == pytest.approx(10.0 * 2.0**0.7)
    assert effect(wind, KNOWN) == pytest.approx(10.0 * 2.0**0.7 / 1.0)
    assert covered(wind, blown, KNOWN) is True
    assert covered(wind, {**blown, "history": "u^0.6"}, KNOWN) is None
    # the size of a sun is that of the larger day
    days = [{"run": "a", "level": 0.8}, {"run": "b", "level": 1.2}, {"run": "sealed", "level": 1.3}]
    sun = hidden("sun", "bed.left", 50.0, "W", windows=days)
    assert size_of(sun, cause("sun", "bed.left", 60.0, "W", history="0 to 6 h of every run"), KNOWN) == pytest.approx(
        60.0
    )
    # in a window or always are two things
    window = hidden("heat_source", "bed.left", 12.0, "W", "in windows", days)
    assert size_of(window, cause("heat_source", "bed.left", 12.0, "W"), KNOWN) is None
    assert (
        size_of(window, cause("heat_source", "bed.left", 12.0, "W", history="from 1.0 h to 4.0 h of a"), KNOWN) == 12.0
    )
    assert size_of(hidden("signal", "signals.a", 0.5, "1", "factor"),
                   cause("signal", "signals.a", 0.5, "1", history="factor"), KNOWN) is None  # fmt: skip
    assert effect(hidden("joint", "contacts.a", 0.15, "1"), KNOWN) == pytest.approx(0.85)
    assert effect(hidden("loss_law", "sources.a", 0.5, "1"), KNOWN) == pytest.approx(math.log(2.0))


def test_mistakes_are_listed_with_what_was_said():
    rows = mistakes(RESULTS, KNOWN)
    assert [row[2:4] for row in rows] == [
        ["film_gain", "films.bed, always"],
        ["heat_source", "bed.right, always"],
        ["sun", "bed.left, always"],
        ["unknown", "bed"],
        ["error", "ValueError: no"],
    ]
    assert rows[0][0] == "null"
    assert rows[1][0] == "heat_source bed.left, always, 12 W"
    assert rows[1][4:] == ["12 W", "50"]


def test_limits_are_those_of_the_place_and_weak_effects_are_distinguished():
    weak = {**trial("heat_source", [HEAT], verdict="nothing"), "limits": [1.0], "present": 3.0}
    strong = {**trial("heat_source", [HEAT], [cause("heat_source", "bed.left", 12.0, "W")]), "limits": [7.0]}
    found = values(goals([weak, strong], LIMITS, KNOWN))
    assert found["detected at twice the stated limit and more"] == ("0.000", "0 of 1")  # 12 W at a limit of 1 W
    assert found["detected at nominal size"] == ("0.500", "1 of 2")
    assert found["detected at nominal size, of what the data show"] == ("1.000", "1 of 1")


def test_a_part_of_a_warm_body_is_the_right_place():
    truth = hidden("initial_state", "runs.diagnosis_2", 1.5, "K", "offset", body="carriage")
    shipped = known_of(EXPERIMENT)
    for part, right in (("carriage", True), ("table", True), ("bed", False)):
        assert same_place(truth, cause("initial_state", f"runs.diagnosis_2.{part}", 1.4, "K"), shipped) is right
    assert not same_place(truth, cause("initial_state", "runs.diagnosis_1.carriage", 1.4, "K"), shipped)
    assert shipped.top("spindle_speed") == max(run.loads.columns["spindle_speed"].max() for run in EXPERIMENT.runs)


def test_an_unfinished_campaign_has_its_tables():
    assert "| false alarms | - | - | 0 of 0 | 0 | <= 0.05 |" in page([], (), KNOWN, "five_axis")
    whole = page(RESULTS, LIMITS, KNOWN, "five_axis")
    assert "trials on five_axis, 1 of them failed (ValueError 1 times)" in whole
    for line in whole.splitlines():
        assert not line.startswith("|") or line.endswith("|")

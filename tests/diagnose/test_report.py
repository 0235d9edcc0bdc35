"""The report of a diagnosis: every verdict reads, nothing comes from outside, odd input does no harm."""

import json
import re
import tomllib
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from tests.calibrate import lumped_case
from tests.diagnose import small_case
from tests.diagnose.made_up import SENSOR, SIGNAL, STEP, STRAINED, diagnosis, heat, made_gains, planned, series
from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.extend import write_extension
from twin.diagnose.faults.catalogue import FAMILIES
from twin.diagnose.pipeline import Result
from twin.diagnose.report.page import page, plain, summary_lines, write_report
from twin.diagnose.report.recalibration import large
from twin.diagnose.report.residuals import load_rows, loudest, residual_map, with_gaps
from twin.diagnose.report.tables import families_table, gain_table, pulls_table, table
from twin.diagnose.report.text import (
    cause_evidence,
    cause_words,
    chance,
    evidence_sentence,
    gain_lines,
    limit_lines,
    pull_of,
    unknown_lines,
    verdict_sentence,
    when,
)
from twin.diagnose.result.diagnosis import VERDICTS, Cause, Diagnosis, Gain, Limit, Pull, Rival, Window
from twin.diagnose.result.numbers import customary, number, quantity, size_words
from twin.diagnose.search.accepted import Accepted
from twin.diagnose.search.forward import search
from twin.diagnose.search.gain import Channel, channels_of, gain_of
from twin.diagnose.search.policy import POLICY
from twin.diagnose.search.verdict import pulls_of, verdict_of
from twin.errors import TwinError

pytestmark = pytest.mark.long

SECTIONS = {"channels", "evidence", "gain", "residuals", "decision", "pulls", "limits", "notes"}  # of every page
VOID = {"meta", "br", "img", "hr", "link", "input"}


class Reader(HTMLParser):
    """Checks that tags are balanced and ids unique; keeps text, links and ids."""

    def __init__(self) -> None:
        super().__init__()
        self.open, self.ids, self.links, self.text, self.sections = [], [], [], "", []

    def handle_starttag(self, tag, attrs):
        self.handle_startendtag(tag, attrs)
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        for key, value in attrs:
            if key == "id":
                self.ids.append(value)
                if tag == "section":
                    self.sections.append(value)
            if key in ("href", "src", "xlink:href", "action", "data", "srcset"):
                self.links.append(value)
            assert not key.startswith("on"), f"{tag} has a handler {key}"
        assert tag not in ("script", "iframe", "object", "link", "b"), tag

    def handle_endtag(self, tag):
        assert self.open, f"</{tag}> closes nothing"
        assert self.open.pop() == tag, f"</{tag}> in {self.open}"

    def handle_data(self, data):
        if "style" not in self.open:
            self.text += data


def read(text: str) -> Reader:
    reader = Reader()
    reader.feed(text)
    reader.close()
    assert not reader.open
    assert len(reader.ids) == len(set(reader.ids))
    for link in reader.links:
        assert link.startswith(("#", "data:image/png;base64,")), link
        assert not link.startswith("#") or link[1:] in reader.ids, link
    assert not re.search(r"https?:|=\"//|url\(|@import", text)
    return reader


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Folder of a report per verdict."""
    folders: dict[str, object] = {}

    def get(verdict):
        if verdict not in folders:
            folder = tmp_path_factory.mktemp(verdict)
            write_report(diagnosis(verdict), folder)
            folders[verdict] = folder
        return folders[verdict]

    return get


SAID = {  # what the reader of each verdict must find
    "named": ("cause named", "85.0 W (95 % interval 80.2 to 89.7 W), following x_current²", "scale x: 11.30 µm/(m·K)"),
    "ambiguous": ("fit either missing heat source", "; or wrong loss law or coefficient", "71.0 W",
                  "To separate rivals: a sensor on bed.x_motor"),
    "unknown": ("part column, mostly at column.top", "its peak is 40 W (95 % interval 28 to 52 W)", "hydraulics"),
    "out_of_tolerance": ("Wrong declared values: sources.x_motor.gain is 1.620 (95 % interval 1.550 to 1.700) "
                         "instead of 1.00 (+2.2 prior standard deviations",
                         "sources.x_motor.gain (free of its tolerance)"),
    "sensor": ("sensor x_nut is at fault: drift, 0.81 K/day (95 % interval 0.70 to 0.92 K/day)",
               "The model of the machine is unchanged"),
    "signal": ("signal x_current is at fault: factor, 0.500", "0.480 to 0.520"),
    "too_poor": ("model is too poor",),
    "nothing": ("nothing else is missing that these data could show",
                "Detection limits (median location, probability 95 %):", "11.6 W",
                "3.40 W/(m²·K)", "0.310 K/day", "2.30 µm", "No family of causes passes its threshold"),
}  # fmt: skip


@pytest.mark.parametrize("verdict", VERDICTS)
def test_the_page_of_every_verdict_says_it_first_and_has_every_section(written, verdict):
    reader = read((written(verdict) / "index.html").read_text(encoding="utf-8"))
    sentence = verdict_sentence(diagnosis(verdict))
    assert reader.text.index(sentence) < reader.text.index("Evidence")
    for text in SAID[verdict]:
        assert text in reader.text, text
    assert set(reader.sections) == SECTIONS | ({"unknown"} if verdict == "unknown" else set())
    assert reader.sections[0] == ("limits" if verdict == "nothing" else "evidence")
    for shown in ("Residuals of run_1", "Residuals of sealed_run (sealed", "Measured and computed", "posterior sigma",
                  "largest of fault-free data", "Lag-1 autocorrelation"):  # fmt: skip
        assert shown in reader.text, shown
    assert ("Heat into column that nothing explains" in reader.text) == (verdict == "unknown")
    assert ("gain over recalibrated" in reader.text) == (verdict != "nothing")


@pytest.mark.parametrize("verdict", VERDICTS)
def test_report_json_is_the_diagnosis(written, verdict):
    folder = written(verdict)
    with open(folder / "report.json", encoding="utf-8") as f:
        found = json.load(f)
    assert found.pop("summary") == summary_lines(diagnosis(verdict))
    assert found == plain(diagnosis(verdict).to_json())
    assert found["verdict"] == verdict
    assert [c["amplitude"] for c in found["causes"]] == [c.amplitude for c in diagnosis(verdict).causes]
    assert len(found["nulls"]["heat_source"]) == 60
    assert sorted(p.name for p in folder.iterdir()) == ["index.html", "report.json"]


def test_report_json_has_the_keys_that_its_page_explains(written):
    """docs/diagnosis_report.md has a row per key; those of what a list or a table holds are told as key.inner."""
    with open(written("unknown") / "report.json", encoding="utf-8") as f:
        found = json.load(f)
    found["causes"] = plain(diagnosis("named").to_json())["causes"]
    found["causes"][0]["windows"] = plain(replace(diagnosis("named"), causes=(STEP,)).to_json())["causes"][0]["windows"]
    found["support"] = plain(diagnosis("named").to_json())["support"]
    found["plan"] = plain(replace(diagnosis("nothing"), plan=planned()).to_json())["plan"]
    assert {"place", "part", "surface", "history", "correlated_signals"} < found["unknown"].keys()
    assert found["unknown"]["place"] == "column.top"
    assert found["unknown"]["correlated_signals"][0] == ["hydraulics", 0.83]
    assert [limit["family"] for limit in found["detection_limits"]][:1] == ["heat_source"]
    page = (Path(__file__).parents[2] / "docs" / "diagnosis_report.md").read_text("utf-8")
    told = {key for row in re.findall(r"^\| (`[^|]*) \|", page, re.MULTILINE) for key in re.findall(r"`([^`]*)`", row)}
    free = {"nulls", "thresholds", "observed", "provenance", "unknown.history", "causes.settings"}  # keys are names
    assert told == set(keys(found, free))


def keys(value, free, path=""):
    """Paths of all keys of what JSON knows; what is `free` has names for keys."""
    if isinstance(value, list):
        for v in value:
            yield from keys(v, free, path)
    elif isinstance(value, dict) and path not in free:
        for key, v in value.items():
            yield (own := f"{path}.{key}".removeprefix("."))
            yield from keys(v, free, own)


@pytest.mark.parametrize("verdict", VERDICTS)
def test_a_terminal_gets_at_most_ten_lines_with_the_verdict(verdict):
    lines = summary_lines(diagnosis(verdict))
    assert len(lines) <= 10
    assert all(line and "\n" not in line for line in lines)
    assert verdict_sentence(diagnosis(verdict)) == lines[1]
    assert any("Detection limits (median" in line for line in lines) == (verdict in ("nothing", "too_poor"))
    assert any("machine is unchanged" in line for line in lines) == (verdict == "sensor")
    assert any("corrects the declaration" in line for line in lines) == (verdict == "signal")


def test_equal_diagnoses_give_equal_pages(written):
    assert page(diagnosis("sensor")) == (written("sensor") / "index.html").read_text(encoding="utf-8")


EVIL = '<b onclick="x">&$x_{1}$ "ü\' </svg><script>'


def odd() -> Diagnosis:
    """Names of all kinds, missing bins, many sensors, no TCP, one run, values that are not numbers."""
    rng = np.random.default_rng(1)
    s = series("run", rng, sensors=200)
    delivered = s.delivered.copy()
    delivered[5:9] = np.nan
    delivered[:, 7] = np.nan
    nothing = np.zeros((0, 3))
    s = replace(
        s, run=EVIL, sensors=tuple(f"{EVIL} {k}" for k in range(200)), delivered=delivered, extended=delivered * np.nan,
        time=np.concatenate([s.time[:20], s.time[20:] + 9000.0]), tcp_time=np.zeros(0), tcp_delivered=nothing,
        tcp_recalibrated=nothing, tcp_extended=nothing, sealed=True,
        loads={EVIL: s.loads["x_current"], "broken": s.time * np.nan},
    )  # fmt: skip
    d = diagnosis("ambiguous")
    rival = Rival(EVIL, EVIL, EVIL, np.nan, EVIL, np.nan, np.nan, EVIL)
    cause = heat(place=EVIL, parameter=EVIL, history=EVIL, amplitude=np.nan, ci95=(np.nan, np.inf), rivals=(rival,))
    gain = (
        Gain(EVIL, EVIL, "K", 1.0, np.nan, 0.3, (np.nan, np.nan), True),
        Gain(EVIL, "a", "K", 1.0, 0.5, 0.3, (0.1, 0.3), True),
    )
    return replace(
        d,
        machine=EVIL,
        causes=(cause,),
        pulls=(replace(d.pulls[0], path=EVIL, pull=np.nan, sigma=np.nan), replace(d.pulls[1], path=EVIL, pull=6.0)),
        detection_limits=(Limit(EVIL, EVIL, np.inf, np.nan, np.inf, "W"),),
        gain=gain,
        ranked=(*d.ranked[:3], rival),
        cosine=np.full((4, 4), np.nan),
        nulls={EVIL: np.array([np.nan, 1.0]), "zone": np.zeros(0)},
        thresholds={EVIL: 3.0, "zone": np.nan, "sun": 0.0},
        observed={EVIL: np.nan},
        whiteness=((EVIL, 0.9, np.nan), ("b", np.nan, np.nan)),
        series=(s,),
        notes=(EVIL,),
        provenance={EVIL: {"a": np.float64("nan"), "b": EVIL}},
    )


def test_odd_names_and_missing_values_neither_break_the_page_nor_leave_it(tmp_path):
    d = odd()
    write_report(d, tmp_path)
    reader = read((tmp_path / "index.html").read_text(encoding="utf-8"))
    assert reader.text.count(EVIL) >= 12  # whole, as text
    assert "160 sensors with smaller residuals are left out" in reader.text
    found = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    assert found["machine"] == EVIL
    assert found["summary"] == summary_lines(d)
    assert found["causes"][0]["amplitude"] is None
    assert found["causes"][0]["ci95"] == [None, None]
    assert len(summary_lines(d)) <= 10


@pytest.mark.parametrize("verdict", VERDICTS)
def test_a_diagnosis_that_holds_nothing_but_its_verdict_is_a_page(verdict):
    empty = replace(
        diagnosis(verdict), causes=(), pulls=(), detection_limits=(), unknown=None, gain=(), ranked=(),
        nulls={}, cosine=np.zeros((0, 0)), thresholds={}, observed={}, whiteness=(), series=(), notes=(), provenance={},
    )  # fmt: skip
    reader = read(page(empty))
    assert {"evidence", "gain", "notes"} <= set(reader.sections) < SECTIONS  # what has nothing to say is left out
    assert verdict_sentence(empty) in reader.text
    assert summary_lines(empty)[1:2] == [verdict_sentence(empty)]


def test_a_folder_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(TwinError, match="is a file"):
        write_report(diagnosis("nothing"), tmp_path / "file")


def test_units_are_those_of_engineers():
    assert quantity(12.34e-6, "m") == "12.3 µm"
    assert quantity(0.5 / 86400, "K/s") == "0.500 K/day"
    assert quantity(600.0, "s") == "10.0 min"
    assert quantity(12.0, "W/(m^2*K)") == quantity(12.0, "W/(m^2 K)") == quantity(12.0, "W/m^2/K") == "12.0 W/(m²·K)"
    assert quantity(11.5e-6, "1/K") == "11.5 µm/(m·K)"
    assert quantity(-0.0123, "1/K") == "-1.23 %/K"
    assert quantity(5000.0, "J/K") == "5.00 kJ/K"
    assert quantity(1e-6 / 3600, "m/s") == "1.00 µm/h"
    assert quantity(0.5, "m/s") == "30.0 m/min"
    assert quantity(-2.5, "K") == "-2.50 K"
    assert quantity(0.25, "1") == "0.250"
    assert customary("W/m^2") == (1.0, "W/m²")


def test_decimals_follow_the_interval():
    assert size_words(84.97, (80.2, 89.7), "W") == "85.0 W (95 % interval 80.2 to 89.7 W)"
    assert size_words(1234.4, (1100.0, 1400.0), "W") == "1230 W (95 % interval 1100 to 1400 W)"
    assert size_words(2.5e-6, (2.45e-6, 2.55e-6), "m") == "2.500 µm (95 % interval 2.450 to 2.550 µm)"
    assert size_words(-3.0, (-4.0, -2.0), "K") == "-3.0 K (95 % interval -4.0 to -2.0 K)"
    assert size_words(np.nan, (0.0, 1.0), "K") == ""
    assert number(-0.0001, 2) == "0.00"
    assert number(np.inf) == "∞"


@pytest.mark.parametrize(
    ("family", "unit", "settings", "wanted"),
    [
        ("loss_law", "1", {}, "1.62 times the declared"),
        ("misplaced_source", "1", {"surface": "bed.left"}, "1.62 times what it emits, which enters at bed.left"),
        (
            "coolant",
            "W/(m^2*K)",
            {"temperature": 14.0, "temperature_sigma": 0.5},
            "1.62 W/(m²·K), to a medium of 14.00 °C (95 % interval 13.02 to 14.98 °C)",
        ),
        ("scale_expansion", "1/K", {"part": "bed"}, "162 %/K, with the temperature of bed"),
        ("heat_source", "W", {"reference": 8.0, "reference_unit": "A"}, "1.62 W, at x_current = 8.00 A"),
    ],
)
def test_a_size_says_what_it_holds_for(family, unit, settings, wanted):
    cause = heat(family=family, unit=unit, settings=settings, amplitude=1.62, ci95=(np.nan, np.nan), rivals=())
    assert wanted in cause_words(cause)


@pytest.mark.parametrize(
    ("correlation", "wanted"),
    [(0.83, "goes with hydraulics (correlation +0.83)"), (-0.83, "goes against hydraulics (correlation -0.83)"),
     (-0.25, "No logged signal goes with the unexplained heat: hydraulics does most (correlation -0.25)")],
)  # fmt: skip
def test_what_unknown_heat_goes_with(correlation, wanted):
    d = diagnosis("unknown")
    (line,) = unknown_lines(replace(d, unknown=replace(d.unknown, correlated_signals=(("hydraulics", correlation),))))
    assert wanted in line


def test_heat_that_is_taken_away_leaves():
    d = diagnosis("unknown")
    time, power, sigma = d.unknown.history["run_1"]
    cold = replace(d, unknown=replace(d.unknown, history={"run_1": (time, tuple(-q for q in power), sigma)}))
    told = verdict_sentence(cold)
    assert "Heat leaves part column" in told
    assert "its peak is 40 W (95 % interval 28 to 52 W)" in told


def test_chance_counts_what_fault_free_data_gave():
    values = np.arange(1.0, 101.0)
    some, none = chance(values, 90.0), chance(values, 100.0)
    assert some.startswith("10 of 100 simulated fault-free data sets exceeded 90.0; the largest gave 100")
    assert "exceeded 100, so at most 1 in 33 machines within its tolerances would (95 % confidence)" in none  # 3 / n
    assert chance(np.zeros(0), 3.0) == chance(None, 3.0) == chance(values, np.nan) == ""
    d = replace(diagnosis("named"), nulls={"heat_source": values})
    assert evidence_sentence(d, "heat_source", 431.2, 95.0).startswith("The statistic is 431, its threshold 95.0.")
    assert "5 of 100 simulated fault-free data sets exceeded 95.0" in evidence_sentence(d, "heat_source", 431.2, 95.0)


def test_what_is_out_of_tolerance_leads_whatever_else_is_pulled():
    d = diagnosis("out_of_tolerance")
    assert max(d.pulls, key=lambda p: abs(p.pull)).path == "films.bed.gain"
    for text in (verdict_sentence(d), *summary_lines(d)):
        assert "films.bed" not in text
    text = read(page(replace(d, series=(), whiteness=(), ranked=(), gain=()))).text
    assert "12.6 standard deviations of its fit" in text
    table_of_pulls = pulls_table(d)
    assert table_of_pulls.index("sources.x_motor.gain (free") < table_of_pulls.index("films.bed.gain")
    assert "Wrong declared values: films.bed.gain is 3.00 instead of 1.00 (+4.6" in verdict_sentence(
        replace(d, causes=())
    )


def search_of_a_strong_source():
    """The null distribution of the small case, the number of a source among its parameters, and what is found where
    that source lies 4.5 sigma off."""
    detector = small_case.made_detector()
    study = detector.study
    source = next(i for i, p in enumerate(study.probed.parameters) if p.kind == "source")
    x = np.zeros(len(study.probed.parameters))
    x[source] = 4.5
    y = np.concatenate([study.outputs(k, x) for k in study.fitted])
    found = search(detector, y + 0.1 * detector.whiten.colour(np.random.default_rng(1).standard_normal(len(y))))
    return detector, source, found


def test_a_source_that_was_freed_is_the_pull_and_is_written_once(tmp_path):
    """As `twin diagnose` finds it: in the fit it stands at its declared value, and the size of the cause is told."""
    detector, source, found = search_of_a_strong_source()
    study, parameters = detector.study, detector.study.probed.parameters
    verdict, causes = verdict_of(found, FAMILIES)
    assert verdict == "out_of_tolerance"
    d = replace(diagnosis("out_of_tolerance"), causes=causes, pulls=pulls_of(found))
    pull, path = pull_of(d, causes[0]), parameters[source].path
    assert (pull.path, pull.freed) == (path, True)
    assert pull.pull == pytest.approx(4.5, abs=0.5)
    assert pull.value == pytest.approx(pull.nominal * causes[0].amplitude)
    assert 0.0 < pull.sigma < 1.0
    assert verdict_sentence(d).startswith(f"Wrong declared values: {path} is {pull.value / pull.nominal:.1f}")
    told = channels_of(found, 2, study.runs[2].measured, (np.ones(3), np.ones(3)))
    assert {g.run for g in told} == {study.runs[2].run.name}
    result = Result(replace(d, series=()), found, causes)
    write_extension(result, lumped_case.artefact(), small_case.machine(), (), tmp_path)
    written = tomllib.loads((tmp_path / "machine.toml").read_text("utf-8"))
    assert written["sources"][path.split(".")[1]]["gain"] == pytest.approx(pull.value, rel=1e-4)


def test_a_pull_of_a_conductance_is_a_relative_change_and_may_lie_beyond_its_bounds():
    detector, _, found = search_of_a_strong_source()
    batch = next(b for b in detector.columns.batches if b.kind == "contact")
    contact = next(p for p in detector.study.probed.parameters if p.path.startswith(f"{batch.places[0]}."))
    h = Hypothesis(batch, 0, next(w for w in batch.histories if not w.windows), 50.0, (-0.9,))
    lost = Accepted(h, (), np.array([-0.9]), np.array([[1e-4]]), 50.0, 36.0, ())
    pull = next(p for p in pulls_of(replace(found, accepted=(lost,))) if p.path == contact.path)
    assert pull.value == pytest.approx(0.1 * contact.nominal)
    assert pull.value < contact.low
    assert pull.pull == pytest.approx(np.log(0.1) / contact.sigma)
    assert pull.sigma == pytest.approx(0.1 / contact.sigma)


def test_chance_is_told_of_what_was_held_against_synthetic_measurements_alone():
    d = diagnosis("named")
    assert "simulated fault-free data sets" in cause_evidence(d, d.causes[0])
    stuck = Cause("sensor", "sensors.a", "", np.nan, (np.nan, np.nan), "K", np.inf, 0.0, "stuck",
                  windows=(Window("run_1", 0.0, 9000.0),))  # fmt: skip
    calibrated = replace(STRAINED, statistic=9.0, history="by calibration")
    for cause, told in (
        (stuck, "constant for 2.50 h"),
        (STRAINED, "12.6 standard deviations of its fit from the declared value; the threshold is 2.50"),
        (calibrated, "Calibration shifts it by 3.00 times the 97 % quantile of simulated fault-free data sets"),
    ):
        one = replace(diagnosis("out_of_tolerance"), causes=(cause,), series=(), whiteness=(), ranked=(), gain=())
        assert told in cause_evidence(one, cause)
        assert told in "".join(summary_lines(one))
        for word in ("at most 1 in", "The statistic is", *([] if cause is calibrated else ["simulated"])):
            assert word not in cause_evidence(one, cause)


def test_a_sensor_beside_does_not_lead_what_is_ambiguous_or_out_of_tolerance():
    for verdict, told in (
        ("ambiguous", "fit either missing heat"),
        ("out_of_tolerance", "values: sources.x_motor.gain"),
    ):
        d = diagnosis(verdict)
        text = verdict_sentence(replace(d, causes=(SENSOR, *d.causes)))
        assert told in text
        assert "; besides: sensor x_nut is at fault" in text


def test_other_faces_of_a_part_that_look_the_same_are_told():
    """Of the same part and family, where it takes a sensor to tell them; neither what the data tell nor other parts."""
    told = {"bed.left": "a sensor between", "bed.right": "", "column.left": "a sensor between"}
    rivals = tuple(
        Rival("heat_source", place, "always", 70.0, "W", 402.0, 0.99, remedy) for place, remedy in told.items()
    )
    text = verdict_sentence(replace(diagnosis("named"), causes=(heat(rivals=rivals),)))
    assert text.endswith(" (data cannot separate bed.x_motor from bed.left).")
    assert "cannot separate" not in verdict_sentence(replace(diagnosis("named"), causes=(heat(rivals=rivals[1:]),)))


def test_a_clock_that_is_off_changes_no_description():
    clock = replace(SIGNAL, place="runs.run_1", parameter="", history="clock", amplitude=120.0, unit="s")
    lines = summary_lines(replace(diagnosis("signal"), causes=(clock,)))
    assert "The model of the machine is unchanged." in lines


def test_a_channel_that_an_extension_makes_worse_than_it_was_delivered_is_told():
    """However bad the recalibrated model is: of a real spindle it left 27 um, where 5 were delivered, 7.5 extended."""
    rng, time = np.random.default_rng(4), 300.0 * np.arange(288.0)
    errors = [size * rng.standard_normal(len(time)) for size in (5e-6, 27e-6, 7.5e-6)]
    gain = gain_of(Channel("sealed", "dz", "m", time, errors, True), rng, POLICY)
    assert gain.ci95[0] > 0.0 > gain.ci95_delivered[1]
    d = replace(diagnosis("named"), gain=(gain, replace(gain, channel="dx", ci95_delivered=(-1e-6, 1e-6))))
    (line,) = gain_lines(d)
    assert " extended (root mean square" in line
    (refused,) = gain_lines(replace(d, notes=("withdrawn: missing heat source at bed. It explains nothing",)))
    assert " with what was withdrawn (root mean square" in refused
    assert line.endswith("significantly better in 2, worse in 0; worse than as delivered: dz.")
    assert gain_table(d).count("better, worse than as delivered") == 1


def test_every_sealed_run_is_distinguished():
    d = replace(diagnosis("named"), ranked=(), whiteness=(), pulls=(), nulls={})
    assert "sealed run</th>" not in gain_table(d)
    assert all(text.removeprefix("Sealed run: ")[:5] in ("4 tem", "2 TCP", "2 tem", "1 TCP") for text in gain_lines(d))
    rng = np.random.default_rng(3)
    d = replace(d, gain=(*d.gain, *made_gains("other_run")), series=(*d.series, series("other_run", rng, sealed=True)))
    assert gain_table(d).count("<td>other_run</td>") == gain_table(d).count("<td>sealed_run</td>") == 9
    d = replace(d, series=d.series[1:])
    text = read(page(d)).text
    for run in ("sealed_run", "other_run"):
        assert f"Residuals of {run} (sealed" in text
        assert f"Sealed run {run}: 4 temperatures that the causes move" in text
    assert any(line.startswith("Sealed run sealed_run: 4 temperatures") for line in summary_lines(d))
    assert {g["run"] for g in d.to_json()["gain"]} == {"sealed_run", "other_run"}


def test_windows_are_told():
    assert when(STEP) == "step; 4.0 h to 8.0 h of run_1; 0.0 h to 1.0 h of run_2 at 0.5"
    assert when(SENSOR) == "drift"


def test_gaps_stay_gaps_in_a_map():
    edges, rows = with_gaps(np.array([1.0, 2.0, 3.0, 7.0, 8.0]), np.arange(10.0).reshape(5, 2))
    np.testing.assert_allclose(edges, [0.5, 8.5])
    assert np.isnan(rows[3:6]).all()
    np.testing.assert_array_equal(rows[6], [6.0, 7.0])
    assert residual_map(replace(diagnosis("named").series[0], time=np.zeros(0))) is None


def test_loads_that_vary_are_shown_as_shares():
    n = 100
    on = np.arange(n) % 20 < 10
    loads = {"current": 5.0 * on, "speed": -2.0 * on, "still": np.full(n, 20.0), "air": 20.0 + np.linspace(-1, 1, n)}
    names, rows = load_rows(loads)
    assert names == ["current", "speed", "air"]
    assert (rows.min(), rows.max()) == (0.0, 1.0)


def test_the_loudest_sensors_are_shown():
    s = series("run", np.random.default_rng(0), sensors=5)
    delivered = np.zeros_like(s.delivered)
    delivered[:, 3], delivered[:, 1], delivered[:, 0] = 2.0, 1.0, np.nan
    chosen = loudest(replace(s, delivered=delivered))
    assert (chosen[:2], chosen[-1]) == ([3, 1], 0)


def test_what_comes_nearest_to_its_threshold_leads_the_families():
    d = diagnosis("named")
    text = families_table(d)
    assert text.index("missing heat source") < text.index("wrong film coefficient")
    assert text.count("<tr>") == 1 + len({*d.observed, *d.thresholds, *d.nulls})


@pytest.mark.parametrize("verdict", ["nothing", "named"])
def test_no_gain_is_told_with_its_reason(verdict):
    d = replace(diagnosis(verdict), gain=())
    open_only = tuple(s for s in d.series if not s.sealed)
    assert len(open_only) < len(d.series)
    assert "no gain to report: no run was sealed." in read(page(replace(d, series=open_only))).text
    bare = tuple(replace(s, sealed=True) for s in open_only)
    assert "no gain to report: nothing was measured in the sealed run." in read(page(replace(d, series=bare))).text


def test_long_tables_are_cut_and_say_so():
    text = table(["a"], [[str(k)] for k in range(100)])
    assert text.count("<td>") == 60
    assert "40 more in report.json" in text


def test_nothing_says_first_what_calibration_had_to_change():
    d = diagnosis("nothing")
    runs = [replace(s, recalibrated=s.delivered, tcp_recalibrated=s.tcp_delivered) for s in d.series]
    still = replace(d, series=tuple(runs))
    white = tuple((name, before, 0.0) for name, before, _ in d.whiteness)
    quiet = replace(still, whiteness=white)
    assert "the description explains them within their noise" in verdict_sentence(quiet)
    run = next(s for s in still.series if not s.sealed)
    moved = replace(run, recalibrated=run.delivered - 2.0, tcp_recalibrated=run.tcp_delivered - [0.0, 9e-6, 0.0])
    pull = Pull("sources.spindle.gain", 1.0, 1.35, 0.5, 1.4, "1", changes={"sensor_0": 2.0, "dy": 8e-6})
    text = verdict_sentence(replace(quiet, series=(moved,), pulls=(*d.pulls, pull)))
    assert "within their noise" not in text
    assert text.startswith("The description as delivered is wrong: calibration moved")
    assert "Nothing is missing" not in text
    for words in ("by 2.00 K", "dy by 9.00 µm", "most of it by sources.spindle.gain, 1.35"):
        assert words in text
    second = replace(pull, path="films.bed.gain", changes={"sensor_0": 0.6})
    small = replace(pull, path="films.table.gain", changes={"sensor_0": 0.4, "dy": 1e-6, "other": 3.0})
    text = verdict_sentence(replace(quiet, series=(moved,), pulls=(small, second, pull)))
    assert 0 < text.index("sources.spindle.gain") < text.index("films.bed.gain")
    assert "films.table.gain" not in text
    assert large((small, second, pull)) == [pull, second, small]
    assert large((replace(small, changes={"sensor_0": 0.4}), second)) == [second]
    unsure = replace(pull, sigma=0.8)
    text = verdict_sentence(replace(quiet, series=(moved,), pulls=(unsure,)))
    assert text.startswith("Within the tolerances of the description calibration moved")
    left = tuple((name, before, 0.5) for name, before, _ in d.whiteness)
    assert "lag-1 correlation 0.50" in verdict_sentence(replace(quiet, whiteness=left))


def test_limits_of_one_family_stand_together():
    limits = [
        Limit("film_gain", "films.bed", 3.3, 2.0, 9.0, "1"), Limit("film_gain", "bed", 7.0, 2.0, 9.0, "W/(m^2*K)"),
        Limit("heat_source", "bed", 26.0, 20.0, 30.0, "W"),
    ]  # fmt: skip
    said = "wrong film coefficient, 3.30 times the declared or 7.00 W/(m\u00b2\u00b7K); and missing heat source, 26.0 W"
    line = f"Detection limits (median location, probability 95 %): {said}."
    assert limit_lines(replace(diagnosis("nothing"), detection_limits=tuple(limits))) == [line]

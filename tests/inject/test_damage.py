"""Faults of logs: each does what it says, and nothing else."""

from __future__ import annotations

import math
import shlex
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.support.descriptions import MACHINES
from twin.cli.main import run as twin
from twin.diagnose.faults.catalogue import FAMILIES
from twin.diagnose.faults.readings import _within_set
from twin.errors import LogError, TwinError
from twin.inject.damage.channels import Damage
from twin.inject.damage.kinds import DAMAGES, damaged
from twin.inject.hide import hide
from twin.inject.request import SETTINGS, UNITS, Request, When
from twin.logs.read import read_run
from twin.logs.run import Run, Table, Tcp
from twin.logs.write import write_run
from twin.machine.load import load_machine

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "hiding.md").read_text(encoding="utf-8")
MACHINE = {path.parent.name: path.parent for path in MACHINES}
TIME = np.arange(0.0, 36000.0, 60.0)
ROWS = np.arange(0.0, 36000.0, 1800.0)
AT = np.tile([-0.2, 0.3], 10)  # m, of axis x


def a_run() -> Run:
    """Ten hours: a machine that warms, an air that swings, a current that is on for half of each hour."""
    current = np.where(TIME % 3600.0 < 1800.0, 8.0, 0.0)
    air = 20.0 + 2.0 * np.sin(TIME / 6000.0)
    a, b = 20.0 + 10.0 * (1.0 - np.exp(-TIME / 7200.0)), 20.0 + TIME / 7200.0
    displacement = np.outer(ROWS / 36000.0, [10e-6, -4e-6, 1e-6]) + 5e-6
    return Run(
        loads=Table(TIME, {"current": current, "air": air}, {"current": "A", "air": "degC"}),
        temperatures=Table(TIME, {"a": a, "b": b}, {"a": "degC", "b": "degC"}),
        tcp=Tcp(ROWS, ("x",), AT[:, None], displacement),
        initial_temperature=20.0,
    )


RUN = a_run()
A, B = (RUN.temperatures.columns[n] for n in "ab")
LATE, EARLY = TIME >= 14400.0, TIME < 14400.0
SETS = replace(RUN, tcp=replace(RUN.tcp, time=(ROWS[::4, None] + [0.0, 60.0, 300.0, 960.0]).ravel()))  # of 4 rows
SIZES = {"K": 0.6, "degC": 850.0, "s": 1200.0, "1": 0.5, "": math.nan, "m": 4e-6}
PLACES = {"sensor": "sensors.a", "signal": "signals.current", "initial_state": "run"}


def of_kind(family: str, history: str, **more) -> Damage:
    unit = DAMAGES[family][history].unit
    place = PLACES.get(family, "tcp.dx:x" if history == "frame" else "tcp.dx")
    signal = {"detached": "air", "load": "current"}.get(history, "")
    other = "sensors.b" if history in ("swapped", "elsewhere") else ""
    if history == "splice":
        place, more = "run", {"start": 14400.0, **more}
    return Damage(family, place, SIZES[unit], history, signal, other, **more)


def sensor(name: str, d: Damage) -> np.ndarray:
    return damaged(RUN, d).temperatures.columns[name]


@pytest.mark.parametrize(("family", "history"), [(f, h) for f, kinds in DAMAGES.items() for h in kinds])
def test_one_table_changes_and_is_told_to_be_computed(family, history):
    given = SETS if history == "heating" else RUN
    before = replace(a_run(), tcp=given.tcp)
    after = damaged(given, of_kind(family, history))
    tables = {"sensor": ("temperatures",), "signal": ("loads",), "initial_state": ()}.get(family, ("tcp",))
    tables = ("temperatures", "tcp") if history == "splice" else tables
    for name in ("loads", "temperatures", "tcp"):
        assert (getattr(after, name) is getattr(given, name)) == (name not in tables)
    assert after.synthetic == tables
    for name in ("a", "b"):  # pure: the run that is given stays
        assert np.array_equal(RUN.temperatures.columns[name], before.temperatures.columns[name])
    assert np.array_equal(RUN.loads.columns["current"], before.loads.columns["current"])
    assert np.array_equal(RUN.tcp.displacement, before.tcp.displacement)


def test_an_offset_from_a_time_on():
    after = sensor("a", of_kind("sensor", "offset", start=14400.0))
    assert np.array_equal(after[EARLY], A[EARLY])
    assert after[LATE] - A[LATE] == pytest.approx(0.6)


def test_a_drift_reaches_its_size_and_stays():
    after = sensor("a", of_kind("sensor", "drift", start=7200.0, end=14400.0)) - A
    assert after[TIME <= 7200.0] == pytest.approx(0.0)
    assert after[TIME == 10800.0] == pytest.approx(0.3)
    assert after[LATE] == pytest.approx(0.6)


def test_a_lagging_sensor_follows_a_ramp_by_its_time_constant():
    after = damaged(RUN, replace(of_kind("sensor", "lag"), place="sensors.b")).temperatures.columns["b"]
    behind = (B - after) * 7200.0  # s
    assert behind[0] == 0.0
    assert behind[-1] == pytest.approx(1200.0, rel=0.03)
    gaps = np.where((TIME > 9000.0) & (TIME < 12000.0), np.nan, B)
    run = replace(RUN, temperatures=replace(RUN.temperatures, columns={"b": gaps}))
    held = damaged(run, replace(of_kind("sensor", "lag"), place="sensors.b")).temperatures.columns["b"]
    assert np.array_equal(np.isnan(held), np.isnan(gaps))
    assert held[-1] == pytest.approx(after[-1], abs=1e-3)


def test_a_detached_sensor_shows_the_air_in_part():
    after = sensor("a", of_kind("sensor", "detached", start=14400.0))
    air = RUN.loads.columns["air"]
    assert after[LATE] == pytest.approx(0.5 * (A + air)[LATE])
    assert np.array_equal(after[EARLY], A[EARLY])


def test_a_stuck_sensor_keeps_its_value_for_a_time():
    after = sensor("a", of_kind("sensor", "stuck", start=14400.0))
    stuck = LATE & (TIME < 15600.0)
    assert set(after[stuck]) == {A[TIME == 14400.0][0]}
    assert np.array_equal(after[~stuck], A[~stuck])


def test_a_broken_sensor_is_noise_and_every_copy_of_it_the_same():
    d = of_kind("sensor", "noise", start=14400.0)
    wrong = sensor("a", d) - A
    assert not wrong[EARLY].any()
    assert np.mean(wrong[LATE]) == pytest.approx(1.2, abs=0.1)
    assert np.std(wrong[LATE]) == pytest.approx(0.6, abs=0.1)
    assert np.array_equal(sensor("a", d), sensor("a", d))


def test_a_sensor_at_a_rail_shows_one_value():
    after = sensor("a", of_kind("sensor", "rail", start=14400.0))
    assert set(after[LATE]) == {850.0}
    assert np.array_equal(after[EARLY], A[EARLY])


def test_spliced_rows_are_of_a_later_time_under_stamps_that_go_on():
    d = replace(of_kind("signal", "splice"), size=3600.0)
    after = damaged(RUN, d)
    first, lost = int(np.argmax(LATE)), 60  # rows of temperatures
    assert np.array_equal(after.temperatures.time, TIME[:-lost])
    assert np.array_equal(after.temperatures.columns["a"], np.concatenate([A[:first], A[first + lost :]]))
    kept = np.delete(np.arange(len(ROWS)), [8, 9])  # measured from 4 h on, every half hour
    assert np.array_equal(after.tcp.time, ROWS[:-2])
    assert np.array_equal(after.tcp.displacement, RUN.tcp.displacement[kept])
    assert np.array_equal(after.tcp.position, RUN.tcp.position[kept])
    for wrong, told in (
        (replace(d, start=-math.inf), "begin somewhere"),
        (replace(d, size=1e6), "no row"),
        (replace(d, place="signals.current"), "no such place"),
    ):
        with pytest.raises(LogError, match=told):
            damaged(RUN, wrong)
    with pytest.raises(LogError, match="nothing is measured"):
        damaged(replace(RUN, temperatures=None, tcp=None), d)


@pytest.mark.parametrize(("history", "other", "told"), [("swapped", A, "itself"), ("elsewhere", B, "mounted where it")])
def test_two_sensors(history, other, told):
    """Each with the other's name, or one where the other one is."""
    d = of_kind("sensor", history)
    assert np.array_equal(sensor("a", d), B)
    assert np.array_equal(sensor("b", d), other)
    with pytest.raises(LogError, match=told):
        damaged(RUN, replace(d, other="sensors.a"))


def test_signals():
    current = RUN.loads.columns["current"]
    assert np.array_equal(damaged(RUN, of_kind("signal", "factor")).loads.columns["current"], 0.5 * current)
    mean = damaged(RUN, replace(of_kind("signal", "averaged"), size=3600.0)).loads.columns["current"]
    assert mean == pytest.approx(4.0)  # the mean stays, its square does not
    late = damaged(RUN, of_kind("signal", "clock")).loads.columns["current"]
    assert np.array_equal(late[20:], current[:-20])
    assert set(late[:20]) == {8.0}


@pytest.mark.parametrize("place", ["run", "runs.monday"])
def test_the_clock_of_a_run_makes_all_that_is_measured_late(place):
    run = replace(RUN, folder=Path("runs/monday"))
    after = damaged(run, replace(of_kind("signal", "clock"), place=place))
    assert after.loads is run.loads
    assert after.temperatures.time - TIME == pytest.approx(1200.0)  # what was true then is stamped later: y(t - 1200 s)
    assert after.tcp.time - ROWS == pytest.approx(1200.0)
    assert np.array_equal(after.temperatures.columns["a"], A)
    assert np.array_equal(after.tcp.displacement, run.tcp.displacement)
    assert after.synthetic == ("temperatures", "tcp")
    with pytest.raises(LogError, match="whole run"):
        damaged(run, replace(of_kind("signal", "clock"), place=place, start=3600.0))
    with pytest.raises(LogError, match="nothing is measured"):
        damaged(replace(run, temperatures=None, tcp=None), replace(of_kind("signal", "clock"), place=place))


def test_a_stuck_sensor_is_free_again_at_the_end_of_the_fault():
    after = sensor("a", of_kind("sensor", "stuck", start=14400.0, end=15000.0))
    stuck = LATE & (TIME < 15000.0)
    assert set(after[stuck]) == {A[TIME == 14400.0][0]}
    assert np.array_equal(after[~stuck], A[~stuck])


def displacement(d: Damage, run: Run = RUN) -> np.ndarray:
    """um, what has been added."""
    return 1e6 * (damaged(run, d).tcp.displacement - run.tcp.displacement)


def test_a_device_that_is_set_to_zero_counts_from_there():
    d = replace(of_kind("measurement", "rezero", start=14400.0), size=0.0)
    shown = damaged(RUN, d).tcp.displacement[:, 0]
    before, late = RUN.tcp.displacement[:, 0], ROWS >= 14400.0
    assert shown[late][0] == 0.0
    assert np.diff(shown[late]) == pytest.approx(np.diff(before[late]))
    assert np.array_equal(shown[~late], before[~late])


def test_a_stuck_device_keeps_its_value_for_a_time():
    shown = damaged(RUN, replace(of_kind("measurement", "stuck", start=14400.0), size=7200.0)).tcp.displacement[:, 0]
    before, stuck = RUN.tcp.displacement[:, 0], (ROWS >= 14400.0) & (ROWS < 21600.0)
    assert shown[stuck] == pytest.approx(before[stuck][0])
    assert np.array_equal(shown[~stuck], before[~stuck])


def test_a_play_stays_behind_until_it_is_used_up():
    there = np.concatenate([np.linspace(0.0, 10e-6, 10), np.linspace(10e-6, 0.0, 10)])
    run = replace(RUN, tcp=replace(RUN.tcp, displacement=np.stack([there, 0 * there, 0 * there], axis=1)))
    slip = displacement(of_kind("slip", "play"), run)  # 4 um
    assert not slip[:, 1:].any()
    assert np.abs(slip[:, 0]).max() == pytest.approx(2.0)
    assert slip[9, 0] == pytest.approx(-2.0)  # behind while it moves on
    assert slip[-1, 0] == pytest.approx(2.0)  # and on the other side on the way back
    gap = np.where(np.arange(20)[:, None] == 0, np.nan, run.tcp.displacement)
    after = damaged(replace(run, tcp=replace(run.tcp, displacement=gap)), of_kind("slip", "play")).tcp.displacement
    assert np.isfinite(after[1:]).all()
    pairs = replace(run.tcp, time=np.repeat(run.tcp.time[::2], 2) + np.tile([0.0, 60.0], 10))
    one = displacement(of_kind("slip", "play"), replace(run, tcp=pairs))[:, 0].reshape(10, 2)
    np.testing.assert_allclose(one[:, 0], one[:, 1], atol=1e-9)  # rows of one measurement


def test_a_step_stays():
    step = displacement(of_kind("not_thermal", "step", start=18000.0))
    assert step[:, 0].tolist() == pytest.approx([0.0] * 10 + [4.0] * 10)


def test_rows_that_count_from_the_first_lose_what_that_one_has():
    first = replace(RUN, tcp_reference="first")
    assert displacement(of_kind("not_thermal", "step", end=18000.0), first)[:, 0].tolist() == pytest.approx(
        [0.0] * 10 + [-4.0] * 10
    )


def test_measuring_devices():
    assert displacement(of_kind("measurement", "drift"))[[0, -1], 0].tolist() == pytest.approx([0.0, 4.0])
    warm = displacement(of_kind("measurement", "heating"), SETS)
    first = np.array([0.0, 1.0, 2.0, 0.0])  # the fourth row is more than 10 min behind the third: another measurement
    assert warm[:, 0] == pytest.approx(np.tile(4.0 * first / 2.0, 5))
    assert warm[:, 0] == pytest.approx(4.0 * _within_set(SETS.tcp.time))  # as it is searched
    assert not warm[:, 1:].any()
    with pytest.raises(LogError, match="every measurement is one row"):
        damaged(RUN, of_kind("measurement", "heating"))
    askew = displacement(replace(of_kind("measurement", "frame"), size=20e-6))
    assert askew[:, 0] == pytest.approx(20.0 * AT)  # w + a position
    assert not askew[:, 1:].any()
    resting = replace(RUN, tcp=replace(RUN.tcp, position=np.full((len(ROWS), 1), 0.1)))
    with pytest.raises(LogError, match="stands still"):
        damaged(resting, of_kind("measurement", "frame"))


def test_a_load_bends_where_it_acts():
    bent = displacement(of_kind("not_thermal", "load"))
    assert bent[:, 0].tolist() == pytest.approx([4.0, 0.0] * 10)  # the current is on at full hours


def test_a_stated_temperature_is_off():
    assert damaged(RUN, of_kind("initial_state", "offset")).initial_temperature == pytest.approx(20.6)
    with pytest.raises(LogError, match="states no initial temperature"):
        damaged(replace(RUN, initial_temperature=None), of_kind("initial_state", "offset"))
    with pytest.raises(LogError, match="whole run"):
        damaged(RUN, of_kind("initial_state", "offset", end=3600.0))


@pytest.mark.parametrize(
    ("d", "told"),
    [
        (Damage("sensor", "sensors.c", 1.0), "sensors of this run are: sensors.a, sensors.b"),
        (Damage("sensor", "signals.current", 1.0), "no sensor"),
        (Damage("signal", "signals.curent", 2.0), "did you mean 'signals.current'"),
        (Damage("sensor", "sensors.a", 1.0, "ofset"), "did you mean 'offset'"),
        (Damage("sensor", "sensors.a", 0.5, "detached"), "needs a column"),
        (Damage("sensor", "sensors.a", 1.5, "detached", "air"), "share"),
        (Damage("slip", "tcp.dw", 1e-6), "tcp.dx"),
        (Damage("measurement", "tcp.z", 1e-5, "frame"), "places are: tcp.dx:x, tcp.dy:x, tcp.dz:x"),
        (Damage("initial_state", "bed", 1.0), "places are: run, runs."),
        (Damage("signal", "runs.monday", 60.0, "clock"), "places are: run, runs."),
        (Damage("heat_source", "bed.top", 1.0), "no fault of a log"),
        (Damage("not_thermal", "tcp.dx", 1e-6, "load", "force"), "no column 'force'"),
    ],
)
def test_what_is_not_there_is_told(d, told):
    with pytest.raises(LogError) as e:
        damaged(RUN, d)
    assert told in str(e.value)


def test_faults_of_the_tool_need_its_measurements():
    with pytest.raises(LogError, match=r"no tcp\.csv"):
        damaged(replace(RUN, tcp=None), of_kind("slip", "play"))


def asked_for(family: str, place: str, size: str, settings: dict[str, str] | None = None, **when) -> Request:
    return Request(family, place, size, When(**when), settings or {})


def hidden(asked: Request, target: Path, out: Path) -> list[str]:
    return hide(target, asked.family, asked.place, asked.size, out, asked.when, asked.settings)


@pytest.fixture
def measured(tmp_path) -> Path:
    folder = tmp_path / "measured"
    write_run(folder, SETS)
    return folder


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        (asked_for("sensor", "sensors.a", "1 K", start=7200.0, end=3600.0), "between --from and --to"),
        (asked_for("sensor", "sensors.a", "1 K", start=3600.0, end=3600.0), "between --from and --to"),
        (asked_for("sensor", "sensors.a", "1 K", start=36000.0), "within the run, 0 h .. 10 h"),
        (asked_for("sensor", "sensors.a", "1 K", kind="drift", end=-60.0), "within the run"),
        (asked_for("not_thermal", "tcp.dx", "3 um", start=35000.0), "changes nothing"),  # after the last TCP row
        (asked_for("sensor", "sensors.a", "0 K"), "changes nothing"),
        (asked_for("signal", "signals.current", "1"), "changes nothing"),
        (asked_for("sensor", "sensors.a", "1 K", signal="air"), "follows no column"),
        (asked_for("measurement", "tcp.dx:x", "5 deg", kind="frame"), "not a quantity in 1"),
        (asked_for("initial_state", "sensors.a", "1 K"), "places are: run, runs.measured"),
    ],
)
def test_a_copy_without_its_fault_is_not_written(asked, told, measured, tmp_path):
    with pytest.raises(TwinError) as e:
        hidden(asked, measured, tmp_path / "copy")
    assert told in str(e.value)
    assert not (tmp_path / "copy").exists()


@pytest.mark.parametrize(
    ("machine", "asked", "told"),
    [
        ("slide", asked_for("zone", "films.floor", "2 K/m"), "name environment.floor, or give a size in K"),
        ("slide", asked_for("heat_source", "bed.x_max", "2 W", settings={"temperature": "9 degC"}), "no setting"),
        ("slide", asked_for("heat_source", "bed.x_max", "2 W", exponent=2.0), "--exponent"),
        ("slide", asked_for("heat_source", "bed.x_max", "2 W", start=-7200.0, end=-3600.0), "between --from and --to"),
        ("spindle", asked_for("forced_convection", "housing", "2 W/(m^2*K)", signal="spindle_speed"), "docs/hiding.md"),
    ],
)
def test_what_a_machine_cannot_have_is_told(machine, asked, told, tmp_path):
    with pytest.raises(TwinError) as e:
        hidden(asked, MACHINE[machine], tmp_path / "copy")
    assert told in str(e.value)
    assert not (tmp_path / "copy").exists()


def test_a_late_clock_can_be_written_and_read(measured, tmp_path):
    hidden(asked_for("signal", "runs.measured", "6 min", kind="clock"), measured, tmp_path / "copy")
    assert read_run(tmp_path / "copy").temperatures.time - TIME == pytest.approx(360.0)


def rows_of_the_page() -> dict[str, list[list[str]]]:
    """The rows of the table of docs/hiding.md by family."""
    found: dict[str, list[list[str]]] = {}
    name = ""
    for line in PAGE.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if len(cells) == 7 and cells[0] not in ("#", "---"):
            name = cells[1].strip("`") or name
            found.setdefault(name, []).append(cells)
    return found


def test_the_page_has_every_family_with_its_units_kinds_and_settings():
    rows = rows_of_the_page()
    assert [(int(own[0][0]), name) for name, own in rows.items()] == [(f.number, f.name) for f in FAMILIES]
    for name, kinds in DAMAGES.items():
        assert rows[name][0][2] == "log"
        for kind, entry in kinds.items():
            own = [r for r in rows[name] if f"`--history {kind}`" in r[5]]
            assert own, kind
            assert all(f"[{entry.unit}]" in r[4] for r in own if entry.unit)
    for name, units in UNITS.items():
        assert rows[name][0][2] == "machine"
        assert all(any(f"[{unit}]" in r[4] for r in rows[name]) for unit in units), name
    for name, settings in SETTINGS.items():
        assert all(any(f"`{setting}" in r[5] for r in rows[name]) for setting in settings), name


def test_the_commands_of_the_page_work(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    calls = [shlex.split(line) for line in PAGE.splitlines() if line.startswith("    twin ")]
    for call in calls:
        assert twin([str(tmp_path / word) if word.startswith("out/") else word for word in call[1:]]) == 0, call
    families = {call[2] for call in calls if call[1] == "hide"}
    assert families == {f.name for f in FAMILIES} - {"coarse_model", "missing_member"}
    assert "error" not in capsys.readouterr().err


def test_the_wind_of_the_page_is_a_film():
    wind = PAGE.split("```toml\n")[1].split("```")[0]
    path = MACHINE["spindle"] / "machine.toml"
    machine = load_machine(path, path.read_text(encoding="utf-8") + "\n" + wind)
    assert machine.films["spindle_wind"].signals == tomllib.loads(wind)["films"]["spindle_wind"]["signals"]

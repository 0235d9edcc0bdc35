"""What `check_run` finds in logs that read well: clocks, gaps, dead and shifted channels, missing signals."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from tests.logs.test_read import RUN_TOML, write
from twin.errors import LogError
from twin.logs.check import check_run
from twin.logs.read import parse_run, read_run
from twin.logs.sampling_rule import AxisLimits, Needed, core_sampling
from twin.logs.signals import signal_values

SLIDE_RUN = Path(__file__).parents[1] / "machines" / "slide" / "runs" / "short"


@dataclass(frozen=True)
class Signal:
    name: str
    column: str
    unit: str
    kind: str = "value"
    low: float = -1e9
    high: float = 1e9
    default: float | None = None
    factor: float = 1.0


def table(columns: dict[str, np.ndarray]) -> str:
    rows = np.column_stack(list(columns.values()))
    return "\n".join([",".join(columns), *(",".join("" if np.isnan(v) else f"{v:.9g}" for v in row) for row in rows)])


def found(folder: Path, columns: dict[str, np.ndarray], *signals: Signal, run: str = RUN_TOML, **tables: str) -> list:
    return check_run(parse_run(write(folder, table(columns), run=run, **tables)), signals)


TIME = np.arange(200) * 5.0
WAVE = 0.1 * np.sin(TIME / 40.0)  # m
SPEED = 0.1 / 40.0 * np.cos(TIME / 40.0)


def test_a_sound_run_is_silent(tmp_path):
    assert check_run(read_run(SLIDE_RUN)) == []
    assert found(tmp_path, {"time [s]": TIME, "x [m]": WAVE, "v [m/s]": SPEED}) == []


def test_missing_signals_with_the_nearest_name(tmp_path):
    signals = (Signal("x_current", "x_motor_current", "A"), Signal("x_speed", "x_speed", "m/s"))
    columns = {"time [s]": TIME, "x_motor_curent [A]": 1 + TIME, "x_speed [m]": WAVE}
    missing, wrong = found(tmp_path, columns, *signals)
    assert not missing.warning
    assert missing.what == "no column 'x_motor_current' (signal 'x_current')"
    assert "did you mean 'x_motor_curent'?" in missing.remedy
    assert "is in m, signal 'x_speed' in m/s" in wrong.what
    with pytest.raises(LogError) as caught:
        signal_values(read_run(tmp_path), signals)
    assert list(caught.value.problems) == [missing, wrong]


def test_temperature_signal_may_stand_in_the_other_table(tmp_path):
    temperatures = table({"time [s]": TIME, "shop [degC]": 20 + WAVE})
    signal = Signal("shop", "shop", "degC")
    assert not found(tmp_path, {"time [s]": TIME, "x [m]": WAVE}, signal, temperatures=temperatures)


def test_signal_values_turn_peaks_into_rms(tmp_path):
    run = read_run(write(tmp_path, "time [s],i [mA],x [mm]\n0,2000,1\n"))
    values = signal_values(run, (Signal("a", "i", "A", "peak"), Signal("b", "i", "A", "rms"), Signal("x", "x", "m")))
    assert values["a"] == pytest.approx([np.sqrt(2.0)])
    assert values["b"] == pytest.approx([2.0])
    assert values["x"] == pytest.approx([1e-3])


def test_a_gap_is_told_with_its_line(tmp_path):
    time = np.where(np.arange(200) < 50, TIME, TIME + 300.0)
    (gap,) = found(tmp_path, {"time [s]": time, "x [m]": WAVE})
    assert gap.warning
    assert "once a gap, the longest 305 s where 5 s are usual" in gap.what
    assert "(line 52)" in gap.where  # the first row after it: header, 50 rows, then this one


def test_duplicated_and_reversed_times(tmp_path):
    time = TIME.copy()
    time[10] = time[9]
    (duplicate,) = found(tmp_path, {"time [s]": time, "x [m]": WAVE})
    assert not duplicate.warning
    assert "the same time twice, once, 1 with other values" in duplicate.what
    assert "(line 12)" in duplicate.where
    time[100:] -= 400.0
    problems = found(tmp_path, {"time [s]": time, "x [m]": WAVE})
    restart = "time runs backwards, once: the clock starts again, from 495 to 100 s"
    assert [p.what for p in problems] == [restart, "the same time twice, once, 1 with other values"]
    assert [p.where.split("(")[1] for p in problems] == ["line 102)", "line 12)"]
    with pytest.raises(LogError) as caught:
        read_run(tmp_path)  # what `twin check` calls an error, no verb reads
    assert list(caught.value.problems) == problems


def test_naive_times_are_warned_of(tmp_path):
    text = "time,x [mm]\n2026-03-02T08:00:10,1\n2026-03-02T08:00:15,2\n"
    (naive,) = check_run(read_run(write(tmp_path, text)))
    assert naive.warning
    assert "without a zone" in naive.what


def test_clock_change_in_naive_times_is_refused_with_its_lines(tmp_path):
    rows = [f"2026-10-25T{h:02d}:{m:02d}:00,{h + m}" for h, m in [(1, 30), (2, 0), (2, 30), (2, 0), (2, 30), (3, 0)]]
    text = "\n".join(["time,x [mm]", *rows])
    with pytest.raises(LogError) as caught:
        read_run(write(tmp_path, text, run="start = 2026-10-25T00:00:00+02:00\nzone = 'Europe/Berlin'"))
    assert [p.where.split("(line ")[1] for p in caught.value.problems] == ["3)", "4)", "5)", "6)"]
    assert all("twice on 2026-10-25" in p.what for p in caught.value.problems)


def test_constant_zero_stuck_and_missing_values(tmp_path):
    x = WAVE.copy()
    x[3:7] = np.nan
    columns = {"time [s]": TIME, "x [m]": x, "dead [A]": 0 * TIME, "held [A]": 0 * TIME + 4, "none [A]": np.nan * TIME}
    temperatures = table({"time [s]": TIME, "bed [degC]": 0 * TIME + 21, "column [K]": 21 + WAVE})
    problems = found(tmp_path, columns, temperatures=temperatures)
    told = [(p.what.split(" (")[0], p.warning) for p in problems]
    assert told == [
        ("column 'x' lacks 4 of 200 values, first in line 5", True),
        ("column 'none' has no value at all", True),
        ("column 'dead' is zero throughout", True),
        ("column 'bed' never changes", True),
        ("column 'column' spans -252.25 .. -252.05 degC", True),
    ]


def test_header_in_milliseconds_that_counts_seconds(tmp_path):
    (clock,) = found(tmp_path, {"time [ms]": TIME, "x [m]": WAVE})
    assert "0.005 s apart, run.toml says 5 s: a factor 1000" in clock.what
    assert "milliseconds" in clock.remedy
    assert not clock.warning
    with pytest.raises(LogError, match=r"0\.005 s apart"):
        read_run(tmp_path)


def test_a_signal_without_any_value_is_an_error_where_it_is_wanted(tmp_path):
    columns = {"time [s]": TIME, "x [m]": WAVE, "i [A]": np.nan * TIME}
    run = read_run(write(tmp_path, table(columns)))
    told = check_run(run, (Signal("i", "i", "A"),))
    assert [(p.what, p.warning) for p in told] == [("column 'i' has no value at all", False)]
    assert [p.warning for p in check_run(run)] == [True]


def test_range_outside_the_certified_one(tmp_path):
    (outside,) = found(tmp_path, {"time [s]": TIME, "x [m]": WAVE}, Signal("x", "x", "m", low=-0.05, high=0.2))
    assert outside.warning
    assert f"{np.count_nonzero(WAVE < -0.05)} rows outside" in outside.what


def test_tables_of_another_day(tmp_path):
    temperatures = table({"time [s]": TIME + 86400, "bed [degC]": 20 + WAVE})
    (apart,) = found(tmp_path, {"time [s]": TIME, "x [m]": WAVE}, temperatures=temperatures)
    assert "lie outside the loads'" in apart.what
    with pytest.raises(LogError):
        read_run(tmp_path)


def test_sensors_and_axes_are_matched(tmp_path):
    temperatures = table({"time [s]": TIME, "bed_frnt [degC]": 20 + WAVE})
    tcp = "time [s],X [mm],dx [um],dy [um],dz [um]\n60,1,1,1,1\n"
    run = read_run(write(tmp_path, table({"time [s]": TIME, "x [m]": WAVE}), temperatures=temperatures, tcp=tcp))
    sensor, axis = check_run(run, axes=("x",), sensors=("bed_front",))
    assert (sensor.warning, axis.warning) == (True, False)
    assert "did you mean 'bed_front'?" in sensor.remedy
    assert "no position of axis 'x'" in axis.what
    assert "did you mean 'X'?" in axis.remedy


@pytest.mark.parametrize("logged", [False, True])
def test_a_column_that_a_signal_is_read_from_is_no_unknown_sensor(tmp_path, logged):
    """Where loads.csv has it, it is not read from there."""
    water = {"water [degC]": 20 + WAVE}
    loads = table({"time [s]": TIME, "x [m]": WAVE, **(water if logged else {})})
    run = parse_run(
        write(tmp_path, loads, temperatures=table({"time [s]": TIME, "bed [degC]": 21 + 0 * TIME, **water}))
    )
    problems = check_run(run, (Signal("coolant", "water", "degC"),), sensors=("bed",))
    told = [p.what for p in problems if "no sensor" in p.what]
    assert told == (["column 'water' is no sensor of the machine"] if logged else [])


@pytest.mark.parametrize("signed", [True, False])
@pytest.mark.parametrize(("shift", "says"), [(0, ""), (4, "3 sample(s) late"), (-3, "3 sample(s) early")])
def test_shifted_speed_channel(tmp_path, signed, shift, says):
    speed = np.roll(np.append(np.diff(WAVE) / 5.0, 0.0), shift)
    problems = found(tmp_path, {"time [s]": TIME, "x [m]": WAVE, "v [m/s]": speed if signed else np.abs(speed)})
    assert [says in p.what for p in problems] == ([True] if says else [])


def test_speed_in_the_wrong_unit(tmp_path):
    (factor,) = found(tmp_path, {"time [s]": TIME, "x [m]": WAVE, "v [m/s]": 60.0 * SPEED})
    assert "times the speed of 'x'" in factor.what
    assert 59 < float(factor.what.split("is ")[1].split(" times")[0]) < 61


def test_a_log_slower_than_the_rule_is_told_once(tmp_path):
    """Table 16.1: what is lost and what is not; silent where the log is fast enough or the limits are not known."""
    run = read_run(write(tmp_path, table({"time [s]": TIME, "x [m]": WAVE, "v [m/s]": SPEED})))
    position = core_sampling([AxisLimits("x", speed=0.5, acceleration=5.0, jerk=50.0, segment=0.07)])
    (problem,) = check_run(run, core=position)
    assert problem.warning
    assert problem.what == "loads are logged every 5 s, the axes' limits ask for 10 ms (current of axis 'x')"
    assert "rms currents" in problem.remedy
    (problem,) = check_run(run, core=core_sampling([AxisLimits("x", speed=1.0, segment=0.02)]))
    assert "2 ms (position of axis 'x')" in problem.what
    assert "rail segment" in problem.remedy
    assert check_run(run, core=Needed(5.0, "x", "speed")) == []
    assert check_run(run, core=None) == []


def test_rows_that_no_loads_are_beside_are_counted(tmp_path):
    later = table({"time [s]": TIME + 500.0, "bed [degC]": 21 + 0 * TIME})
    (told,) = [
        p for p in found(tmp_path, {"time [s]": TIME, "x [m]": WAVE}, temperatures=later) if "not used" in p.what
    ]
    assert told.what.startswith(
        "99 of 200 rows lie outside the loads' 0 .. 995 s"
    )  # one step beyond is beside the last
    assert told.warning


def test_a_sensor_without_a_column_is_told(tmp_path):
    temperatures = table({"time [s]": TIME, "bed": 21 + 0 * TIME}).replace("bed", "bed [degC]")
    run = parse_run(write(tmp_path, table({"time [s]": TIME, "x [m]": WAVE}), temperatures=temperatures))
    told = [p.what for p in check_run(run, sensors=("bed", "column", "x")) if "no column" in p.what]
    assert told == ["no column of sensor 'column'"]

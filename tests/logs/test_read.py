"""Run folders as they come: German number formats, ISO times, other units, and every way to get them wrong."""

from __future__ import annotations

import time
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from twin.errors import LogError
from twin.logs.read import read_run

RUN_TOML = "start = 2026-03-02T08:00:00+01:00\nzone = 'Europe/Berlin'\nsampling = '5 s'\nsynthetic = false\n"


def write(folder: Path, loads: str | bytes, run: str = RUN_TOML, **tables: str) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "run.toml").write_text(run, encoding="utf-8")
    for name, text in {"loads": loads, **tables}.items():
        (folder / f"{name}.csv").write_bytes(text if isinstance(text, bytes) else text.encode())
    return folder


def refused(folder: Path) -> str:
    with pytest.raises(LogError) as caught:
        read_run(folder)
    assert all(p.where and p.remedy for p in caught.value.problems)
    return str(caught.value)


def test_units_become_si(tmp_path):
    run = read_run(
        write(
            tmp_path,
            "time [min],x [mm],v [m/min],n [rpm],T [K],i [A],duty [%]\n0,1,6,60,300,2,50\n1,-2,0,0,273.15,0,0\n",
        )
    )
    expected = {"x": [1e-3, -2e-3], "v": [0.1, 0], "n": [1, 0], "T": [26.85, 0], "i": [2, 0], "duty": [0.5, 0]}
    for name, values in expected.items():
        np.testing.assert_allclose(run.loads.columns[name], values, atol=1e-12)
    assert run.loads.time.tolist() == [0.0, 60.0]
    assert run.loads.units == {"x": "m", "v": "m/s", "n": "1/s", "T": "degC", "i": "A", "duty": "1"}
    assert (run.sampling, run.zone, run.synthetic) == (5.0, "Europe/Berlin", ())


@pytest.mark.parametrize(
    "text",
    [
        "time [s];x [mm];T [°C]\n0;1,5;20,25\n5;-2,5;21\n",
        "time [s];x [mm];T [°C]\r\n0;1,5;20,25\r\n5;-2,5;21\r\n\r\n",
        "Zeit [s];x [mm];T [°C];\n0;1,5;20,25;\n5;-2,5;21;\n",
        'time [s]\t"x [mm]"\tT [degC]\n0\t1.5\t20.25\n5\t-2.5\t21\n',
        'time [s],"x [mm]",T [degC]\n"0","1.5","20.25"\n5,-2.5,21\n',
        "time [s];x [mm];T [°C]\n0;1,5;20,25\n5;-2,5;21\n".encode("latin-1"),
        "time [s];x [mm];T [°C]\n0;1,5;20,25\n5;-2,5;21\n".encode("utf-16"),
        "\ufefftime [s];x [mm];T [°C]\n0;1,5;20,25\n5;-2,5;21\n",
    ],
)
def test_separators_decimal_commas_and_encodings(tmp_path, text):
    run = read_run(write(tmp_path, text))
    assert run.loads.columns["x"].tolist() == [1.5e-3, -2.5e-3]
    assert run.loads.columns["T"].tolist() == [20.25, 21.0]


def test_iso_times_with_zone_count_from_the_start(tmp_path):
    text = "time,x [mm]\n2026-03-02T08:00:10+01:00,1\n2026-03-02T07:00:20Z,2\n"
    run = read_run(write(tmp_path, text))
    assert run.loads.time.tolist() == [10.0, 20.0]
    assert not run.loads.naive


def test_iso_times_define_the_start_where_it_is_unknown(tmp_path):
    run = read_run(write(tmp_path, "time [iso];x [mm]\n2026-03-02 08:00:10+01:00;1,5\n", run="start = 'unknown'"))
    assert run.loads.time.tolist() == [0.0]
    assert run.start == datetime.fromisoformat("2026-03-02T08:00:10+01:00")


def test_naive_iso_times_beside_a_zone_are_refused(tmp_path):
    text = "time,x [mm]\n2026-03-02T08:00:10,1\n2026-03-02T08:00:20,2\n"
    run = read_run(write(tmp_path, text))
    assert run.loads.naive
    assert run.loads.time.tolist() == [10.0, 20.0]
    message = refused(write(tmp_path, text, run="start = 2026-03-02T08:00:00+01:00"))
    assert message.count("has no zone") == 2
    assert "line 2" in message
    assert "line 3" in message
    assert 'zone = "Europe/Berlin"' in message


def test_times_with_and_without_a_zone_in_one_file(tmp_path):
    """A zone lost from one time would move that row by hours."""
    text = "time,x [mm]\n2026-03-02T08:00:10+01:00,1\n2026-03-02T08:00:20,2\n"
    message = refused(write(tmp_path, text))
    assert "(line 3): this time has no zone" in message


@pytest.mark.parametrize(
    ("time", "says"),
    [("2026-10-25T02:30:00", "shows 02:30 twice on 2026-10-25"), ("2026-03-29T02:30:00", "skips 02:30 on 2026-03-29")],
)
def test_local_times_that_the_clock_shows_twice_or_never(tmp_path, time, says):
    zone = "start = 'unknown'\nzone = 'Europe/Berlin'"
    message = refused(write(tmp_path, f"time,x [mm]\n2026-01-01T00:00:00,0\n{time},1\n", run=zone))
    assert "line 3" in message
    assert says in message
    run = read_run(write(tmp_path, f"time,x [mm]\n{time}+01:00,1\n", run=zone))  # the offset says it all
    assert run.start.timestamp() == datetime.fromisoformat(f"{time}+01:00").timestamp()
    start = refused(write(tmp_path, "time [s],x [mm]\n0,1\n", run=f"start = {time}\nzone = 'Europe/Berlin'"))
    assert says in start


def test_days_of_a_clock_change_count_every_second(tmp_path):
    """From midnight to six: five hours in March, seven in October."""
    for day, hours in (("2026-03-29", 5), ("2026-10-25", 7)):
        text = f"time,x [mm]\n{day}T00:00:00,0\n{day}T06:00:00,1\n"
        run = read_run(write(tmp_path, text, run="start = 'unknown'\nzone = 'Europe/Berlin'"))
        assert run.loads.time.tolist() == [0.0, 3600.0 * hours]


def test_decimal_points_among_decimal_commas(tmp_path):
    message = refused(write(tmp_path, "time [s];x [mm];y [mm]\n0;1,5;2\n5;1.500;2\n10;1,5;2\n"))
    assert "line 3" in message
    assert "decimal points in 1 rows" in message
    iso = "time;x [mm]\n2026-03-02T08:00:10.500+01:00;1,5\n"  # the point of a time is no decimal mark of the values
    assert read_run(write(tmp_path, iso)).loads.columns["x"].tolist() == [1.5e-3]


def test_points_that_look_like_thousands(tmp_path):
    rows = [f"{5 * k};{k % 3};{v}" for k, v in enumerate(["980", "1.020", "1.250", "1.310", "2.400", "2.500", "990"])]
    message = refused(write(tmp_path, "\n".join(["time [s];x [mm];n [1/min]", *rows])))
    assert "column 'n' seems to hold thousands separators" in message
    assert "lines 3, 4, 5 and 2 more" in message
    fine = [row.replace("980", "0.980") for row in rows]  # three decimals after all
    assert read_run(write(tmp_path, "\n".join(["time [s];x [mm];n [1/min]", *fine]))).loads.time[-1] == 30.0


def test_nul_bytes_are_told_with_their_line(tmp_path):
    message = refused(write(tmp_path, b"time [s],x [mm]\r\n0,1\r\n5,2\r\n\0\0\0\0"))
    assert "nul bytes" in message
    assert "line 4" in message
    assert "nul bytes" in refused(write(tmp_path, "time [s],x [mm]\n0,1\n".encode("utf-16-le")))


def test_empty_cells_are_missing_values(tmp_path):
    run = read_run(write(tmp_path, "time [s];x [mm];T [degC]\n0;1;\n5;;20\n"))
    np.testing.assert_array_equal(run.loads.columns["x"], [1e-3, np.nan])
    np.testing.assert_array_equal(run.loads.columns["T"], [np.nan, 20])


def test_a_tcp_table_becomes_si_without_rotary_axes(tmp_path):
    tcp = "time [s],x [mm],b [deg],dx [um],dy [um],dz [m],sigma [um]\n60,100,90,1,2,3e-6,0.5\n"
    run = read_run(write(tmp_path, "time [s],x [mm]\n0,1\n", tcp=tcp))
    assert run.tcp.axes == ("x",)  # rotary axes are at angle zero for the structure
    np.testing.assert_allclose(run.tcp.position, [[0.1]])
    np.testing.assert_allclose(run.tcp.displacement, [[1e-6, 2e-6, 3e-6]])
    np.testing.assert_allclose(run.tcp.sigma, [0.5e-6])


@pytest.mark.parametrize(
    ("loads", "says"),
    [
        ("time [s],x [mm]\n", "no rows"),
        ("", "no headers"),
        ("x [mm],time [s]\n1,0\n", "not the time"),
        ("time [mm],x [mm]\n1,0\n", "not a time"),
        ("time [s],x\n0,1\n", "column 'x' has no unit"),
        ("time [s],x [mmm]\n0,1\n", "unknown unit 'mmm'"),
        ("time [s],x [m^9^9^9^9]\n0,1\n", "unknown unit"),
        ("time [s],x [mm],x [m]\n0,1,2\n", "'x' appears twice"),
        ("time [s],x [mm]\n0,1\n5,abc\n", "line 3): 'abc' in column 'x' is not a number"),
        ("time [s],x [mm]\n0,1\n5,1_0\n", "is not a number"),
        ("time [s],x [mm]\n0,1\n5\n", "line 3): 1 cells under 2 headers"),
        ("time [s],x [mm]\n0,1\n\n5,1\n", "line 3): 1 cells under 2 headers"),
        ("time [s],x [mm]\n0,1,5\n5,2,5\n", "separate the cells by ';'"),
        ("time [s];x [mm]\n0;1.234,5\n", "thousands separators"),
        ("time [s],x [mm]\n,1\n", "a time is missing"),
        ("time [s],x [mm]\n2026-03-02T08:00:10+01:00,1\n", "ISO times stand under 'time', without a unit"),
        ("time,x [mm]\nyesterday,1\n", "neither a number nor an ISO 8601 time"),
    ],
)
def test_refused_tables(tmp_path, loads, says):
    assert says in refused(write(tmp_path, loads))


def test_start_beyond_the_calendar(tmp_path):
    text = "time,x [mm]\n9999-12-31T23:59:59-23:59,1\n"
    assert "out of range" in refused(write(tmp_path, text, run="start = 'unknown'"))


def test_all_bad_cells_are_reported_with_their_lines(tmp_path):
    message = refused(write(tmp_path, "time [s],x [mm]\n0,a\n5,1\n10,b\n"))
    assert "line 2" in message
    assert "line 4" in message


@pytest.mark.parametrize(
    ("run", "says"),
    [
        ("start = 2026-03-02T08:00:00", "start has no zone"),
        ("start = 'soon'", "is not a date"),
        ("zone = 'Europe/Berlim'", "unknown time zone"),
        ("zone = '../../etc/passwd'", "unknown time zone"),
        ("zone = 3", "zone is not a string"),
        ("smapling = 5", "did you mean 'sampling'?"),
        ("sampling = '5 m'", "not a quantity in s"),
        ("synthetic = 'yes'", "synthetic"),
        ("synthetic = ['load']", "synthetic"),
        ("initial_temperature = '20 m'", "not a quantity in degC"),
        ("machine = 3", "machine is not a string"),
        ("start =", "not valid TOML"),
    ],
)
def test_refused_run_toml(tmp_path, run, says):
    assert says in refused(write(tmp_path, "time [s],x [mm]\n0,1\n", run=run))


def test_missing_files_are_named(tmp_path):
    assert "no run.toml" in refused(tmp_path)
    (tmp_path / "run.toml").write_text("")
    assert "no loads.csv" in refused(tmp_path)
    assert "no run.toml" in refused(tmp_path / "run.toml")


def test_other_tables_are_checked(tmp_path):
    loads = "time [s],x [mm]\n0,1\n"
    assert "not in degC" in refused(write(tmp_path, loads, temperatures="time [s],bed [mm]\n0,1\n"))
    (tmp_path / "temperatures.csv").unlink()
    assert "no column of dx, dy, dz" in refused(write(tmp_path, loads, tcp="time [s],x [mm]\n0,1\n"))
    assert "'dz' is in degC" in refused(write(tmp_path, loads, tcp="time [s],dx [um],dy [um],dz [K]\n0,1,1,1\n"))
    assert "start of the run is unknown" in refused(
        write(tmp_path, loads, run="", tcp="time,dx [um],dy [um],dz [um]\n2026-03-02T08:00:10Z,1,1,1\n")
    )


def test_a_long_log_reads_fast(tmp_path):
    """12 h at 1 s with 20 columns takes about 0.2 s, as measured; a Python loop over cells would take over a second."""
    rows = np.column_stack([np.arange(43_200), np.random.default_rng(0).normal(size=(43_200, 20))])
    lines = ["time [s];" + ";".join(f"c{k} [A]" for k in range(20))]
    lines += [";".join(f"{v:.6g}" for v in row).replace(".", ",") for row in rows]
    folder = write(tmp_path, "\n".join(lines))
    seconds = []
    for _ in range(3):
        start = time.perf_counter()
        run = read_run(folder)
        seconds.append(time.perf_counter() - start)
    np.testing.assert_allclose(run.loads.columns["c19"], rows[:, 20], rtol=1e-5)
    assert min(seconds) < 1.0


_CELLS = st.sampled_from(
    ["0", "1", "1,5", "1.5", "-", "", "nan", "1e400", "2026-03-02T08:00:00+01:00", "2026-03-02", "x", "\x00", '"', "٣"]
)
_HEADERS = st.sampled_from(
    ["time [s]", "time", "x [mm]", "y [°C]", "z", "w [", "v []", "u [1/0]", "[A]", "", "t [N m)]", "q [m**9]"]
)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    delimiter=st.sampled_from([",", ";", "\t"]),
    header=st.lists(_HEADERS, min_size=1, max_size=4),
    rows=st.lists(st.lists(_CELLS, max_size=5), max_size=6),
    noise=st.binary(max_size=6),
    run=st.one_of(
        st.just(RUN_TOML),
        st.text(max_size=30),
        st.sampled_from(["start = 0001-01-01T00:00:00+23:59", "zone = ''", "zone='.'"]),
    ),
)
def test_nothing_but_log_errors_ever_comes_out(tmp_path, delimiter, header, rows, noise, run):
    text = "\n".join(delimiter.join(cells) for cells in [header, *rows]).encode() + noise
    folder = write(tmp_path / "run", text, run=run.encode("utf-8", "replace").decode())
    for name in ("temperatures", "tcp"):
        (folder / f"{name}.csv").unlink(missing_ok=True)
    try:
        loads = read_run(folder).loads
    except LogError as e:
        assert e.problems  # noqa: PT017 - either outcome is right
    else:
        assert all(len(v) == len(loads.time) for v in loads.columns.values())


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(content=st.binary(max_size=60), run=st.binary(max_size=40))
def test_any_bytes_are_read_or_refused(tmp_path, content, run):
    folder = write(tmp_path / "run", content)
    (folder / "run.toml").write_bytes(run)
    try:
        read_run(folder)
    except LogError as e:
        assert e.problems  # noqa: PT017 - either outcome is right

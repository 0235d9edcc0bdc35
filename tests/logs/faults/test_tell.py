"""Faults in plain words: one line each, with lines of the file, times and remedies; and what a command prints."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from twin.cli.main import run as command
from twin.inject.damage.channels import Damage
from twin.inject.damage.kinds import damaged
from twin.logs.check import check_run
from twin.logs.faults.fault import MEANS, Fault
from twin.logs.faults.find import faults_of
from twin.logs.faults.tell import fault_problems
from twin.logs.run import Run, Segment, Table, Tcp
from twin.logs.write import write_run

TIME = np.arange(0.0, 6 * 3600.0, 60.0)


@pytest.fixture(scope="module")
def sound() -> Run:
    rng = np.random.default_rng(2)
    warm = 1.0 - np.exp(-np.clip(TIME - 1800.0, 0.0, None) / 5000.0)
    columns = {n: 21.0 + (4.0 + k) * warm + 0.03 * rng.standard_normal(len(TIME)) for k, n in enumerate("abcdef")}
    moved = np.outer(warm, [30e-6, 10e-6, -50e-6]) + 0.2e-6 * rng.standard_normal((len(TIME), 3))
    return Run(
        Table(TIME, {"speed": np.where(TIME > 1800.0, 50.0, 0.0)}, {"speed": "1/s"}),
        Table(TIME, columns, dict.fromkeys(columns, "degC")),
        Tcp(TIME, ("x",), np.zeros((len(TIME), 1)), moved),
    )


def test_a_sound_run_is_told_nothing(sound):
    assert check_run(sound) == []


TOLD = [
    (Damage("sensor", "sensors.c", 9.0, "noise", start=7200.0), r"'c' leaps to and fro by \S+ K .* from 2.00 h", 122),
    (Damage("sensor", "sensors.c", 850.0, "rail", start=7200.0), "'c' leaps to 850 degC and stays there", 122),
    (Damage("sensor", "sensors.c", 5.0, "offset", start=7200.0), r"'c' leaps by \S+ K at 2.00 h", 122),
    (Damage("sensor", "sensors.c", 5.0, "offset", start=7200.0, end=9000.0), r"'c' leaps by .* and back after", 122),
    (Damage("sensor", "sensors.c", 5400.0, "stuck", start=7200.0), "'c' stands still at 2[0-9.]+ degC while", 122),
    (Damage("sensor", "sensors.c", -6.0, "offset"), "'c' begins [0-9.]+ K below .*, and the machine was cold", 2),
    (Damage("signal", "run", 5400.0, "splice", start=3600.0), "rows of another time from line 62 on: at 1.00 h", 62),
    (Damage("measurement", "tcp.dz", 0.0, "rezero", start=7200.0), r"'dz' leaps by \S+ um to zero at 2.00 h", 122),
    (Damage("not_thermal", "tcp.dx", 50e-6, "step", start=7200.0), r"'dx' leaps by \S+ um at 2.00 h", 122),
    (Damage("measurement", "tcp.dx", 5400.0, "stuck", start=7200.0), r"'dx' stands still at \S+ um while", 122),
]  # fmt: skip


@pytest.mark.parametrize(("damage", "says", "line"), TOLD, ids=[f"{d.place}-{d.history}-{d.end}" for d, _, _ in TOLD])
def test_every_fault_is_one_warning_with_line_and_remedy(sound, damage, says, line):
    (told,) = check_run(damaged(sound, damage))
    assert re.search(says, told.what), told
    first = int(re.search(r"\(lines? (\d+)", told.where)[1])
    assert abs(first - line) <= 1
    assert told.warning
    assert told.remedy


def test_what_several_channels_do_at_once_is_one_line(sound):
    run = sound
    for name in "ab":
        run = damaged(run, Damage("sensor", f"sensors.{name}", 6.0, "offset", start=7200.0))
    for component in ("dx", "dz"):
        run = damaged(run, Damage("measurement", f"tcp.{component}", 5400.0, "stuck", start=7200.0))
    told = [p.what for p in check_run(run)]
    assert len(told) == 2
    assert told[0].startswith("'a', 'b' leap by up to ")
    assert told[1].startswith("'dx', 'dz' stand still at ")


def test_rows_at_several_places_are_each_their_own_history(sound):
    place = np.arange(len(TIME))[:, None] % 3 * 0.1  # m
    shown = sound.tcp.displacement + np.hstack([200e-6 * place, np.zeros((len(TIME), 2))])
    run = replace(sound, tcp=replace(sound.tcp, position=place, displacement=shown))
    assert check_run(run) == []
    moved = damaged(run, Damage("not_thermal", "tcp.dx", 60e-6, "step", start=7200.0))
    (fault,) = faults_of(moved)
    assert (fault.kind, fault.channels, fault.first_row, fault.first_time) == ("leap", ("dx",), 120, 7200.0)
    scattered = replace(moved, tcp=replace(moved.tcp, position=TIME[:, None] * 1e-5))  # no place twice
    assert faults_of(scattered) == []


def test_several_leaps_of_one_channel_are_one_line(sound):
    run = sound
    for start in (7200.0, 12000.0, 15000.0):
        run = damaged(run, Damage("sensor", "sensors.a", 6.0, "offset", start=start))
    (told,) = check_run(run)
    assert ", 3 times, first at 2.00 h" in told.what
    assert told.where.endswith("(lines 122, 202, 252)")


def test_tests_glued_into_one_log_are_no_splice_where_its_segments_say_so(sound):
    glued = damaged(sound, Damage("signal", "run", 5400.0, "splice", start=3600.0))
    assert len(check_run(glued)) == 1
    halves = (Segment("first", 0.0, 3600.0), Segment("second", 3600.0, 4 * 3600.0))
    assert check_run(replace(glued, segments=halves)) == []


def test_many_names_are_cut_short(sound):
    names = tuple("abcdef")
    (told,) = fault_problems(sound, [Fault("stuck", "temperatures", names, 3, 90, 180.0, 5400.0, 21.0, "degC")])
    assert told.what.startswith("'a', 'b', 'c', 'd' and 2 more stand still")


def test_every_kind_is_explained_and_told(sound):
    for kind in MEANS:
        (told,) = fault_problems(sound, [Fault(kind, "tcp", ("dx",), 5, 50, 300.0, 3000.0, 1e-5, "m")])
        assert told.what
        assert told.remedy


def test_faults_wait_until_times_are_in_order(sound):
    table = sound.temperatures
    back = table.time.copy()
    back[200:] -= 600.0
    broken = {**table.columns, "a": np.where(TIME > 7200.0, 850.0, table.columns["a"])}
    run = replace(sound, temperatures=Table(back, broken, table.units))
    told = check_run(run)
    assert [p.what for p in told if not p.warning] == ["time runs backwards, once"]
    assert not [p for p in told if "stays there" in p.what]


def test_the_command_tells_it_and_ends_well(sound, tmp_path, capsys):
    run = damaged(sound, Damage("sensor", "sensors.c", -200.0, "rail", start=7200.0))
    write_run(tmp_path / "run", run)
    assert command(["check", "--json", str(tmp_path / "run")]) == 0
    problems = json.loads(capsys.readouterr().out)["problems"]
    about = [p for p in problems if "'c'" in p["what"]]
    assert len(about) == 1
    assert about[0]["warning"]
    assert Path(about[0]["where"].partition(" (")[0]).name == "temperatures.csv"
    assert [f.kind for f in faults_of(run)] == ["rail"]

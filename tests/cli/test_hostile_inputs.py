"""Descriptions and run folders with values that cannot be meant: one clear error each, quickly, and exit status 2."""

from __future__ import annotations

import os
import re
import resource
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.descriptions import SLIDE, edited
from twin.cli.main import run

RUN = SLIDE.parent / "runs" / "short"
DIGITS = "9" * 400
AIR = 'temperature = "19 degC"'
RANGE = "range = [0.0, 12.0]"
REFERENCE = 'reference_temperature = "20 degC"'

DESCRIPTIONS = {
    "a reference in kelvin": (REFERENCE, "reference_temperature = 293.15", "(line 7): 293.15 degC is no temperature"),
    "a reference below zero": (REFERENCE, 'reference_temperature = "-400 degC"', "below absolute zero"),
    "air below zero": (AIR, 'temperature = "-300 degC"', "environment.floor.temperature (line 223): '-300 degC': "),
    "air in kelvin": (AIR, "temperature = 292.15", "in kelvin? write '292.15 K'"),
    "a conductance of 1e15": ('"1500 W/(m^2*K)"', "1e15", "x_guide.conductance (line 188): 1000000000000000.0: "),
    "a range of 1e200": (RANGE, "range = [0.0, 1e200]", "range.1 (line 213): 1e+200 is beyond"),
    "a range of 400 digits": (RANGE, f"range = [0, {DIGITS}]", "a whole number of 1329 bits is beyond"),
    "a range with a unit": (RANGE, 'range = [0.0, "1e200 A"]', "1e+200 A is beyond all reason"),
    "a share of 400 digits": ("rail_share = 0.5", f"rail_share = {DIGITS}", "a whole number of 1329 bits is beyond"),
    "5000 digits": ("segments = 8", f"segments = {'9' * 5000}", "not valid TOML: "),
    "text as gain": ('contact = "x_screw"', 'contact = "x_screw"\ngain = "much"', "gain (line 234): 'much': "),
    "an unknown law": ('law = "motor_copper"', 'law = "motor_coper"', "did you mean 'motor_copper'?"),
    "NUL in a column": ('"x_motor_current"', '"x\\u0000y"', "signals.x_current.column (line 210): text with control"),
    "NUL in the name": ('name = "slide"', 'name = "sl\\u0000ide"', "machine.name (line 5): text with control"),
    "no heat capacity": ('"500 J/(kg*K)"', "0", "heat_capacity (line 12): input should be greater than 0"),
    "a negative one": ('"500 J/(kg*K)"', "-500", "heat_capacity (line 12): -500: input should be greater than 0"),
    "a mesh of terabytes": (
        "divisions = [8, 4, 2]",
        "divisions = [400, 300, 200]",
        "193,041,801 nodes: some 45 TB of ",
    ),
    "segments by the billion": ("segments = 8", "segments = 1000000000", "2,000,000,000 segments: some 136 TB of mem"),
    "poses by the million": ("x = 5", "x = 10000000", "10,000,000 poses: some 120 GB of memory and 3.5 h"),
}


@pytest.mark.parametrize("case", DESCRIPTIONS)
def test_a_description_that_cannot_be_meant_is_one_clear_error(tmp_path, capsys, case):
    old, new, what = DESCRIPTIONS[case]
    path = edited(tmp_path, (old, new))
    limits = resource.getrlimit(resource.RLIMIT_AS)
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + 500_000_000, limits[1]))  # nothing of that size is allocated
    try:
        assert run(["check", str(path)]) == 2
    finally:
        resource.setrlimit(resource.RLIMIT_AS, limits)
    told = capsys.readouterr().out
    assert what in told
    assert f"{path}: " in told
    assert re.search(r"machine .*: 1 error, 0 warnings", told)
    assert told.count("remedy: ") == 1
    assert len(told) < 1500
    assert run(["build", str(path), "-o", str(tmp_path / "a.h5")]) == 2
    assert what in capsys.readouterr().err


def test_what_is_large_is_asked_about(tmp_path, capsys):
    path = edited(tmp_path, ("x = 5", "x = 3000000"))
    assert run(["check", "--no-meshes", str(path)]) == 0
    told = capsys.readouterr().out
    line = path.read_text().split("x = 3000000")[0].count("\n") + 1
    assert f"warning: {path}: poses.x (line {line}): 3,000,000 poses: some 36 GB of memory and 1.0 h" in told
    assert "leave it if it is meant" in told


FACTS = {
    "a sampling below zero": ('sampling = "5 s"', 'sampling = "-10 s"', "sampling is -10 s"),
    "no sampling": ('sampling = "5 s"', "sampling = 0", "sampling is 0 s"),
    "a start in kelvin": ('"20 degC"', "294.15", "initial_temperature: 294.15 degC is no temperature of a machine: in"),
    "a start below zero": ('"20 degC"', '"-400 degC"', "below absolute zero"),
    "a start of 400 digits": ('"20 degC"', DIGITS, "a whole number of 1329 bits is beyond all reason"),
    "5000 digits": ('"20 degC"', "9" * 5000, "not valid TOML"),
}


@pytest.mark.parametrize("case", FACTS)
def test_a_run_that_cannot_be_meant_is_one_clear_error(tmp_path, capsys, case):
    old, new, what = FACTS[case]
    folder = shutil.copytree(RUN, tmp_path / "run")
    text = (folder / "run.toml").read_text()
    assert old in text
    (folder / "run.toml").write_text(text.replace(old, new))
    assert run(["check", str(folder), "--machine", str(SLIDE)]) == 2
    told = capsys.readouterr().out
    assert what in told
    assert "1 error, 0 warnings" in told
    assert run(["losses", str(SLIDE), "--run", str(folder)]) == 2
    assert what in capsys.readouterr().err


@pytest.mark.long
@pytest.mark.parametrize(
    "name", ["loads.csv", "temperatures.csv", "tcp.csv", "run.toml", "machine.toml", "a.h5", "block.twb"]
)
def test_a_pipe_is_not_waited_for(tmp_path, name):
    folder = shutil.copytree(RUN, tmp_path / "run")
    shutil.copy(SLIDE, folder / "machine.toml")
    (folder / name).unlink(missing_ok=True)
    os.mkfifo(folder / name)
    command = {
        "machine.toml": ["check", folder / name],
        "a.h5": ["info", folder / name],
        "block.twb": ["unpack", folder / name, "-o", tmp_path / "out"],
    }.get(name, ["losses", SLIDE, "--run", folder])
    code = "import sys; from twin.cli.main import run; sys.exit(run(sys.argv[1:]))"
    told = subprocess.run([sys.executable, "-c", code, *map(str, command)], capture_output=True, text=True, timeout=60)
    assert told.returncode == 2
    assert (
        "not an ordinary file" in told.stdout + told.stderr or "no such file" in told.stderr or "neither" in told.stderr
    )
    assert "Traceback" not in told.stderr

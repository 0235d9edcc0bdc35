"""What it takes to install the process beside a machine: the systemd unit, the container file, wheels."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
from importlib import resources
from pathlib import Path

import pytest

from twin.cli.main import run
from twin.live.install.unit import unit_of

ROOT = Path(__file__).parents[2]
GIVEN = ["out/my machine.h5", "--source", "mqtt:broker/loads%1", "--out", "file:out/$now.json", "--state", "out/live"]


def test_the_unit_says_the_command_as_it_was_given(capsys):
    assert run(["live", *GIVEN, "--engine", "jax", "--print-unit"]) == 0
    told = capsys.readouterr().out
    line = next(line for line in told.splitlines() if line.startswith("ExecStart="))
    words = shlex.split(line.removeprefix("ExecStart="))
    assert words[0] == sys.executable
    assert words[4:] == [a.replace("%", "%%").replace("$", "$$") for a in [*GIVEN, "--engine", "jax"]]
    assert f"WorkingDirectory={Path.cwd()}" in told
    assert "MemoryMax=1G" in told
    assert "@" not in told


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="no systemd")
def test_systemd_finds_nothing_wrong_with_the_unit(tmp_path):
    path = tmp_path / "twin-live.service"
    path.write_text(unit_of(GIVEN, "c"))
    done = subprocess.run(["systemd-analyze", "verify", str(path)], capture_output=True, text=True, check=False)
    about = [line for line in (done.stdout + done.stderr).splitlines() if "twin-live" in line]
    assert about == []
    path.write_text(unit_of(GIVEN, "c").replace("ExecStart=", "ExecStrt="))
    wrong = subprocess.run(["systemd-analyze", "verify", str(path)], capture_output=True, text=True, check=False)
    assert "twin-live" in wrong.stdout + wrong.stderr


def test_the_container_file_copies_and_installs_what_the_wheelhouse_makes():
    text = (resources.files("twin.live.install") / "Containerfile").read_text(encoding="utf-8")
    steps = [line.split(None, 1) for line in text.splitlines() if line.strip() and not line.startswith("#")]
    assert [word for word, _ in steps] == ["FROM", "RUN", "COPY", "RUN", "STOPSIGNAL", "ENTRYPOINT"]
    told = dict(steps[2:])
    source, target = told["COPY"].split()
    assert f"-w {source}" in (ROOT / "Makefile").read_text(encoding="utf-8")
    assert f"--find-links {target} 'twin[live,mqtt]'" in steps[3][1]
    extras = re.findall(r"^(\w+) = \[", (ROOT / "pyproject.toml").read_text(encoding="utf-8"), re.M)
    assert {"live", "mqtt"} <= set(extras)


@pytest.mark.slow
def test_wheels_install_and_run_without_a_network(tmp_path):
    """Needs a package index to make them; the installation itself is told that there is none."""
    wheels, venv = tmp_path / "wheels", tmp_path / "venv"
    made = subprocess.run([sys.executable, "-m", "pip", "wheel", "-q", "-w", str(wheels), f"{ROOT}[live,mqtt]"],
                          capture_output=True, text=True, check=False)  # fmt: skip
    if made.returncode:
        pytest.skip(f"no wheels to be had: {made.stderr[-200:]}")
    subprocess.run([sys.executable, "-m", "venv", str(venv)], check=True)
    install = ["-m", "pip", "install", "-q", "--no-index", "--find-links", str(wheels), "twin[live,mqtt]"]
    subprocess.run([str(venv / "bin" / "python"), *install], check=True, env={"PATH": "/usr/bin:/bin"})
    told = subprocess.run([str(venv / "bin" / "twin"), "live", *GIVEN, "--print-unit"], capture_output=True, text=True,
                          check=True, cwd=tmp_path, env={"PATH": "/usr/bin:/bin"})  # fmt: skip
    assert "ExecStart=" in told.stdout
    code = "import twin.live.mqtt, twin.live.opcua, twin.live.engine_jax, twin.live.prepare, paho.mqtt, asyncua"
    subprocess.run([str(venv / "bin" / "python"), "-c", code], check=True, cwd=tmp_path, env={"PATH": "/usr/bin:/bin"})

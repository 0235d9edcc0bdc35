"""Air that falls in one run and rises in the other beside a machine that warms up in both: its sensor is sound."""

from __future__ import annotations

from pathlib import Path

import pytest

from twin.calibrate.channels.judge import judge
from twin.cli.main import run as command
from twin.diagnose.pipeline import Settings, diagnose
from twin.inject.machines.drawn import RUNS, draw_machine
from twin.inject.machines.other import other
from twin.logs.read import read_run
from twin.rom.artefact import read_artefact

SEED = 349  # of a drawn network: five other channels say of its air that it drifts by 4.7 K in one run


@pytest.mark.slow
def test_air_that_all_other_channels_refute_and_the_machine_felt_is_no_fault(tmp_path: Path):
    drawn, described = draw_machine(SEED, "lumped"), tmp_path / "described"
    drawn.write(described)
    machine = drawn.machine(described)
    real = tmp_path / "real"
    real.mkdir()
    (real / "machine.toml").write_text(other(drawn.text, 1000 * SEED, described), encoding="utf-8")
    noise = [f"--noise={drawn.noise[0]} K", f"--tcp-noise={drawn.noise[1] * 1e6} um", "--tcp-every=20 min"]
    for k, name in enumerate(RUNS):
        log, out = described / "runs" / name, tmp_path / name
        assert command(["simulate", str(real), str(log), "-o", str(out), *noise, f"--seed={1000 + k}"]) == 0
    assert command(["build", str(described), "-o", str(tmp_path / "a.h5")]) == 0
    first, second, sealed = (read_run(tmp_path / name) for name in RUNS)
    (told,) = judge([first, second]).findings
    assert (told.what, told.channels) == ("drift", ("shop",))
    settings = Settings(temperature_sigma=drawn.noise[0], tcp_sigma=drawn.noise[1], form=8, nulls=20)
    diagnosis = diagnose(read_artefact(tmp_path / "a.h5"), machine, [first, second], [sealed], settings).diagnosis
    assert (diagnosis.verdict, diagnosis.causes) == ("nothing", ())

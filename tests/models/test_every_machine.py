"""What holds for every shipped machine: one shape of folder, sound runs, a certificate, a closed heat balance."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from twin.build.full_model import assemble
from twin.build.scenario import draw
from twin.build.stepper import CoupledStepper
from twin.cli.main import cli
from twin.logs.read import read_run
from twin.logs.signals import signal_values
from twin.machine.load import load_machine
from twin.rom.drive import evaluate

MODELS = Path(__file__).parents[2] / "models"
FOLDERS = sorted(p.parent for p in MODELS.glob("*/machine.toml"))
DESCRIPTIONS = sorted([*MODELS.glob("*/machine.toml"), *MODELS.glob("*/nodes.toml")])
RUNS = sorted(p.parent for p in MODELS.glob("*/runs/*/run.toml"))


def name_of(path: Path) -> str:
    return "/".join(path.relative_to(MODELS).parts)


def test_the_papers_machines_are_here():
    assert {f.name for f in FOLDERS} >= {
        "five_axis",
        "ball_screw_axis",
        "transfer_unit",
        "ram_borer",
        "linear_gantry",
        "hexapod",
    }


@pytest.mark.parametrize("folder", FOLDERS, ids=name_of)
def test_every_folder_has_the_same_shape(folder):
    readme = (folder / "README.md").read_text(encoding="utf-8")
    assert "| paper " in readme.lower() or "paper | ours" in readme.lower()  # the paper's numbers beside ours
    assert any((folder / "runs").glob("*/run.toml"))
    assert (folder / "runs" / "make_runs.py").exists()
    for name in ("machine.toml", "runs"):
        assert name in readme


@pytest.mark.parametrize("path", DESCRIPTIONS, ids=name_of)
def test_every_description_is_sound(path):
    result = CliRunner().invoke(cli, ["check", str(path), "--no-meshes"], standalone_mode=False)
    assert result.return_value == 0, result.output
    assert "error" not in result.output.replace("0 errors", "")


@pytest.mark.parametrize("run", RUNS, ids=name_of)
def test_every_run_is_sound(run):
    result = CliRunner().invoke(cli, ["check", str(run)], standalone_mode=False)
    assert result.return_value == 0, result.output


@pytest.mark.slow
@pytest.mark.parametrize("path", DESCRIPTIONS, ids=name_of)
def test_the_full_model_closes_its_heat_balance(path):
    """Heat of all sources = out through films and media + stored, in every step of a run and of a drawn scenario."""
    model = assemble(load_machine(path)).thermal
    load = model.load_model
    run = read_run(next(r for r in RUNS if r.parent.parent == path.parent))
    logged = evaluate(load, run.loads.time, signal_values(run, load.signals), 60.0, 20)
    for drive in (logged, draw(load, 3, hours=1 / 3).drive):
        stepper = CoupledStepper(model)
        errors = [heat.balance_error for _, _, heat in stepper.run(drive, stepper.uniform(24.0), 4)]
        assert len(errors) == 20
        assert np.max(errors) < 1e-8

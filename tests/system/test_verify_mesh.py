"""`twin verify --mesh` through the command line: the mesh error beside the others, printed and stored."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.support.corner import corner
from twin.cli.main import run
from twin.rom.artefact import read_artefact


@pytest.mark.slow
def test_verify_states_the_mesh_error_of_every_output_and_judges_without_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    artefact = tmp_path / "corner.h5"
    assert run(["build", str(corner(tmp_path)), "-o", str(artefact)]) == 0
    capsys.readouterr()
    assert run(["verify", str(artefact), "--mesh"]) == 0
    printed = capsys.readouterr().out
    stored = read_artefact(artefact).certificate
    mesh = next(part for part in stored["parts"] if part["name"] == "mesh")
    assert mesh["counts"] is False
    assert len(mesh["scenarios"]) == 2
    assert max(mesh["temperature_error_in_case"]) > stored["limit_temperature"]  # it passes all the same
    assert np.max(stored["temperature_error_in_case"]) <= stored["limit_temperature"]
    heads, *lines = printed[printed.index("in the case, from") :].splitlines()
    assert heads.split()[-7:] == ["rich", "basis", "together", "mesh", "as", "drawn", "range"]
    for j, sensor in enumerate(stored["sensors"]):
        *_, together, own, _, _ = lines[j].split()
        assert lines[j].split()[:2] == [sensor, "[K]"]
        assert float(own) == pytest.approx(mesh["temperature_error_in_case"][j], abs=6e-5)
        assert float(together) == pytest.approx(stored["temperature_error_in_case"][j], abs=6e-5)
    for k in range(3):
        assert float(lines[3 + k].split()[-3]) == pytest.approx(1e6 * mesh["displacement_error_in_case"][k], abs=6e-4)
    assert "not in the sums" in printed
    assert run(["verify", str(artefact)]) == 0  # without --mesh: the mesh has not changed
    assert mesh in read_artefact(artefact).certificate["parts"]

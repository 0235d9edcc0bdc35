"""`twin losses` from the outside: tables, explanations, runs, and mistakes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support.descriptions import SLIDE, edited
from twin.cli.main import run
from twin.physics import joints
from twin.physics.laws import LAWS
from twin.physics.radiation import radiation_coefficient

RUN = SLIDE.parent / "runs" / "short"
MOTOR = ('law = "motor_copper"\nsurface = "block.x_min"\nparameters = { resistance = "0.5 ohm" }\n',)
BOLTED = (
    'surfaces = ["bed.z_min", "foot_1.z_max"]\nconductance = "2000 W/(m^2*K)"',
    'surfaces = ["bed.z_min", "foot_1.z_max"]\n[contacts.foot_1.joint]\nlaw = "bolted_joint"\n'
    "[contacts.foot_1.joint.parameters]\n"
    'conductivity_1 = "50 W/(m*K)"\nconductivity_2 = "45 W/(m*K)"\nroughness_1 = "1.6 um"\nroughness_2 = "1.6 um"\n'
    'slope_1 = 0.15\nslope_2 = 0.15\nhardness = "2.6 GPa"\npressure = "5 MPa"',
)


def losses(capsys: pytest.CaptureFixture, *arguments: object) -> Any:
    assert run(["losses", "--json", *map(str, arguments)]) == 0
    return json.loads(capsys.readouterr().out)


def values(explanation: dict[str, Any]) -> dict[str, float]:
    return {entry["name"]: entry["value"] for entry in explanation["inputs"]}


def refused(capsys: pytest.CaptureFixture, *arguments: object) -> str:
    assert run(["losses", *map(str, arguments)]) == 2
    told = capsys.readouterr()
    assert "Traceback" not in told.err
    assert told.out == ""
    return told.err


def warm_motor(folder: Path, *more: tuple[str, str]) -> Path:
    """The slide with a motor whose resistance follows its temperature."""
    law = 'law = "motor_winding"\nsurface = "block.x_min"\nparameters = { resistance = "0.5 ohm" }\n'
    return edited(folder, (MOTOR[0], law), *more)


def test_table_of_sources_and_films(capsys):
    told = losses(capsys, SLIDE)
    assert "upper bound" in told["load"]
    by_path = {law["path"]: law for law in told["laws"]}
    motor = by_path["sources.x_motor"]
    assert motor["result"]["value"] == pytest.approx(3 * 0.5 * 12.0**2, rel=1e-12)  # range to 12 A
    assert (motor["unit"], motor["law"], motor["holds"]) == ("W", "motor_copper", True)
    film = by_path["films.moving"]
    assert film["result"]["value"] == pytest.approx(6.0 + 20.0 * 0.5**0.8, rel=1e-12)  # range to 0.5 m/s
    assert by_path["contacts.foot_1"]["law"] is None


def test_text_of_the_table(capsys):
    assert run(["losses", str(SLIDE)]) == 0
    out = capsys.readouterr().out
    assert "upper bound of its certified range" in out
    for expected in ("x_motor", "motor_copper", "216", "moving", "forced_film", "17.49", "10 K above"):
        assert expected in out


def test_explain_a_source(capsys):
    assert run(["losses", str(SLIDE), "--explain", "sources.x_motor", "--set", "x_current=8 A"]) == 0
    out = capsys.readouterr().out
    for expected in (
        "P = 3 R I^2", "8 A", "signal x_current (column x_motor_current): set", "0.5 ohm",
        "sources.x_motor.parameters.resistance", "paper 000 eq (8) with erratum E-000-4", "96 W", "block.x_min",
    ):  # fmt: skip
        assert expected in out


def test_gain_is_part_of_the_result(tmp_path, capsys):
    machine = edited(tmp_path, (MOTOR[0], MOTOR[0] + "gain = 1.5\n"))
    told = losses(capsys, machine, "--explain", "sources.x_motor", "--set", "x_current=8 A")
    assert told["result"]["value"] == pytest.approx(1.5 * 96.0, rel=1e-12)
    assert values(told)["gain"] == 1.5


def test_a_bare_number_is_in_the_unit_of_the_signal(capsys):
    told = losses(capsys, SLIDE, "--explain", "sources.x_guide", "--set", "x_speed=6")
    assert values(told)["speed"] == pytest.approx(0.1, rel=1e-12)  # 6 m/min


def test_peaks_are_set_as_they_are_logged(tmp_path, capsys):
    machine = edited(tmp_path, ('kind = "rms"', 'kind = "peak"'))
    told = losses(capsys, machine, "--explain", "sources.x_motor", "--set", "x_current=8 A")
    assert told["result"]["value"] == pytest.approx(48.0, rel=1e-12)
    assert "peak turned into rms" in told["inputs"][0]["origin"]


def test_temperatures_of_the_model_are_stated_and_can_be_set(tmp_path, capsys):
    machine = warm_motor(tmp_path)
    told = losses(capsys, machine, "--explain", "sources.x_motor", "--set", "x_current=10 A")
    assert told["result"]["value"] == pytest.approx(150.0, rel=1e-12)  # at the reference temperature of 20 degC
    origin = {entry["name"]: entry["origin"] for entry in told["inputs"]}
    assert "from the model, one step late" in origin["temperature"]
    assert origin["coefficient"] == "default of the law"
    hot = losses(capsys, machine, "--explain", "sources.x_motor", "--set", "x_current=10", "--set", "temperature=120")
    assert hot["result"]["value"] == pytest.approx(150.0 * 1.393, rel=1e-12)


def test_a_measured_winding_temperature(tmp_path, capsys):
    wired = ('signals = { current = "x_current" }', 'signals = { current = "x_current", temperature = "shop_air" }')
    told = losses(capsys, warm_motor(tmp_path, wired), "--explain", "sources.x_motor", "--set", "shop_air=70 degC")
    assert values(told)["temperature"] == 70.0
    assert "signal shop_air" in {entry["name"]: entry["origin"] for entry in told["inputs"]}["temperature"]


def natural(folder: Path, emissivity: str) -> Path:
    """The slide with free convection on its structure."""
    text = SLIDE.read_text(encoding="utf-8")
    start = text.index("[films.structure]")
    end = text.index("[films.moving]")
    film = (
        '[films.structure]\nlaw = "free_vertical_plate"\nsurfaces = ["bed.*", "rail_1.*", "rail_2.*", "block.*"]\n'
        f'environment = "shop"\nradiant = "floor"\nparameters = {{ height = "100 mm" }}\n{emissivity}\n\n'
    )
    path = folder / "machine.toml"
    path.write_text(text[:start] + film + text[end:], encoding="utf-8")
    return path


def test_convection_and_radiation_of_a_film(tmp_path, capsys):
    """Air of 22 degC, the surface 10 K above, the floor of 19 degC around it."""
    arguments = ("--explain", "films.structure", "--set", "shop_air=22 degC")
    told = losses(capsys, natural(tmp_path, "emissivity = 0.5"), *arguments)
    law = LAWS["free_vertical_plate"].function
    assert told["result"]["value"] == pytest.approx(float(law(surface=32.0, ambient=22.0, height=0.1)), rel=1e-12)
    assert told["radiation"]["value"] == pytest.approx(radiation_coefficient(32.0, 19.0, 0.5), rel=1e-12)
    given = values(told)
    assert (given["surface"], given["ambient"], given["radiant"], given["emissivity"]) == (32.0, 22.0, 19.0, 0.5)
    cooler = losses(capsys, natural(tmp_path, "emissivity = 0"), *arguments, "--set", "surface=24 degC")
    assert cooler["result"]["value"] == pytest.approx(float(law(surface=24.0, ambient=22.0, height=0.1)), rel=1e-12)
    assert cooler["radiation"]["value"] == 0.0


def test_paint_by_default(tmp_path, capsys):
    told = losses(capsys, natural(tmp_path, ""), "--explain", "films.structure", "--set", "shop_air=22 degC")
    assert told["radiation"]["value"] == pytest.approx(radiation_coefficient(32.0, 19.0, 0.9), rel=1e-12)


def test_outside_its_validity_a_law_says_so(tmp_path, capsys):
    machine = natural(tmp_path, "")
    assert run(["losses", str(machine), "--set", "surface=180 degC"]) == 0
    out = capsys.readouterr().out
    assert "outside the validity of their laws:" in out
    assert "films.structure: 0.1 < Ra < 1e12" in out
    told = losses(capsys, machine, "--explain", "films.structure", "--set", "surface=180 degC")
    assert told["holds"] is False
    assert run(["losses", str(machine), "--explain", "films.structure", "--set", "surface=180 degC"]) == 0
    assert "does NOT hold" in capsys.readouterr().out


def test_a_coolant_channel_does_not_need_its_meshes(tmp_path, capsys):
    signal = '[signals.coolant]\nunit = "l/min"\nrange = [0.0, 6.0]\n\n[environment.shop]'
    text = natural(tmp_path, "").read_text(encoding="utf-8")
    text = text.replace("[environment.shop]", signal)
    text = text.replace('law = "free_vertical_plate"', 'law = "coolant_channel"\nsignals = { flow = "coolant" }')
    text = text.replace('height = "100 mm"', 'diameter = "10 mm", channel_length = "1 m"')
    (tmp_path / "machine.toml").write_text(text, encoding="utf-8")
    told = losses(capsys, tmp_path, "--explain", "films.structure")
    assert values(told)["flow"] == pytest.approx(1e-4, rel=1e-12)
    assert values(told)["area"] == pytest.approx(np.pi * 0.01, rel=1e-12)
    assert told["radiation"]["value"] == 0.0  # a channel sees no surroundings
    assert told["result"]["value"] > 1000.0


def test_explain_a_joint(tmp_path, capsys):
    machine = edited(tmp_path, BOLTED)
    told = losses(capsys, machine, "--explain", "contacts.foot_1")
    assert told["law"] == "bolted_joint"
    solid = joints.solid_conductance(50.0, 45.0, 1.6e-6, 1.6e-6, 0.15, 0.15, 5e6, 2.6e9)
    assert told["result"]["value"] > float(solid) + 3000.0
    assert run(["losses", str(machine)]) == 0
    assert "bolted_joint" in capsys.readouterr().out


def test_a_joint_without_pressure_and_bolts_is_refused(tmp_path, capsys):
    loose = (BOLTED[0], BOLTED[1].replace('\npressure = "5 MPa"', ""))
    assert "contacts.foot_1.joint" in refused(capsys, edited(tmp_path, loose))


def test_assumed_values_are_named(tmp_path, capsys):
    text = natural(tmp_path, "").read_text(encoding="utf-8")
    text = text.replace('law = "free_vertical_plate"', 'law = "enclosed_gap"')
    (tmp_path / "machine.toml").write_text(text.replace('height = "100 mm"', "conductance = 2.0"), encoding="utf-8")
    assert run(["losses", str(tmp_path)]) == 0
    assert "assumed values: films.structure" in capsys.readouterr().out


def test_over_a_run(capsys):
    """Mean, largest value and energy of powers; a sample holds until the next."""
    told = losses(capsys, SLIDE, "--run", RUN, "--explain", "sources.x_motor")
    log = np.genfromtxt(RUN / "loads.csv", delimiter=",", skip_header=1)
    time, current = log[:, 0], log[:, 3]
    energy = float(np.sum(1.5 * current[:-1] ** 2 * np.diff(time)))
    assert told["result"]["energy_J"] == pytest.approx(energy, rel=1e-12)
    assert told["result"]["mean"] == pytest.approx(energy / (time[-1] - time[0]), rel=1e-12)
    assert told["result"]["max"] == pytest.approx(1.5 * np.max(current) ** 2, rel=1e-12)
    assert told["result"]["mean"] > 1.02 * 1.5 * np.mean(current) ** 2  # not the power of the mean
    assert run(["losses", str(SLIDE), "--run", str(RUN)]) == 0
    out = capsys.readouterr().out
    assert "energy [Wh]" in out
    assert f"{energy / 3600:.4g}" in out


def test_a_signal_set_over_a_run_need_not_be_logged(tmp_path, capsys):
    header, *rows = (RUN / "loads.csv").read_text(encoding="utf-8").splitlines()
    kept = [",".join(cell for k, cell in enumerate(line.split(",")) if k != 3) for line in (header, *rows)]
    (tmp_path / "loads.csv").write_text("\n".join(kept) + "\n", encoding="utf-8")
    (tmp_path / "run.toml").write_text((RUN / "run.toml").read_text(encoding="utf-8"), encoding="utf-8")
    assert "x_motor_current" in refused(capsys, SLIDE, "--run", tmp_path)
    told = losses(capsys, SLIDE, "--run", tmp_path, "--explain", "sources.x_motor", "--set", "x_current=8 A")
    assert told["result"]["mean"] == pytest.approx(96.0, rel=1e-12)


def test_an_unknown_path(capsys):
    assert "did you mean 'sources.x_motor'?" in refused(capsys, SLIDE, "--explain", "sources.x_motr")


@pytest.mark.parametrize(
    ("setting", "told"),
    [
        ("x_curent=8", "did you mean 'x_current'?"),
        ("x_current", "sets nothing"),
        ("x_current=8 mm", "not a quantity in A"),
        ("surface=3 A", "not a quantity in degC"),
        ("x_current=nan", "not a quantity in A"),
    ],
)
def test_wrong_settings(capsys, setting, told):
    assert told in refused(capsys, SLIDE, "--set", setting)


def test_a_machine_that_does_not_exist(tmp_path, capsys):
    assert "no such file" in refused(capsys, tmp_path / "nothing")


def test_a_name_that_is_a_signal_and_a_temperature_of_the_model_says_which(tmp_path, capsys):
    path = natural(tmp_path, "emissivity = 0")
    path.write_text(path.read_text(encoding="utf-8").replace("shop_air", "ambient"), encoding="utf-8")
    film = ("--explain", "films.structure", "--set", "surface=40 degC")
    told = refused(capsys, path, *film, "--set", "ambient=22 degC")
    assert "'ambient' is a signal and a temperature of the model" in told
    assert "write signals.ambient=22 degC, or model.ambient=22 degC" in told
    of_signal = losses(capsys, path, *film, "--set", "signals.ambient=22 degC")
    of_model = losses(capsys, path, *film, "--set", "model.ambient=26 degC")
    assert (values(of_signal)["ambient"], values(of_model)["ambient"]) == (22.0, 26.0)
    assert "nothing called 'signals.surface'" in refused(capsys, path, "--set", "signals.surface=22 degC")

"""An additional film is as good as a larger coefficient of the film that its surfaces have."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.support import descriptions, lumped
from twin.build.lumped import assemble_lumped, lumped_bodies
from twin.build.mesh import load_body_meshes
from twin.build.scenario import draw, theta_bounds
from twin.build.stepper import CoupledStepper
from twin.build.thermal import assemble_thermal
from twin.errors import DescriptionError
from twin.machine.load import load_machine
from twin.rom.drive import evaluate
from twin.rom.model import MachineModel

FAN = '\n[signals.fan]\nunit = "1"\nrange = [0.0, 1.0]\ndefault = 0\n'


def film(name: str, surfaces: str, coefficient: float, more: str = "", law: str = "constant_film") -> str:
    return (
        f'\n[films.{name}]\nlaw = "{law}"\nsurfaces = {surfaces}\nenvironment = "shop"\n'
        f'parameters = {{ natural = "{coefficient} W/(m^2*K)" }}\n{more}\n'
    )


def slide(folder: Path, *texts: str) -> MachineModel:
    folder.mkdir()
    text = descriptions.SLIDE.read_text(encoding="utf-8") + "".join(texts)
    (folder / "machine.toml").write_text(text, encoding="utf-8")
    machine = load_machine(folder / "machine.toml")
    return assemble_thermal(machine, load_body_meshes(machine))


def spindle(folder: Path, *edits: tuple[str, str]) -> MachineModel:
    folder.mkdir()
    machine = load_machine(lumped.edited(folder, *edits))
    return assemble_lumped(machine, lumped_bodies(machine))


def cooled(model: MachineModel, fan: float | None = None) -> np.ndarray:
    """Temperatures (n,) [degC] of a machine at 35 degC after an hour in a shop of 20, its axis at work."""
    time = np.arange(0.0, 3601.0, 60.0)
    values = {s.name: 20.0 if s.unit == "degC" else 0.3 * s.high for s in model.load_model.signals if s.name != "fan"}
    signals = {name: np.full(len(time), value) for name, value in values.items()}
    drive = evaluate(model.load_model, time, signals if fan is None else signals | {"fan": np.full(61, fan)}, 300.0)
    stepper = CoupledStepper(model)
    x = stepper.uniform(35.0)
    for _, now, heat in stepper.run(drive, x):
        x = now
        assert heat.balance_error < 1e-8
    return np.concatenate(x)


def test_of_the_full_model(tmp_path):
    more = slide(tmp_path / "more", film("draught", '["bed.x_min", "bed.y_max"]', 5.0, "additional = true"))
    own = slide(tmp_path / "own", film("draught", '["bed.x_min", "bed.y_max"]', 11.0, "emissivity = 0.0"))
    np.testing.assert_allclose(cooled(more), cooled(own), atol=1e-9)
    assert np.abs(cooled(more) - cooled(slide(tmp_path / "plain"))).max() > 0.1
    (draught,) = [f for f in more.load_model.films if f.name == "draught"]
    assert (draught.additional, draught.emissivity) == (True, 0.0)  # paint, were it a film of its own


def test_of_an_adiabatic_surface(tmp_path):
    """The adiabatic foot becomes one with a film; the part's other surfaces stay with theirs."""
    model = slide(tmp_path / "a", film("floor_heat", '["foot_1.z_min"]', 8.0, "additional = true"))
    k = [f.name for f in model.load_model.films].index("floor_heat")
    (area,) = [float(b.M[:, b.theta.index(k)].sum()) for b in model.bodies if k in b.theta]
    assert area == pytest.approx(0.06 * 0.06, rel=1e-9)


def test_an_additional_film_of_a_node_adds_to_the_first(tmp_path):
    """The other film of the bed has no area of its own either: both act on all of it."""
    start = "[films.moving]"
    more = film("draught", '["bed", "screw"]', 5.0, "additional = true") + start
    bed = 'surfaces = ["housing", "shaft", "bed"]\nenvironment = "shop"\n'
    added = spindle(tmp_path / "more", (start, more), (bed, bed + "emissivity = 0.0\n"))
    apart = film("bed", '["bed"]', 11.0, "emissivity = 0.0") + film("screw", '["screw"]', 5.0, "emissivity = 0.0\n"
        'area = "0.06 m^2"') + start  # fmt: skip
    without = 'surfaces = ["housing", "shaft"]\nenvironment = "shop"\nemissivity = 0.0\n'
    own = spindle(tmp_path / "own", (start, apart), (bed, without))
    np.testing.assert_allclose(cooled(added), cooled(own), atol=1e-9)


def test_a_switched_film_is_there_while_it_is_on(tmp_path):
    blast = film("blast", '["slide.x_min"]', 40.0, "additional = true\nsignals = { switch = 'fan' }", "switched_film")
    model = slide(tmp_path / "switched", FAN, blast)
    plain = cooled(slide(tmp_path / "plain"))
    np.testing.assert_allclose(cooled(model, 0.0), plain, atol=1e-10)
    np.testing.assert_allclose(cooled(model), plain, atol=1e-10)  # not logged: off
    always = slide(tmp_path / "always", film("blast", '["slide.x_min"]', 40.0, "additional = true"))
    np.testing.assert_allclose(cooled(model, 1.0), cooled(always), atol=1e-10)
    assert np.abs(cooled(model, 1.0) - plain).max() > 0.1
    low, high = theta_bounds(model.load_model)
    k = model.load_model.theta_names.index("films.blast")
    assert 0.0 < low[k] < 0.01 * high[k]
    assert high[k] == pytest.approx(80.0)
    for seed in range(4):  # scenarios with coefficients anywhere in the box
        assert np.all(np.isfinite(draw(model.load_model, seed, hours=0.5).drive.theta))


def test_a_film_that_may_be_off_is_refused_as_the_only_one_of_its_surfaces(tmp_path):
    blast = film("blast", '["slide.x_min"]', 40.0, "emissivity = 0.0\nsignals = { switch = 'fan' }", "switched_film")
    with pytest.raises(DescriptionError, match="gives 0") as e:
        slide(tmp_path / "a", FAN, blast)
    assert "`additional`" in e.value.problems[0].remedy

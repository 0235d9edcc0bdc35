"""Films with `each`: a film of its own for every part or surface, whose law reads the temperature of its own place."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.support.lumped import write
from twin.build.full_model import assemble
from twin.build.stepper import CoupledStepper
from twin.cli.main import run
from twin.errors import DescriptionError
from twin.machine.instances import written_out
from twin.machine.load import load_machine
from twin.rom.drive import evaluate

PLATE = Path("tests/machines/plate/machine.toml").read_text(encoding="utf-8")
SIDES = '"plate.x_min", "plate.x_max", "plate.y_min", "plate.y_max", "plate.z_max"'
WALLS = """
[nodes.warm]
capacity = "3 kJ/K"
area = "0.2 m^2"
[nodes.cold]
capacity = "5 kJ/K"
area = "0.3 m^2"
[films.wall]
law = "free_vertical_plate"
surfaces = ["warm", "cold"]
environment = "air"
emissivity = 0.0
parameters = { height = "400 mm" }
"""
HEATED = """
[sources.heater]
law = "constant_heat"
surface = "warm"
parameters = { power = "60 W" }
"""


def read(folder: Path, text: str):
    (folder / "machine.toml").write_text(text, encoding="utf-8")
    return load_machine(folder)


def each(text: str, what: str) -> str:
    return text.replace('environment = "shop"\nparameters', f'each = "{what}"\nenvironment = "shop"\nparameters')


def by_hand(names: dict[str, str]) -> str:
    """The plate with a film per name, of the surfaces told."""
    before, rest = PLATE.split("[films.air]")
    film, after = rest.split("[sensors.bottom]")
    films = (f"[films.{name}]" + film.replace('["plate.*"]', f"[{s}]") for name, s in names.items())
    return before + "".join(films) + "[sensors.bottom]" + after


def test_it_is_what_one_would_write_by_hand(tmp_path):
    named = PLATE.replace('"plate.*"', SIDES)
    apart = {"air_" + s.strip().strip('"').replace(".", "_"): s for s in SIDES.split(",")}
    assert read(tmp_path, each(named, "surface")) == read(tmp_path, by_hand(apart))
    assert read(tmp_path, each(named, "part")) == read(tmp_path, by_hand({"air_plate": SIDES}))
    assert read(tmp_path, each(PLATE, "part")) == read(tmp_path, by_hand({"air_plate": '"plate.*"'}))


def test_an_instance_has_its_own_pieces(tmp_path):
    """A film of a template: its pieces have the names of nodes of the instance."""
    text = write(tmp_path, "").read_text(encoding="utf-8")
    template = WALLS.replace("[nodes.", "[templates.t.nodes.").replace("[films.", "[templates.t.films.")
    machine = read(tmp_path, text + template + 'each = "part"\n[instances.one]\nof = "t"\n[instances.two]\nof = "t"\n')
    assert {name: film.surfaces for name, film in machine.films.items()} == {
        f"{own}_wall_{own}_{node}": (f"{own}_{node}",) for own in ("one", "two") for node in ("warm", "cold")
    }


def test_the_text_written_out_is_the_same_machine(tmp_path):
    text = each(PLATE.replace('"plate.*"', SIDES), "surface")
    out = written_out(text)
    assert "air_plate_z_max" in tomllib.loads(out)["films"]
    assert read(tmp_path, out) == read(tmp_path, text)


def test_mistakes_are_told_at_the_film_they_were_made_in(tmp_path):
    with pytest.raises(DescriptionError, match=r"films.air.surfaces \(line \d+\): 'plate\.\*' does not say"):
        read(tmp_path, each(PLATE, "surface"))
    with pytest.raises(DescriptionError, match=r"films.air \(line \d+\): makes films.air_plate, which"):
        read(tmp_path, each(PLATE, "part") + '[films.air_plate]\nlaw = "constant_film"\n')
    with pytest.raises(DescriptionError, match=r"films.air.each"):
        read(tmp_path, each(PLATE, "node"))
    with pytest.raises(DescriptionError) as caught:  # one mistake, however many films it is in
        read(tmp_path, each(PLATE.replace('"plate.*"', SIDES), "surface").replace("natural =", "naturel ="))
    (problem,) = caught.value.problems
    assert "films.air.parameters.naturel (line" in problem.where


def test_every_wall_has_the_coefficient_of_its_own_temperature(tmp_path):
    """Against the ordinary differential equations of two walls, with Churchill and Chu's plate written out again."""
    path = write(tmp_path, WALLS + 'each = "part"\n', HEATED)
    own = hours_of(path, 4.0)

    def h(surface: float) -> float:  # VDI-Waermeatlas F2, air at the film temperature as in D2.2
        film = np.clip((surface + 20.0) / 2, 0.0, 80.0)
        k = np.interp(film, [0, 20, 40, 60, 80], [24.36e-3, 25.87e-3, 27.35e-3, 28.80e-3, 30.23e-3])
        nu = np.interp(film, [0, 20, 40, 60, 80], [135.2e-7, 153.5e-7, 172.3e-7, 192.2e-7, 213.5e-7])
        pr = np.interp(film, [0, 20, 40, 60, 80], [0.7179, 0.7148, 0.7122, 0.7100, 0.7083])
        ra = 9.81 / (film + 273.15) * abs(surface - 20.0) * 0.4**3 / nu**2 * pr
        f1 = (1.0 + (0.492 / pr) ** (9 / 16)) ** (-16 / 9)
        return (0.825 + 0.387 * (ra * f1) ** (1 / 6)) ** 2 * k / 0.4

    def rate(_: float, T: np.ndarray) -> list[float]:
        return [(60.0 - h(T[0]) * 0.2 * (T[0] - 20.0)) / 3e3, -h(T[1]) * 0.3 * (T[1] - 20.0) / 5e3]

    exact = solve_ivp(rate, (0.0, 4 * 3600.0), [35.0, 35.0], rtol=1e-8, atol=1e-8).y[:, -1]
    assert own == pytest.approx(exact, abs=0.02 * (exact[0] - 20.0))  # air's numbers by other tables
    together = hours_of(write(tmp_path, WALLS, HEATED), 4.0)
    assert abs(together[0] - exact[0]) > 3.0  # the mean is colder: less heat goes
    assert abs(together[0] - exact[0]) > 10.0 * abs(own[0] - exact[0])


def hours_of(path: Path, hours: float) -> np.ndarray:
    """(2,) degC of both walls after so many hours, from 35 degC."""
    full = assemble(load_machine(path))
    time = np.array([0.0, hours * 3600.0])
    drive = evaluate(full.thermal.load_model, time, {"current": np.zeros(2)}, 60.0)
    stepper = CoupledStepper(full.thermal)
    *_, (_, x, _) = stepper.run(drive, stepper.uniform(35.0))
    return 20.0 + np.concatenate(x)


def test_explained_by_the_name_of_its_piece(tmp_path):
    path = write(tmp_path, WALLS + 'each = "part"\n', HEATED)
    assert run(["losses", str(path.parent), "--explain", "films.wall_cold"]) == 0

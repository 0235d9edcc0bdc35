"""`twin diagnose` on a lumped machine, from a hidden cause to an extended artefact: places are nodes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from twin.build.places import places_of, with_places
from twin.cli.main import run as command
from twin.machine.load import load_machine
from twin.rom.artefact import read_artefact

MACHINE = Path(__file__).parent / "four_nodes"
HOURS, HEAT = 8, 40.0
LEVELS = np.array([0.0, 1.0, 0.6, 0.6, 0.0, 1.0, 0.3, 0.8, 0.8])  # of the load, an hour each
NULLS = ("--nulls", "20")


def twin(*arguments: object) -> None:
    assert command([str(a) for a in arguments]) == 0, arguments


def loads(folder: Path, seed: int) -> Path:
    """A day of levels of load in an air that swings."""
    folder.mkdir()
    t = np.arange(0.0, 3600.0 * HOURS + 1.0, 60.0)
    level = np.roll(LEVELS, seed)[(t // 3600.0).astype(int)]
    air = 20.0 + 1.5 * np.sin(2 * np.pi * t / (9 * 3600.0) + seed)
    rows = np.column_stack([t, 5000.0 * level, 14.0 * np.sqrt(level), air])
    lines = ["time [s],speed [1/min],current [A],air [degC]", *(",".join(f"{v:.6g}" for v in row) for row in rows)]
    (folder / "loads.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (folder / "run.toml").write_text(
        'sampling = "60 s"\nprovenance = "made for a test"\nsynthetic = ["loads"]\ninitial_temperature = "20 degC"\n',
        encoding="utf-8",
    )
    return folder


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The artefact, and measured days: with nothing hidden, with heat at the column, with a sensor that drifts."""
    out = tmp_path_factory.mktemp("lumped")
    monday, tuesday = loads(out / "monday", 0), loads(out / "tuesday", 4)
    noise = ("--noise", "0.1 K", "--tcp-noise", "1 um")
    twin("build", MACHINE, "-o", out / "four.h5")
    twin("hide", "heat_source", "column", f"{HEAT:g} W", MACHINE, "-o", out / "hidden")
    twin("simulate", MACHINE, monday, "-o", out / "nothing", *noise, "--seed", 1)
    twin("simulate", out / "hidden", monday, "-o", out / "heat", *noise, "--seed", 2)
    twin("simulate", out / "hidden", tuesday, "-o", out / "sealed", *noise, "--seed", 3)
    twin("hide", "sensor", "sensors.head", "3 K", out / "nothing", "-o", out / "drift", "--history", "drift")
    return out


def diagnosed(made: Path, run: str, *more: object) -> dict[str, Any]:
    target = made / f"diagnosis_{run}"
    twin("diagnose", made / "four.h5", made / run, "-o", target, *NULLS, *more)
    assert (target / "index.html").stat().st_size > 10_000
    return dict(json.loads((target / "report.json").read_text(encoding="utf-8")))


def test_a_place_is_a_node_with_the_area_of_its_film() -> None:
    from twin.build.full_model import assemble

    machine = load_machine(MACHINE)
    full = assemble(machine)
    places = places_of(machine, full)
    assert [(p.name, p.film, p.area) for p in places] == [
        ("motor", "drive", 0.15), ("head", "drive", 0.4), ("column", "structure", 0.8), ("bed", "structure", 1.5),
    ]  # fmt: skip
    (body,) = with_places(full, places).bodies
    films = len(full.thermal.load_model.films)
    own = [body.M[:, body.theta.index(films + k)].sum() for k in range(len(places))]
    assert own == pytest.approx([p.area for p in places])  # a W/(m^2 K) more on a node is as much as on its film


@pytest.mark.slow
def test_nothing_hidden_is_nothing(made: Path) -> None:
    found = diagnosed(made, "nothing")
    assert found["verdict"] == "nothing"
    assert found["causes"] == []


@pytest.mark.slow
def test_heat_is_named_at_its_node_and_helps_on_another_day(made: Path) -> None:
    found = diagnosed(made, "heat", "--sealed", made / "sealed")
    assert found["verdict"] == "named"
    (cause,) = found["causes"]
    assert (cause["family"], cause["place"], cause["history"]) == ("heat_source", "column", "always")
    low, high = cause["ci95"]
    assert low < HEAT < high
    assert high - low < HEAT
    gain = {g["channel"]: g for g in found["gain"]}
    assert gain["column"]["extended"] < 0.5 * gain["column"]["recalibrated"]
    extended = read_artefact(made / "diagnosis_heat" / "extended.h5")
    twin("verify", made / "diagnosis_heat" / "extended.h5")
    (source,) = (s for s in extended.model.load_model.sources if s.name == "found_1")
    assert source.use.parameters["power"] == pytest.approx(cause["amplitude"], rel=1e-4)


@pytest.mark.slow
def test_a_drifting_sensor_is_blamed_itself(made: Path) -> None:
    found = diagnosed(made, "drift")
    assert found["verdict"] == "sensor"
    assert [(c["family"], c["place"], c["history"]) for c in found["causes"]] == [("sensor", "sensors.head", "drift")]
    assert not (made / "diagnosis_drift" / "machine.toml").exists()  # the description is not at fault


@pytest.mark.slow
def test_displacements_alone_from_their_first_row_on_are_enough(made: Path) -> None:
    """As the measured spindle has it: no sensor on the machine, and deviations that count from the first."""
    run = made / "tcp_only"
    twin(
        "simulate", made / "hidden", made / "monday", "-o", run, "--tcp-every", "20 min", "--tcp-noise", "0.1 um",
        "--seed", 4,
    )  # fmt: skip
    (run / "temperatures.csv").unlink()
    header, *rows = (run / "tcp.csv").read_text(encoding="utf-8").splitlines()
    names = header.split(",")
    values = np.array([[float(v) for v in row.split(",")] for row in rows])
    moving = [i for i, name in enumerate(names) if name[:2] in ("dx", "dy", "dz")]
    values[:, moving] -= values[0, moving]
    lines = [header, *(",".join(f"{v:.9g}" for v in row) for row in values)]
    (run / "tcp.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    about = (run / "run.toml").read_text(encoding="utf-8")
    (run / "run.toml").write_text(f'tcp_reference = "first"\n{about}', encoding="utf-8")
    found = diagnosed(made, "tcp_only", "--tcp-noise", "0.1 um")
    assert found["verdict"] != "nothing"
    assert found["observed"]["heat_source"] > found["thresholds"]["heat_source"]
    best = next(r for r in found["ranked"] if r["family"] == "heat_source")
    assert best["place"] == "column"
    assert [s for s in found["whiteness"] if s[0] in ("motor", "head", "column", "bed")] == []


@pytest.mark.long
def test_too_few_measurements_are_refused(made: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = made / "few"
    twin("simulate", MACHINE, made / "monday", "-o", run, "--tcp-every", "1 h")
    (run / "temperatures.csv").unlink()
    assert command(["diagnose", str(made / "four.h5"), str(run), "-o", str(made / "none"), *NULLS]) != 0
    assert "too few measurements" in capsys.readouterr().err

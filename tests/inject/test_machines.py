"""Machines drawn from a seed: sound descriptions, loads that are accepted, responses of a size that can be measured."""

from __future__ import annotations

import re
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from tests.support.descriptions import MACHINES
from twin.cli.main import run as command
from twin.errors import TwinError
from twin.face.check import check
from twin.inject.machines.boxes import node_count
from twin.inject.machines.drawn import RUNS, DrawnMachine, draw_machine, main
from twin.inject.machines.heat import POWER, SIGNALS, USUAL, drive_law, heat
from twin.inject.machines.loads import LoadsOfRun, loads_of_run
from twin.inject.machines.machine_of_boxes import machine_of_boxes
from twin.inject.machines.network import network
from twin.inject.machines.other import OFF, other, other_divisions
from twin.inject.machines.other_films import AIR, RADIATION, WARMER
from twin.inject.machines.scale import response, simulated
from twin.inject.machines.structure import LAYOUTS, structure
from twin.inject.machines.text_edits import spread_values, with_divisions, with_table, with_values
from twin.logs.read import read_run
from twin.machine.load import load_machine
from twin.machine.parameters import parameters
from twin.physics.laws import LAWS

SEEDS = range(40)
CHECKED = [pytest.param(seed, marks=() if seed < 8 else pytest.mark.slow) for seed in SEEDS]
WARMEST, MOVED = (3.0, 15.0), (5e-6, 60e-6)  # K, m: what a truth may do in its first run
MODELS = Path(__file__).parents[2] / "models"
SLIDE = Path(__file__).parents[1] / "machines" / "slide" / "machine.toml"


@cache
def drawn(seed: int, kind: str) -> DrawnMachine:
    return draw_machine(seed, "boxes" if kind == "boxes" else "lumped")


def sketch(seed: int, kind: str) -> tuple[str, int]:
    """A description before its powers are scaled, which takes simulations; and its number of parts."""
    text, parts = (machine_of_boxes if kind == "boxes" else network)(np.random.default_rng([seed, 0]), "sketch")
    return text(1.0), parts


def written(text: str, folder: Path) -> Path:
    folder.mkdir()
    (folder / "machine.toml").write_text(text, encoding="utf-8")
    return folder


@pytest.mark.parametrize("kind", ["boxes", "lumped"])
@pytest.mark.parametrize("seed", CHECKED)
def test_a_description_has_no_problems(seed, kind, tmp_path):
    text, parts = sketch(seed, kind)
    found = check(written(text, tmp_path / "m"))
    assert found.problems == ()
    assert kind != "boxes" or 400 < int(str(found.facts["nodes"])) < 3000
    machine = load_machine(tmp_path / "m")
    assert parts in (range(3, 7) if kind == "boxes" else range(4, 12))
    assert 4 <= len(machine.sensors) <= 32
    assert 2 <= len(machine.sources) <= 4
    assert 2 <= len(machine.films) <= 3
    assert 1 <= len(machine.environment) <= 2
    assert len(machine.axes) <= 2
    assert machine.has_tcp
    assert max(map(len, text.splitlines())) < 200


@pytest.mark.parametrize("kind", ["boxes", "lumped"])
def test_the_same_seed_gives_the_same_text_and_others_other_machines(kind):
    every = [sketch(seed, kind) for seed in SEEDS]
    assert every == [sketch(seed, kind) for seed in SEEDS]
    machines = [load_machine(Path("machine.toml"), text) for text, _ in every]
    shapes = {(tuple(m.members), tuple(m.contacts), tuple(m.sources), tuple(m.films)) for m in machines}
    assert len(shapes) > 0.8 * len(every)
    assert len({s.law for m in machines for s in m.sources.values()}) >= (10 if kind == "boxes" else 8)
    assert len({f.law for m in machines for f in m.films.values()}) >= 4
    assert len({len(m.sensors) for m in machines}) >= 5


def test_every_layout_is_drawn():
    built = [structure(np.random.default_rng(seed)) for seed in SEEDS]
    assert {b.layout for b in built} == set(LAYOUTS)
    assert {len(b.axes) for b in built} == {1, 2}
    assert {bool(a.screw) for b in built for a in b.axes} == {True, False}
    assert {len(b.main) for b in built} == {3, 4, 5, 6}
    counts = [sum(node_count(s) for s in b.solids) for b in built]
    assert max(counts) > 2 * min(counts)


@pytest.mark.long
def test_a_drawn_machine_is_the_same_again_and_another_seed_is_another():
    a = drawn(0, "lumped")
    assert draw_machine(0, "lumped") == a
    assert draw_machine(1, "lumped").text != a.text
    with pytest.raises(TwinError, match="no seed"):
        draw_machine(-1)


def test_a_law_has_the_power_that_is_drawn_at_usual_signals():
    for seed in SEEDS:
        rng = np.random.default_rng(seed)
        source = heat(rng, "x_motor", drive_law(rng), {"surface": "motor.x_max"}, "x")
        current = USUAL * SIGNALS["current"][1]
        resistance = source.parameters["resistance"][0]
        copper = 3.0 * resistance * current**2
        assert copper < 1.05 * POWER[1]
        if source.law == "motor_copper":
            assert 0.99 * POWER[0] < copper
        assert source.table(2.0)["parameters"]["resistance"] == f"{float(f'{2 * resistance:.3g}'):g} ohm"


def test_runs_are_accepted(tmp_path):
    made = drawn(1, "lumped")
    made.write(tmp_path / "m")
    machine = made.machine()
    ends = []
    for name in RUNS:
        assert check(tmp_path / "m" / "runs" / name).ok
        run = read_run(tmp_path / "m" / "runs" / name)
        assert run.synthetic == ("loads",)
        assert run.loads.time[-1] == pytest.approx(3600.0 * made.hours)
        assert np.diff(run.loads.time) == pytest.approx(made.sampling)
        assert set(run.loads.columns) == set(machine.signals)
        ends.append(run.loads.columns["shop_air"][-1])
    assert len(set(ends)) == len(RUNS)
    with pytest.raises(TwinError, match="in use"):
        made.write(tmp_path / "m")


def test_loads_rest_and_move_within_their_ranges():
    lows = []
    for run in drawn(1, "lumped").runs:
        header, *rows = run.loads.splitlines()
        values = np.array([[float(v) for v in row.split(",")] for row in rows])
        for name, column in zip(header.split(",")[1:], values.T[1:], strict=True):
            kind = name.split(" ")[0].removeprefix("x_").removeprefix("drive_")
            if kind in SIGNALS:
                assert 0.0 <= column.min() <= column.max() <= SIGNALS[kind][1]
                assert column.max() > 0.3 * SIGNALS[kind][1]
                lows.append(column.min() / SIGNALS[kind][1])
    assert min(lows) == 0.0  # somewhere it rests


@pytest.mark.long
@pytest.mark.parametrize("kind", ["boxes", "lumped"])
def test_the_real_machine_has_another_mesh_and_other_laws(kind, tmp_path):
    for seed in range(3):
        text, _ = sketch(seed, kind)
        real = other(text, seed)
        assert other(text, seed) == real != other(text, seed + 1)
        assert check(written(real, tmp_path / str(seed))).problems == ()
        a, b = load_machine(Path("machine.toml"), text), load_machine(Path("machine.toml"), real)
        boxes = [(a.parts[n].box, b.parts[n].box) for n in a.parts]
        assert all(x and y and x.divisions != y.divisions and x.size == y.size for x, y in boxes)
        assert all(bar.elements < b.bars[n].elements < 2 * bar.elements for n, bar in a.bars.items())
        assert all(film.law != b.films[n].law or "exponent" in b.films[n].parameters for n, film in a.films.items())
        assert set(a.sensors) == set(b.sensors)
        assert set(a.nodes) <= set(b.nodes)
        assert kind == "boxes" or len(b.nodes) > len(a.nodes)
        moved = [
            np.linalg.norm(np.subtract(s.position, b.sensors[n].position)) for n, s in a.sensors.items() if s.position
        ]
        assert all(0.9e-3 < m < 4.1e-3 for m in moved)
        gains = [b.sources[n].gain / s.gain for n, s in a.sources.items()]
        assert all(abs(g - 1.0) <= OFF["source"] + 1e-6 for g in gains)
        assert len(set(gains)) == len(gains)


def test_a_split_node_keeps_its_capacity_and_what_it_moves():
    text, _ = sketch(3, "lumped")
    a, b = load_machine(Path("machine.toml"), text), load_machine(Path("machine.toml"), other(text, 3))
    inside = [n.removesuffix("_inside") for n in b.nodes if n.endswith("_inside")]
    assert inside
    for n in inside:
        both = b.nodes[n].capacity + b.nodes[f"{n}_inside"].capacity
        assert both == pytest.approx(a.nodes[n].capacity, rel=1.1 * OFF["capacity"])
        if n in a.tcp.expansion:
            row = np.add(b.tcp.expansion[n], b.tcp.expansion[f"{n}_inside"])
            assert row == pytest.approx(a.tcp.expansion[n], rel=1.2 * OFF["expansion"], abs=1e-9)


@pytest.mark.long
@pytest.mark.parametrize("path", MACHINES, ids=lambda p: p.parent.name)
def test_other_machines_have_real_ones_too(path):
    text = path.read_text(encoding="utf-8")
    a, b = load_machine(path), load_machine(path, other(text, 1, path.parent))
    known = {p.path: p.nominal for p in parameters(b)}
    assert any(known[p.path] != p.nominal for p in parameters(a) if p.kind in OFF)
    assert set(a.members) <= set(b.members)


def test_another_film_law_agrees_near_the_usual_state():
    """Up to the factor of OFF, at 5 K above the air and a quarter of the top speed."""
    for seed in range(12):
        text, _ = sketch(seed, "boxes")
        both = [load_machine(Path("machine.toml"), t) for t in (text, other(text, seed))]
        for name in both[0].films:
            before, after = (coefficient(m, name) for m in both)
            assert abs(after / before - 1.0) < OFF["film"] + 0.02


def coefficient(machine, name):
    """W/(m^2 K) with radiation."""
    film = machine.films[name]
    law = LAWS[film.law]
    values = {k: a.default for k, a in law.parameters.items() if a.default is not None}
    for k, v in film.parameters.items():
        number, _, unit = str(v).partition(" ")
        values[k] = float(number) * {"mm": 1e-3}.get(unit, 1.0)
    speeds = dict.fromkeys(film.signals, 0.25 * 30.0 / 60.0)  # m/s
    states = {"surface": AIR + WARMER, "ambient": AIR}
    convection = law.function(**values, **speeds, **{k: states[k] for k in law.states})
    return film.gain * float(convection) + RADIATION * (0.9 if film.emissivity is None else film.emissivity)


@pytest.mark.parametrize("old", [(8, 4, 2), (1, 1, 1), (10, 1, 1), (2, 3, 1), (5,)])
def test_other_divisions_are_finer_and_no_multiples(old):
    seen = set()
    for seed in range(20):
        new = other_divisions(np.random.default_rng(seed), old)
        assert new != old
        assert all(b >= a for a, b in zip(old, new, strict=True))
        assert all(b % a for a, b in zip(old, new, strict=True) if a > 1)
        seen.add(new)
    assert len(seen) > 1 or old == (5,) or max(old) < 4


def test_edits_of_text_change_what_they_say_alone():
    text = SLIDE.read_text(encoding="utf-8")
    new = with_values(text, {("parts", "bed", "box", "divisions"): "[9, 5, 3]", ("films", "moving", "gain"): "1.5"})
    assert new.replace("\ngain = 1.5", "").replace("[9, 5, 3]", "[8, 4, 2]") == text
    other_law = {"law": '"constant_film"', "signals": "", "parameters": "{ natural = 6.0 }", "gain": "2.0"}
    table = with_table(text, ("films", "moving"), other_law)
    film, before = (load_machine(SLIDE, t).films["moving"] for t in (table, text))
    assert (film.law, film.gain, film.signals) == ("constant_film", 2.0, {})
    assert (film.surfaces, film.environment) == (before.surfaces, before.environment)
    assert with_divisions(text, {"[8, 4, 2]": "[9, 5, 3]"}).count("[9, 5, 3]") == 1
    spread = spread_values(text, {"resistance": 0.1, "preload": 0.1}, np.random.default_rng(0))
    changed = [(a, b) for a, b in zip(text.splitlines(), spread.splitlines(), strict=True) if a != b]
    assert [re.findall(r"resistance|preload", a) for a, _ in changed] == [["resistance"], ["preload"]]


def test_the_command_writes_a_machine(tmp_path, capsys):
    assert main(["1", str(tmp_path / "m"), "lumped"]) == 0
    assert (tmp_path / "m" / "machine.toml").read_text(encoding="utf-8") == drawn(1, "lumped").text
    assert "lumped" in capsys.readouterr().out
    assert main(["1", str(tmp_path / "m"), "lumped"]) == 2
    assert main(["one", str(tmp_path / "n")]) == 2
    assert not (tmp_path / "n").exists()


def real_response(made: DrawnMachine, folder: Path) -> None:
    """Simulate the real machine of a drawn one in its runs: warm and moved within their ranges in the first."""
    made.write(folder / "m")
    real = load_machine(written(other(made.text, made.seed), folder / "real"))
    found = [response(real, simulated(real, read_run(folder / "m" / "runs" / n), step=300.0)) for n in RUNS[:2]]
    assert WARMEST[0] < found[0].rise < WARMEST[1]
    assert MOVED[0] < found[0].moved < MOVED[1]
    assert all(a.rise != b.rise for a, b in pairwise(found))


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (2, 3))])
def test_a_real_network_gets_warm_and_moves(seed, tmp_path):
    real_response(drawn(seed, "lumped"), tmp_path)


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_a_real_machine_of_boxes_gets_warm_and_moves(seed, tmp_path):
    real_response(drawn(seed, "boxes"), tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["boxes", "lumped"])
@pytest.mark.parametrize("seed", SEEDS)
def test_a_drawn_machine_has_no_problems(seed, kind, tmp_path):
    made = drawn(seed, kind)
    made.write(tmp_path / "m")
    assert check(tmp_path / "m").problems == ()
    assert all(check(tmp_path / "m" / "runs" / name).ok for name in RUNS)


@pytest.mark.long
def test_a_drawn_machine_builds_and_runs(tmp_path):
    drawn(5, "lumped").write(tmp_path / "m")
    artefact = str(tmp_path / "a.h5")
    assert command(["build", str(tmp_path / "m"), "-o", artefact]) == 0
    assert command(["run", artefact, str(tmp_path / "m" / "runs" / "sealed"), "-o", str(tmp_path / "out")]) == 0


def test_signals_of_one_drive_rest_together():
    """A spindle's speed and power are those of one drive where that is told, and of two where it is not."""
    machine = load_machine(MODELS / "ram_borer")
    drive = {"spindle_speed": "spindle", "spindle_power": "spindle"}
    told = _columns(loads_of_run(machine, 3, "told", 8.0, 60.0, drive))
    alone = _columns(loads_of_run(machine, 3, "alone", 8.0, 60.0))
    for columns, same in ((told, True), (alone, False)):
        speed, power = columns["spindle_speed [1/min]"], columns["spindle_power [kW]"]
        rests, idles = speed == 0.0, power < 0.2 * power.max()
        assert rests.any()
        assert np.array_equal(rests, idles) is same
    np.testing.assert_array_equal(told["y_speed [m/min]"], alone["y_speed [m/min]"])


def _columns(run: LoadsOfRun) -> dict[str, np.ndarray]:
    header, *rows = run.loads.splitlines()
    return dict(zip(header.split(","), np.array([[float(v) for v in r.split(",")] for r in rows]).T, strict=True))

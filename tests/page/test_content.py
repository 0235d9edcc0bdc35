"""What a page is made of: fields in few modes, the drawn shape, words."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

from twin.build.displacement_field import DisplacementField
from twin.build.full_model import assemble
from twin.build.structure import Structure
from twin.logs.read import read_run
from twin.logs.run import Table, Tcp
from twin.logs.write import write_table, write_tcp
from twin.machine.load import load_machine
from twin.page.finished import finished_told
from twin.page.front import frozen_page, write_page
from twin.page.low_rank import low_rank
from twin.page.packed import packed, unpacked
from twin.page.shape import axis_positions, shape_of
from twin.page.words import flag_words, trust
from twin.pictures.result import read_result
from twin.rom.artefact import read_artefact

SLIDE = Path(__file__).parents[1] / "machines" / "slide"
CERTIFICATE = {"passed": True, "max_temperature_error_in_case": 0.01, "max_displacement_error_in_case": 2e-7,
               "displacement_range": [1e-5]}  # fmt: skip


@pytest.mark.parametrize("shape", [(300, 40), (20, 90), (5, 0), (0, 4)])
def test_few_modes_are_within_the_tolerance_and_say_so(shape):
    rng = np.random.default_rng(1)
    field = 20.0 + 10.0 * rng.random((shape[0], 3)) @ rng.random((3, shape[1])) + 1e-3 * rng.random(shape)
    found = low_rank(field, 0.01)
    assert np.abs(found() - field).max(initial=0.0) <= 0.01
    assert found.error == pytest.approx(np.abs(found() - field).max(initial=0.0), abs=1e-9)
    assert found.modes.shape[1] <= 4


@pytest.mark.parametrize(("kind", "values"), [("f4", [[1.5, -2.0]]), ("u4", [7, 4_000_000_000]), ("i2", [-32767])])
def test_arrays_come_back(kind, values):
    np.testing.assert_array_equal(unpacked(json.loads(json.dumps(packed(np.array(values), kind)))), values)


def test_the_content_has_the_numbers_of_the_result(slide_artefact, slide_result):
    artefact = read_artefact(slide_artefact)
    told, result = finished_told(artefact, slide_result), read_result(slide_result, artefact)
    field = told["tcp"]["field"]
    tcp = (unpacked(field["weights"]) @ unpacked(field["modes"]).astype(float)).reshape(result.tcp.shape)
    np.testing.assert_allclose(tcp, result.tcp, atol=3e-8)
    np.testing.assert_allclose(unpacked(told["temperature"]), result.temperature, rtol=1e-6)
    assert told["surface"]["temperature_error"] <= 0.02
    assert told["surface"]["displacement_error"] <= 1e-7
    json.dumps(told, allow_nan=False)


def test_a_page_keeps_its_content_inside(slide_artefact, slide_result):
    told = finished_told(read_artefact(slide_artefact), slide_result)
    told["subtitle"] = "</script><script>alert(1)</script><!--scripts-->"
    page = frozen_page(told)
    assert "alert(1)</script>" not in page
    assert page.count("<script") == 2
    assert "src=" not in page.split("<body>")[0]


def test_trust_is_one_line_of_three_kinds():
    assert trust(CERTIFICATE, 0, 10, [])[0] == "yes"
    level, line = trust(CERTIFICATE, 3, 10, ["signals.x_current above 20 A", "signals.x_current below 0 A"])
    assert level == "care"
    assert "3 of 10 steps" in line
    assert line.count("x_current") == 1
    assert trust({**CERTIFICATE, "passed": False}, 0, 10, [])[0] == "no"
    assert trust({}, 0, 10, [])[0] == "no"


@pytest.mark.parametrize(
    ("flag", "words"),
    [
        ("signals.x_current above 20 A", "X_current was above 20 A"),
        ("films.bed below 3 W/(m^2*K)", "film coefficient of bed was below 3 W/(m^2*K)"),
        ("position outside the pose grid, TCP error of its border", "outside the grid of poses"),
        ("gap in loads", "no loads there"),
        ("sources.motor outside 0 to 10", "sources.motor outside 0 to 10"),
    ],
)
def test_flags_are_told_in_words(flag, words):
    assert words in flag_words(flag)


def test_the_drawn_shape_is_near_the_exact_one(slide_artefact):
    """Against the displacements of every node of the full model, heated at all its sources and ports."""
    machine, artefact = load_machine(SLIDE), read_artefact(slide_artefact)
    full, shape = assemble(machine), shape_of(artefact)
    assert isinstance(full.structure, Structure)
    assert shape is not None
    rng = np.random.default_rng(0)
    fields = [
        spsolve(
            sp.csc_array(b.A0 + sum(10.0 * a for a in b.A) + 1e-5 * b.E),
            b.B @ (100.0 * rng.random(b.B.shape[1])) + b.P @ (20.0 * rng.random(b.P.shape[1])),
        )
        for b in full.thermal.bodies
    ]
    position = np.zeros(len(full.structure.axes))
    exact = DisplacementField(machine, full.bodies, full.structure)(position, fields)
    heat = np.concatenate([b.H @ T for b, T in zip(full.structure.bodies, fields, strict=True)])
    ports = full.structure.port_displacements(position, heat)
    names = [b.name for b in full.thermal.bodies]
    for field, drawn in zip(artefact.fields, shape.bodies, strict=True):
        b = names.index(field.body)
        surface = full.thermal.bodies[b].F
        wanted = surface[:, : len(exact[b])] @ exact[b]
        error = drawn(surface @ fields[b], ports) - wanted
        assert np.sqrt((error**2).mean()) < 0.2 * np.sqrt((wanted**2).mean())


def test_every_node_of_the_surface_is_displaced(slide_artefact, slide_result):
    artefact = read_artefact(slide_artefact)
    result, shape = read_result(slide_result, artefact), shape_of(artefact)
    assert shape is not None
    position = axis_positions(shape.structure, result.axes, result.position[-1:])
    assert position.shape == (1, 1)
    moved = shape(result.states[-1:], position)
    assert [u.shape for u in moved] == [(1, len(f.nodes), 3) for f in artefact.fields]
    assert 0.0 < max(np.abs(u).max() for u in moved) < 1e-3


def test_what_was_measured_stands_beside_what_was_computed(slide_artefact, slide_result, tmp_path, shown):
    artefact = read_artefact(slide_artefact)
    result = read_result(slide_result, artefact)
    run, folder = (
        shutil.copytree(f, tmp_path / n) for f, n in ((SLIDE / "runs" / "short", "run"), (slide_result, "out"))
    )
    time = read_run(run).loads.time[0] + 3600.0 * result.hours
    write_table(run / "temperatures.csv", Table(time, {"plate": result.temperature[:, 0] + 1.0}, {"plate": "degC"}))
    write_tcp(run / "tcp.csv", Tcp(time, result.axes, result.position, result.tcp_actual + 1e-6))
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    (folder / "summary.json").write_text(json.dumps(summary | {"run": str(run)}), encoding="utf-8")
    told = finished_told(artefact, folder)["measured"]
    assert [row for row, _ in told["sensors"]["plate"]] == list(range(len(time)))
    np.testing.assert_allclose([v for _, v in told["sensors"]["plate"]], result.temperature[:, 0] + 1.0, atol=1e-3)
    np.testing.assert_allclose([v for _, v in told["tcp"][2]], result.tcp_actual[:, 2] + 1e-6, atol=1e-9)
    write_page(folder / "index.html", finished_told(artefact, folder))
    page = shown().open((folder / "index.html").as_uri())
    page.do("() => { page.where.selectedIndex = 1; page.tcpCurves(); }")
    assert page.do("page.time.plot.series.length") == 1 + 3 + 3
    assert "Dots: measured." in page.do("document.getElementById('tcp-words').textContent")
    assert page.wrong == []
    shutil.rmtree(run)
    assert finished_told(artefact, folder)["measured"] is None

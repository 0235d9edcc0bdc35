"""Matrices of other programs: read by name, tested by physics, reduced as a machine is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp
from skfem import Basis, BilinearForm, ElementHex1, ElementHex2, FacetBasis, MeshHex1
from skfem.helpers import dot, grad

import twin
from twin.build.comparison import compare
from twin.build.matrices.files import read_matrices
from twin.build.matrices.model import MatrixOptions, model_of, outputs
from twin.build.matrices.self_test import self_test
from twin.build.pipeline import BuildOptions
from twin.build.scenario import draw
from twin.cli.main import run
from twin.errors import DescriptionError
from twin.face.import_matrices import import_matrices
from twin.rom.artefact import read_artefact

CAPACITY, CONDUCTIVITY = 3.7e6, 50.0  # J/(m3 K), W/(m K)
SIZE = (0.4, 0.1, 0.1)  # m
QUICK = BuildOptions(states=24, held_out=2, hours=0.5, training=6)


def bar(element=ElementHex1, divisions=(8, 2, 2)) -> dict[str, np.ndarray | sp.csr_matrix]:
    """A bar with films on both ends, heated over its middle cross-section, read at its ends and in the middle."""
    mesh = MeshHex1.init_tensor(*(np.linspace(0, s, n + 1) for s, n in zip(SIZE, divisions, strict=True)))
    basis = Basis(mesh, element())
    integral = BilinearForm(lambda u, v, w: u * v)
    found = {
        "C": CAPACITY * integral.assemble(basis),
        "K": CONDUCTIVITY * BilinearForm(lambda u, v, w: dot(grad(u), grad(v))).assemble(basis),
    }
    for i, x in enumerate((0.0, SIZE[0]), 1):
        facets = mesh.facets_satisfying(lambda p, at=x: np.isclose(p[0], at), boundaries_only=True)
        found[f"A{i}_end_{i}"] = integral.assemble(FacetBasis(mesh, element(), facets=facets))
    at, *across = basis.doflocs
    share = np.prod([np.where(np.isclose(y, 0.0) | np.isclose(y, 0.1), 0.5, 1.0) for y in across], axis=0)  # of area
    means = np.array([np.isclose(at, x) * share for x in (0.0, SIZE[0] / 2, SIZE[0])])
    means /= means.sum(axis=1, keepdims=True)
    found["B"] = 2.0 * means[1:2].T  # 2 W per unit
    found["Y"] = np.vstack([means[0], 3.0 * (means[1] - means[2])])
    return {name: sp.csr_matrix(m) if name not in ("B", "Y") else m for name, m in found.items()}


def write(folder: Path, matrices: dict, **changes) -> list[Path]:
    """Matrix Market files of the matrices, some changed or, with None, left out."""
    files = []
    for name, matrix in (matrices | changes).items():
        if matrix is not None:
            files.append(folder / f"{name}.mtx")
            scipy.io.mmwrite(files[-1], matrix, precision=7)
    return files


def refused(files: list[Path]) -> str:
    with pytest.raises(DescriptionError) as e:
        self_test(read_matrices(files))
    assert all(p.remedy and p.where for p in e.value.problems)
    return " | ".join(f"{p.what}: {p.remedy}" for p in e.value.problems)


@pytest.fixture(scope="module")
def matrices():
    return bar()


@pytest.fixture(scope="module")
def imported(matrices, tmp_path_factory):
    folder = tmp_path_factory.mktemp("bar")
    options = MatrixOptions(input_names=("heater",), output_names=("left", "across"))
    made = import_matrices(write(folder, matrices), folder / "bar.h5", options, QUICK, False)
    return made, folder / "bar.h5"


def test_what_is_found_is_told(matrices, tmp_path):
    told = "\n".join(self_test(read_matrices(write(tmp_path, matrices))))
    assert f"{CAPACITY * np.prod(SIZE):.6g} J/K in all" in told
    assert "end_1: symmetric; 0.01 m^2 at 9 nodes" in told
    assert "1 temperatures, 1 differences" in told
    assert "inputs: 2 W per unit" in told


@pytest.mark.parametrize("share", [0.0, 20.0])
@pytest.mark.parametrize("element", [ElementHex1, ElementHex2])
def test_an_effective_matrix_is_refused_by_name(tmp_path, element, share):
    """C/dt + K passed off as K, with convection in it and without."""
    m = bar(element, (4, 2, 2))
    said = refused(write(tmp_path, m, K=m["K"] + m["C"] / 12.5 + share * m["A1_end_1"]))
    assert "K is an effective matrix of a time step, C/dt + K with dt = 12.5 s: give K itself" in said


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda m: {"K": m["K"] + 20 * m["A1_end_1"]}, "loses 0.2 W in 9 rows of K: it holds convection"),
        (lambda m: {"K": sp.triu(m["K"])}, "K holds one triangle only"),
        (lambda m: {"C": m["C"] + sp.csr_matrix(([1e3], ([0], [5])), m["C"].shape)}, "C is not symmetric, by 1e"),
        (lambda m: {"K": -m["K"]}, "call it A if it is -K"),
        (lambda m: {"C": m["C"] - sp.diags(m["C"].diagonal() * (np.arange(81) == 3))}, "1 unknowns have no heat"),
        (lambda m: {"A1_end_1": None, "A2_end_2": None}, "no film"),
        (lambda m: {"A2_end_2": -m["A2_end_2"]}, "the film takes up -0.01 W"),
        (lambda m: {"Y": 2.0 * m["Y"]}, "row 1 of the outputs sums to 2"),
        (lambda m: {"Y": None}, "nothing is watched"),
        (lambda m: {"B": np.diff(m["Y"], axis=0).T * [[1.0]] - m["B"]}, "column 1 of the inputs brings"),
        (lambda m: {"Y": m["Y"][:, :5]}, "2 x 5, where 2 x 81 is needed"),
        (lambda m: {"E": m["C"], "Y": None}, "81 x 81|nothing is watched|sums to"),
        (lambda m: {"A": -m["K"]}, "A and K are both there"),
        (lambda m: {"stiffness": m["K"]}, "which matrix is 'stiffness'"),
        (lambda m: {"H1": m["A1_end_1"], "A1_film_1": m["A1_end_1"]}, "the same matrix as"),
        (lambda m: {"K": None}, "K (or A = -K), the conduction, is missing"),
    ],
)
def test_what_matrices_are_refused_for(matrices, tmp_path, change, said):
    told = refused(write(tmp_path, matrices, **change(matrices)))
    assert any(part in told for part in said.split("|"))


def test_files_that_are_none_are_refused(tmp_path):
    for name, content, said in (
        ("K.mtx", b"%%MatrixMarket", "cannot be read"),
        ("file.full", b"x", "no format of matrices"),
        ("K.mat", b"MATLAB 7.3", "cannot be read"),
    ):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(DescriptionError, match=said):
            read_matrices([tmp_path / name])
    with pytest.raises(DescriptionError, match="no such file"):
        read_matrices([tmp_path / "nothing.mtx"])


def test_notations_and_formats_are_the_same_model(matrices, tmp_path):
    """E A B C of a MATLAB file and K C B Y of Matrix Market; sums that files round are made exact."""
    names = {"C": "E", "Y": "C"}
    variables = {names.get(n, n): m for n, m in matrices.items() if n != "K"} | {"A": -matrices["K"]}
    scipy.io.savemat(tmp_path / "bar.mat", variables)
    one = model_of("bar", read_matrices([tmp_path / "bar.mat"]), MatrixOptions()).bodies[0]
    other = model_of("bar", read_matrices(write(tmp_path, matrices)), MatrixOptions()).bodies[0]
    for name in ("E", "A0", "B", "C", "M"):
        a, b = (np.asarray(m.todense()) if sp.issparse(m) else m for m in (getattr(one, name), getattr(other, name)))
        np.testing.assert_allclose(a, b, atol=1e-6 * np.abs(a).max())
    assert np.abs(other.A0 @ other.one).max() < 1e-12 * np.abs(other.A0).max()


def test_differences_are_two_sides(matrices, tmp_path):
    read = read_matrices(write(tmp_path, matrices))
    left, across = outputs(read, MatrixOptions())
    assert (left.sensors, across.sensors) == (("output_1",), ("output_2_plus", "output_2_minus"))
    assert across.scale == pytest.approx(3.0)
    np.testing.assert_allclose(across.scale * (across.rows[0] - across.rows[1]), matrices["Y"][1], atol=1e-6)


def test_the_reduced_model_is_the_full_one(imported, matrices, tmp_path):
    made, path = imported
    assert made.model.states <= 24
    assert made.model.certificate.passed
    full = model_of("bar", read_matrices(write(tmp_path, matrices)), MatrixOptions())
    compact = read_artefact(path).model
    assert compact.sensors == ("left", "across_plus", "across_minus")
    found = compare(full, compact, [draw(compact.load_model, 77, 1.0, air_apart=True)])
    assert found.temperature_range.min() > 1.0
    assert found.temperature_error.max() < 2e-3 * found.temperature_range.min()


def test_heat_and_surroundings_in_steady_state(imported, tmp_path):
    """By hand: heat P into the middle, films h1 and h2 on ends of area a, k a / (l/2) to each."""
    _, path = imported
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "run.toml").write_text('start = "2026-01-01T00:00:00+00:00"\nsampling = "10 min"\n')
    rows = "".join(f"{600 * i},10,40,25,15,5\n" for i in range(800))
    ends = "end_1 [W/(m^2*K)],end_2 [W/(m^2*K)],end_1_temperature [degC],end_2_temperature [degC]"
    header = f"time [s],{ends},heater [W]\n"
    (tmp_path / "run" / "loads.csv").write_text(header + rows)
    result = twin.run(twin.read(path), tmp_path / "run", dt="600 s", progress=False)
    area, reach = 0.01, CONDUCTIVITY * 0.01 / 0.2
    g1, g2 = 1 / (1 / (10 * area) + 1 / reach), 1 / (1 / (40 * area) + 1 / reach)
    middle = (2 * 5 + g1 * 25 + g2 * 15) / (g1 + g2)
    ends = [middle - g * (middle - T) / reach for g, T in ((g1, 25), (g2, 15))]
    last = result.temperatures.isel(time=-1)
    for sensor, expected in (("left", ends[0]), ("across_plus", middle), ("across_minus", ends[1])):
        assert float(last.sel(sensor=sensor)) == pytest.approx(expected, abs=1e-3)


@pytest.mark.long
def test_the_artefact_works_in_every_command(matrices, tmp_path, capsys):
    path = tmp_path / "bar.h5"
    files = [str(f) for f in write(tmp_path, matrices)]
    assert (
        run(
            [
                "import",
                *files,
                "-o",
                str(path),
                "--states",
                "24",
                "--range",
                "inputs=0..50",
                "--names",
                "outputs=left,across",
            ]
        )
        == 0
    )
    told = capsys.readouterr().out
    assert "passed" in told
    assert "rich against full, 2 scenarios" in told
    assert run(["info", str(path)]) == 0
    assert run(["info", str(path), "--check"]) == 0
    for form, ending in (("mat", "mat"), ("npz", "npz"), ("c", "c"), ("fmu2", "fmu")):
        arguments = ["export", str(path), "--format", form, "-o", str(tmp_path / f"bar.{ending}")]
        assert run(arguments) == 0, capsys.readouterr().err
    assert run(["verify", str(path)]) == 2
    assert "was imported from matrices" in capsys.readouterr().err
    assert run(["import", files[0], "-o", str(tmp_path / "b.h5")]) == 2
    assert run(["import", *files, "-o", str(tmp_path / "b.h5"), "--range", "films=5"]) == 2
    assert not (tmp_path / "b.h5").exists()

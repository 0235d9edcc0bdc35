"""The state space in MATLAB and NumPy files: against the full finite-element model, and as its consumers read it."""

from __future__ import annotations

import json
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from tests.reference.by_the_page import assembled
from tests.reference.exports import read_npz
from twin.build.pipeline import full_model
from twin.build.stepper import CoupledStepper, sensor_temperatures
from twin.errors import TwinError
from twin.export.mat import write_mat
from twin.export.npz import write_npz
from twin.export.operating_point import OperatingPoint, middle, moved, of_result
from twin.export.state_space import state_space
from twin.logs.read import read_run
from twin.logs.signals import signal_values
from twin.machine.load import load_machine
from twin.rom.artefact import read_artefact
from twin.rom.drive import evaluate
from twin.rom.following import Following

ROOT = Path(__file__).parents[2]
SLIDE = ROOT / "tests" / "machines" / "slide"
EXPORTS = ROOT / "tests" / "reference" / "exports"
AT = 0.13  # m, between two stations of every rail
OCTAVE = shutil.which("octave-cli") or shutil.which("octave")


@pytest.fixture(scope="module")
def point(slide_artefact) -> OperatingPoint:
    load = read_artefact(slide_artefact).model.load_model
    return moved(middle(load), load, {"x": AT})


@pytest.fixture(scope="module")
def npz(slide_artefact, point, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("npz") / "slide.npz"
    write_npz(path, read_artefact(slide_artefact), point)
    return path


@pytest.fixture(scope="module")
def mat(slide_artefact, point, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("mat") / "slide.mat"
    write_mat(path, read_artefact(slide_artefact), point)
    return path


@pytest.mark.long
def test_steps_as_the_full_model_with_films_and_position_held(npz, point):
    """Two hours of heat in every source, the air 2 K warmer: sensors and the TCP at a position off the grid."""
    full = full_model(load_machine(SLIDE))
    model = full.thermal
    run = read_run(SLIDE / "runs" / "short")
    signals = {name: np.full_like(v, AT if name == "x_position" else v[0])
               for name, v in signal_values(run, model.load_model.signals).items()}  # fmt: skip
    drive = evaluate(model.load_model, run.loads.time, signals, 60.0, 120)
    with np.load(npz) as f:
        inputs, units = f["inputs"].tolist(), f["input_units"].tolist()
    heat = np.linspace(20.0, 60.0, len(model.load_model.sources))
    u = np.array([2.0 if unit == "K" else heat[k] for k, unit in enumerate(units)])
    assert [i.partition(".")[2] for i in inputs[: len(heat)]] == [s.name for s in model.load_model.sources]
    joints = [joint.conductance for joint in model.load_model.joints]
    contacts = list(model.load_model.contact_sources)
    assert drive.power[:, contacts].all()  # each gives heat, of which its shares are taken
    shares = drive.contact_heat / drive.power[:, contacts, None]
    held = replace(
        drive,
        power=np.tile(heat, (120, 1)),
        contact_heat=shares * heat[contacts][None, :, None],
        theta=np.tile([*point.films, *joints], (120, 1)),
        environment=np.full_like(drive.environment, model.reference_temperature + 2.0),
        films=Following.none(120, drive.films.grid),
        losses=Following.none(120, drive.losses.grid),
        radiation=False,  # `theta` is the whole coefficient
    )
    stepper = CoupledStepper(model)
    told = read_npz.step_response(npz, u, 7200.0, 120)
    errors, sizes = [], []
    for step, x, _ in stepper.run(held, stepper.uniform(model.reference_temperature), 2):
        sensors = sensor_temperatures(model, x) - model.reference_temperature
        tcp = full.structure.displacement({"x": AT}, tuple(x))
        wanted = np.concatenate([sensors, tcp])
        errors.append(np.abs(told[step + 1] - wanted))
        sizes.append(np.abs(wanted))
    error, size = np.max(errors, axis=0), np.max(sizes, axis=0)
    assert size[: len(model.sensors)].min() > 1.0  # K
    assert (error[: len(model.sensors)] < 2e-3 * size[: len(model.sensors)].max()).all()
    assert (error[-3:] < 2e-3 * size[-3:].max()).all()


def by_hand(path: Path, films: np.ndarray, s: complex) -> np.ndarray:
    """C (s E - A)^-1 B of sensors per environment and surface source, by docs/artefact.md: NumPy and h5py alone.

    Contacts are left open: only for machines and sources that have none.
    """
    with h5py.File(path) as f:
        load = json.loads(f["load_model"].asstr()[()])
        bodies = [{k: v[...] for k, v in f[f"bodies/{name}"].items()} for name in f["body"].asstr()[...]]
        M = assembled(load, bodies, len(f["sensor"]))
    theta = np.concatenate([films, [joint["conductance"] for joint in load["joints"]]])
    gamma = np.zeros((len(load["ports"]),) * 2)
    for pair in load["pairs"]:
        rail = load["rails"][pair["rail"]]
        d = np.zeros(len(gamma))
        d[pair["pad_port"]] = 1.0
        stations = np.array(rail["stations"])
        s_pad = pair["station"] - AT if pair["rail_moves"] else pair["station"] + AT
        d[rail["first_port"] :][: len(stations)] -= [np.interp(s_pad, stations, e) for e in np.eye(len(stations))]
        gamma += pair["conductance"] * pair["area"] * np.outer(d, d)
    A = M["A0"] + np.tensordot(theta, M["A"], 1) + M["P"] @ gamma @ M["P_out"].T
    air = np.zeros((len(A), len(load["environments"])))
    for k, film in enumerate(load["films"]):
        assert film["radiant"] == film["environment"]
        air[:, film["environment"]] += films[k] * M["M"][:, k]
    return M["C"] @ np.linalg.solve(s * M["E"] + A, np.hstack([M["B"], air]))


def test_transfer_function_of_pymor_and_control_is_that_of_the_artefact(slide_artefact, mat, npz, point):
    pymor = pytest.importorskip("pymor", reason="pyMOR is not installed (extra `compare`)")
    from tests.reference.exports.read_mat_pymor import transfer_function

    assert pymor.__version__
    load = read_artefact(slide_artefact).model.load_model
    n = len(load.sources)
    columns = [k for k in range(n + len(load.environments)) if k >= n or not load.sources[k].contact]
    for s in (0.0, 1j * 2.0 * np.pi / 3600.0, 1e-3 + 0.1j):
        wanted = by_hand(slide_artefact, point.films, s)[:, columns]
        told = transfer_function(mat, s)[: len(wanted), columns]
        np.testing.assert_allclose(told, wanted, rtol=0, atol=1e-10 * np.abs(wanted).max())
        whole = transfer_function(mat, s)
        control = pytest.importorskip("control", reason="python-control is not installed (extra `compare`)")
        assert control.__version__
        np.testing.assert_allclose(read_npz.control_system(npz)(s), whole, rtol=0, atol=1e-10 * np.abs(whole).max())


def implicit_euler(npz: Path, u: np.ndarray, seconds: float, steps: int) -> np.ndarray:
    with np.load(npz) as f:
        E, A, B, C, D = (f[name] for name in "EABCD")
    h, x = seconds / steps, np.zeros(len(A))
    for _ in range(steps):
        x = np.linalg.solve(E - h * A, E @ x + h * B @ u)
    return C @ x + D @ u


@pytest.mark.skipif(OCTAVE is None, reason="octave is not installed")
def test_octave_steps_it(mat, npz):
    with np.load(npz) as f:
        names, inputs = f["outputs"].tolist(), f["inputs"].tolist()
    k = next(i for i, name in enumerate(inputs) if name.startswith("environments."))
    call = [OCTAVE, "--norc", EXPORTS / "step_mat.m", mat, k + 1, 3.0, 7200, 120]
    done = subprocess.run([str(c) for c in call], capture_output=True, text=True, timeout=120, check=True)
    lines = [line.split() for line in done.stdout.splitlines()]
    assert [line[0] for line in lines] == names
    wanted = implicit_euler(npz, 3.0 * np.eye(len(inputs))[k], 7200.0, 120)
    np.testing.assert_allclose([float(line[1]) for line in lines], wanted, rtol=1e-9, atol=1e-18)
    assert wanted[0] > 0.5  # K of the 3 K
    assert {line[2] for line in lines} == {"K", "m"}


def test_files_say_what_they_hold(slide_artefact, mat, npz, point):
    from scipy.io import loadmat

    artefact = read_artefact(slide_artefact)
    space = state_space(artefact.model, point)
    m = loadmat(mat, simplify_cells=True)
    with np.load(npz) as f:
        np.testing.assert_array_equal(m["A"], f["A"])
        np.testing.assert_array_equal(f["A"], space.A)
        assert m["outputs"].tolist() == f["outputs"].tolist() == [c.name for c in space.outputs]
        assert f["position_m"].tolist() == [AT]
        bed = f["bodies"].tolist().index("bed")
        for name in ("E", "A0", "M", "G", "P"):
            np.testing.assert_array_equal(m["affine"][bed][name], f[f"affine/bed/{name}"])
        stacked = np.moveaxis(m["affine"][bed]["A"], -1, 0)
        np.testing.assert_array_equal(stacked, f["affine/bed/A"])
        np.testing.assert_array_equal(m["affine"][bed]["theta"] - 1, f["affine/bed/theta"])
        # the affine terms give the state space at any other film state: here twice the films
        theta = f["theta_W_per_m2K"]
        n_films = len(artefact.model.load_model.films)
    twice = state_space(artefact.model, OperatingPoint(point.position, 2.0 * point.films))
    change = np.zeros_like(space.A)
    first = 0
    for body in m["affine"]:
        n = len(body["E"])
        for k, number in enumerate(np.atleast_1d(body["theta"]).astype(int) - 1):
            if number < n_films:
                change[first : first + n, first : first + n] -= theta[number] * body["A"].reshape(n, n, -1)[:, :, k]
        first += n
    np.testing.assert_allclose(space.A + change, twice.A, atol=1e-12 * np.abs(twice.A).max())


def test_the_operating_point_of_a_result(slide_artefact, slide_result):
    artefact = read_artefact(slide_artefact)
    load = artefact.model.load_model
    with h5py.File(slide_result / "result.h5") as f:
        films, position, time = f["film_coefficient"][...], f["position"][...], f["time"][...]
    last = of_result(slide_result, artefact.digest, load)
    np.testing.assert_array_equal(last.films, films[-1])
    np.testing.assert_array_equal(last.position, position[-1])
    third = of_result(slide_result, artefact.digest, load, float(time[3] - time[0]))
    np.testing.assert_array_equal(third.films, films[2])
    np.testing.assert_array_equal(third.position, position[3])
    for bad, told in (((slide_result, "0" * 64, load), "another artefact"),
                      ((slide_artefact, artefact.digest, load), "not a result"),
                      ((slide_result, artefact.digest, load, 1e9), "the run lasts")):  # fmt: skip
        with pytest.raises(TwinError, match=told):
            of_result(*bad)
    with pytest.raises(TwinError, match="outside its stroke"):
        moved(last, load, {"x": 9.0})
    with pytest.raises(TwinError, match="no axis 'q'"):
        moved(last, load, {"q": 0.0})

"""Air that is warmer above, about parts that an axis moves up and down."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import block_diag

import twin
from tests.support.lumped import climbing, film, write
from twin.build.full_model import assemble
from twin.build.stepper import CoupledStepper
from twin.calibrate.fit.window import merged
from twin.machine.load import load_machine
from twin.rom.artefact import read_artefact
from twin.rom.drive import evaluate
from twin.run.replay import integrate
from twin.run.stepping import inputs_of
from twin.run.system import prepare

SLIDE = Path("tests/machines/slide/machine.toml").read_text(encoding="utf-8")
LIFT = """
[nodes.{still}]
capacity = "4 kJ/K"
area = "0.2 m^2"
position = [0, 0, 0.5]
[nodes.moved]
capacity = "2 kJ/K"
area = "0.3 m^2"
position = [0, 0, 1.5]
[signals.place]
unit = "m"
range = [-1, 1]
[axes.lift]
direction = [0, 3, 4]
stroke = [-1, 1]
carries = ["moved"]
position = "place"
"""
GRADIENT = ("[environment.air]", '[environment.air]\ngradient = "2 K/m"\nheight = 1.0')
h, A, C, UP = 8.0, 0.3, 2000.0, 0.8  # of the node that moves; 0.8 m up per metre of the axis


def lift(folder: Path) -> CoupledStepper:
    path = write(folder, LIFT.format(still="still"), film("room", "still moved", h))
    path.write_text(path.read_text().replace(*GRADIENT))
    return CoupledStepper(assemble(load_machine(path)).thermal)


def driven(load, place, hours: float, dt: float = 60.0):
    time = np.arange(0.0, hours * 3600.0 + 1.0, 10.0)
    return evaluate(load, time, {"place": np.broadcast_to(place(time), time.shape), "current": 0 * time}, dt)


@pytest.mark.parametrize("place", [-0.7, 0.0, 0.5])
def test_at_rest_everything_is_as_warm_as_the_air_where_it_stands(tmp_path, place):
    stepper = lift(tmp_path)
    still, moved = stepper.steady_state(driven(stepper.model.load_model, lambda _: place, 1.0), 0)
    assert still == pytest.approx([2.0 * (0.5 - 1.0)], abs=1e-9)
    assert moved == pytest.approx([2.0 * (1.5 + UP * place - 1.0)], abs=1e-9)


@pytest.mark.long
def test_what_rises_and_falls_follows_the_air_it_passes(tmp_path):
    """Against C dT/dt = h A (T_air(t) - T), with a film that what stands still is in, too; both integrators."""
    omega, hours = 2 * np.pi / 1800.0, 2.0
    stepper = lift(tmp_path)
    drive = driven(stepper.model.load_model, lambda t: 0.9 * np.sin(omega * t), hours)

    def rate(t, T):
        return h * A / C * (2.0 * (0.5 + UP * 0.9 * np.sin(omega * t)) - T)

    exact = solve_ivp(rate, (0.0, hours * 3600.0), [0.0], t_eval=drive.time[1:], rtol=1e-9, atol=1e-9).y[0]
    x, T = stepper.uniform(20.0), []
    for _, x, heat in stepper.run(drive, x):  # noqa: B020
        T.append(float(x[1][0]))
        assert heat.film.sum() == pytest.approx(heat.stored, abs=1e-9)
    assert np.ptp(exact[60:]) > 0.5
    assert np.abs(np.array(T) - exact).max() < 2e-3  # straight ways between rows, air as it is in the mean of a minute
    twin.build(tmp_path, options=twin.BuildOptions(held_out=1)).save(tmp_path / "a.h5")
    model = read_artefact(tmp_path / "a.h5").model
    prepared = prepare(model)
    steps = integrate(prepared, inputs_of(model.load_model, drive, 1), prepared.uniform(20.0))
    moved = np.concatenate([0 * model.bodies[0].one, model.bodies[1].energy / C])
    assert np.abs(prepared.to_artefact(np.asarray(steps.z)) @ moved - T).max() < 1e-9


def test_a_mesh_has_the_heights_of_one_that_is_drawn_elsewhere():
    """Of the slide whose x points up: all films of its two bodies, at -130 mm."""
    text = SLIDE.replace('reference_temperature = "20 degC"', 'reference_temperature = "20 degC"\nvertical = "x"')
    text = text.replace("[environment.shop]", '[environment.shop]\ngradient = "1 K/m"')
    full = assemble(load_machine(Path("tests/machines/slide"), text))
    for body, mesh in zip(full.thermal.bodies, full.bodies, strict=True):
        at = -0.13 if body.name == "slide" else 0.0
        height = np.concatenate([mesh.nodes[:, 0] + at, np.zeros(body.n - mesh.n)])
        found = body.H if body.raised is None else body.H - 0.13 * body.raised[0]
        films = range(len(full.thermal.load_model.films))
        for column, k in enumerate(body.theta):
            expected = body.A[column] @ height if k in films else 0.0 * height
            np.testing.assert_allclose(found[:, column], expected, atol=1e-15)
    assert [body.raised is None for body in full.thermal.bodies] == [True, False]


@pytest.mark.slow
def test_one_body_of_all_has_the_heights_of_each(tmp_path):
    """What calibrations step: bodies together in one basis."""
    climbing(tmp_path)
    twin.build(tmp_path, options=twin.BuildOptions(held_out=1)).save(tmp_path / "a.h5")
    model = read_artefact(tmp_path / "a.h5").model
    together = merged(model, block_diag(*(np.linalg.inv(np.linalg.cholesky(b.E)).T for b in model.bodies)))
    time = np.arange(0.0, 7200.0, 10.0)
    signals = {s.name: np.full(len(time), (s.low + s.high) / 2) for s in model.load_model.signals}
    signals |= {"x_position": 0.1 + 0.2 * np.sin(time / 500.0)}
    drive = evaluate(model.load_model, time, signals, 60.0)
    ways = []
    for one in (model, together):
        prepared = prepare(one)
        steps = integrate(prepared, inputs_of(one.load_model, drive, 1), prepared.uniform(20.0))
        ways.append(np.asarray(steps.z) @ np.asarray(prepared.system.C).T)
        assert np.asarray(prepared.system.film_plan.climb).max() > 0.2  # of a film over what moves and what stands
    np.testing.assert_allclose(*ways, atol=1e-9)

"""The coupled stepper: equal to one monolithic solve, conservative, first order in time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg

from tests.build.two_bodies import load_model, model
from twin.build.body_matrix import system_matrix
from twin.build.scenario import draw
from twin.build.stepper import CoupledStepper, contact_matrix
from twin.rom.tableau import IMPLICIT_EULER


def monolithic(machine, drive, step, rate):
    """Matrix and right-hand side of the whole machine, written down directly."""
    n_ports = len(machine.load_model.ports)
    P = scipy.linalg.block_diag(*(b.P for b in machine.bodies))
    assert P.shape[1] == n_ports
    S = scipy.linalg.block_diag(*(system_matrix(b, drive.theta[step], rate) for b in machine.bodies))
    return S + P @ contact_matrix(machine, drive, step) @ P.T


@pytest.mark.parametrize("seed", range(3))
def test_step_equals_one_monolithic_solve(seed):
    machine = model()
    drive = draw(load_model(), seed, hours=0.5).drive
    stepper = CoupledStepper(machine, follow=0.0, tableau=IMPLICIT_EULER)
    x = stepper.uniform(25.0)
    for step, after, _ in stepper.run(drive, x):
        rate = 1 / 60.0
        forcing = stepper.forcing(stepper.loads(drive, step, x))
        rhs = [rate * b.E @ xb + f for b, xb, f in zip(machine.bodies, x, forcing, strict=True)]
        expected = np.linalg.solve(monolithic(machine, drive, step, rate), np.concatenate(rhs))
        assert np.allclose(np.concatenate(after), expected, rtol=1e-10, atol=1e-10)
        x = after


def test_heat_balance_closes_at_every_step_and_position():
    machine = model()
    drive = draw(load_model(), 4, hours=4.0).drive
    assert np.ptp(drive.position) > 0.1  # the axis did move
    stepper = CoupledStepper(machine)
    x = stepper.uniform(18.0)
    for _, _, heat in stepper.run(drive, x, substeps=3):
        assert heat.balance_error < 1e-10


def test_contact_heat_only_moves_from_one_side_to_the_other():
    machine = model()
    drive = draw(load_model(), 4, hours=0.5).drive
    for step in range(drive.n_steps):
        gamma = contact_matrix(machine, drive, step)
        assert np.allclose(gamma, gamma.T)
        assert np.abs(gamma.sum(axis=0)).max() < 1e-12 * np.abs(gamma).max()
        assert np.linalg.eigvalsh(gamma).min() > -1e-12 * np.abs(gamma).max()


def test_steady_state_of_a_body_that_loses_heat_through_moving_contacts_only():
    """Its own matrix is singular; that of the whole machine is not."""
    machine = model()
    bed, slide = machine.bodies
    machine = replace(machine, bodies=(bed, replace(slide, A=(), theta=(), M=np.zeros((slide.n, 0)))))
    drive = draw(load_model(), 2, hours=0.2).drive
    stepper = CoupledStepper(machine)
    found = np.concatenate(stepper.steady_state(drive, 0, tolerance=1e-9))
    forcing = np.concatenate(stepper.forcing(stepper.loads(drive, 0, stepper.uniform(20.0))))
    assert np.allclose(found, np.linalg.solve(monolithic(machine, drive, 0, 0.0), forcing), rtol=1e-7, atol=1e-7)


def test_steady_state_is_where_stepping_ends():
    machine = model()
    drive = draw(load_model(), 2, hours=0.2).drive
    stepper = CoupledStepper(machine)
    steady = stepper.steady_state(drive, drive.n_steps - 1)
    x = steady
    for _ in range(3):  # a fixed point of the step
        forcing = stepper.forcing(stepper.loads(drive, drive.n_steps - 1, x))
        rhs = [b.E @ xb / 60 + f for b, xb, f in zip(machine.bodies, x, forcing, strict=True)]
        gamma = contact_matrix(machine, drive, drive.n_steps - 1)
        factors = stepper.factors(drive.theta[-1], 1 / 60)
        x = stepper.solve(rhs, factors, stepper.across(factors, gamma))
    assert np.allclose(np.concatenate(x), np.concatenate(steady), rtol=1e-9, atol=1e-9)

"""ARX and output error on planted systems: recovery, bias under noise, sparse measurements, orders and inputs."""

import numpy as np
import pytest

from twin.calibrate.transfer_function.arx import fit_arx
from twin.calibrate.transfer_function.identify import identify, rank_inputs
from twin.calibrate.transfer_function.model import TransferFunction, first_order_lags
from twin.calibrate.transfer_function.output_error import fit_oe
from twin.errors import ModelError

DT = 60.0
PLANTED = first_order_lags(np.array([688.0, 3632.0]), np.array([-4.0, -12.5]), DT)  # um/K, as in paper 003


def warming(n: int, seed: int) -> np.ndarray:
    """A bearing's temperature rise (n,) K: loads on and off, at rest at first."""
    rng = np.random.default_rng(seed)
    power = np.repeat(rng.choice([0.0, 6.0, 10.0], n // 60 + 1), 60)[:n]
    power[0] = 0.0
    return first_order_lags(np.array([1500.0]), np.ones(1), DT, "zero").simulate(power)


@pytest.mark.parametrize("fit", [fit_arx, fit_oe])
def test_planted_systems_are_recovered_without_noise(fit):
    u = np.column_stack([warming(600, 1), warming(600, 2)])
    planted = first_order_lags(np.array([500.0, 4000.0]), np.array([[1.0, 2.0], [3.0, -4.0]]), DT)
    found = fit(u, planted.simulate(u), DT, 2)
    np.testing.assert_allclose(np.sort(found.time_constants), [500.0, 4000.0], rtol=1e-5)
    np.testing.assert_allclose(found.dc_gain, [4.0, -2.0], rtol=1e-5)
    np.testing.assert_allclose(found.simulate(u), planted.simulate(u), atol=1e-7)


def test_a_pair_of_poles_is_recovered():
    pair = np.exp(DT * (-1.0 / 5000.0 + 2j * np.pi / 9000.0))
    planted = TransferFunction(DT, np.array([0.9, pair]), np.array([[0.3], [0.02 + 0.01j]]), np.array([0.5]))
    u = warming(800, 3)
    found = fit_oe(u, planted.simulate(u), DT, 3, pairs=1, direct=True)
    np.testing.assert_allclose(np.sort_complex(found.poles), np.sort_complex(planted.poles), rtol=1e-6)
    assert found.direct == pytest.approx([0.5], abs=1e-5)


def test_noise_biases_arx_and_not_output_error():
    """White noise of 0.5 um, 40 seeds: the mean of ARX's slow time constant is off by many standard errors."""
    u = warming(600, 4)
    clean = PLANTED.simulate(u)
    rng = np.random.default_rng(5)
    slow: dict[str, list[float]] = {"arx": [], "oe": []}
    gain: dict[str, list[float]] = {"arx": [], "oe": []}
    for _ in range(40):
        y = clean + 0.5 * rng.standard_normal(len(clean))
        for name, fit in (("arx", fit_arx), ("oe", fit_oe)):
            found = fit(u, y, DT, 2)
            slow[name].append(float(found.time_constants.max()))
            gain[name].append(float(found.dc_gain[0]))

    def bias(values: list[float], truth: float) -> tuple[float, float]:
        return float(np.mean(values)) - truth, float(np.std(values, ddof=1) / np.sqrt(len(values)))

    off, error = bias(slow["arx"], 3632.0)
    assert off < -500.0  # s: too fast
    assert abs(off) > 10.0 * error
    off, error = bias(slow["oe"], 3632.0)
    assert abs(off) < 3.0 * error + 36.0  # a nonlinear estimator of few data: within 1 % beside its scatter
    off, error = bias(gain["oe"], -16.5)
    assert abs(off) < 3.0 * error + 0.05


def test_output_error_takes_sparse_measurements_and_arx_says_that_it_cannot():
    u = warming(600, 6)
    y = np.full(600, np.nan)
    y[::30] = PLANTED.simulate(u)[::30]  # every half hour
    found = fit_oe(u, y, DT, 2)
    assert found.dc_gain == pytest.approx([-16.5], rel=1e-4)
    with pytest.raises(ModelError, match="equations"):
        fit_arx(u, y, DT, 2)


def test_every_test_has_its_own_state():
    """Two warm-ups put together without the cooling between them (E-003-7): reset, they are one system's."""
    u = np.concatenate([warming(300, 7), warming(300, 8)])
    y = PLANTED.simulate(u, (0, 300))
    for fit in (fit_arx, fit_oe):
        separate, glued = fit(u, y, DT, 2, starts=(0, 300)), fit(u, y, DT, 2)
        assert separate.dc_gain == pytest.approx([-16.5], rel=1e-4)
        assert np.abs(separate.simulate(u, (0, 300)) - y).max() < 1e-3
        assert np.abs(glued.simulate(u) - y).max() > 1.0


def test_order_and_inputs_by_fit_on_the_held_out_part():
    rng = np.random.default_rng(9)
    u = np.column_stack([rng.standard_normal(900).cumsum() * 0.1, warming(900, 10), warming(900, 11)])
    u -= u[0]
    planted = first_order_lags(np.array([700.0, 6000.0]), np.array([[5.0, 0.0], [-9.0, 3.0]]), DT)
    y = planted.simulate(u[:, [2, 1]]) + 0.05 * rng.standard_normal(900)
    assert set(rank_inputs(u, y, DT, 2)) == {1, 2}
    found = identify(u, y, DT, "oe", most_inputs=2)
    assert set(found.inputs) == {1, 2}
    assert found.order >= 2
    assert found.held_out_rms < 0.1
    assert np.sqrt(np.mean((found(u) - planted.simulate(u[:, [2, 1]])) ** 2)) < 0.03
    one = first_order_lags(np.array([2000.0]), np.array([4.0]), DT).simulate(u[:, 1])
    worse = fit_oe(u[:, [1, 2]], y, DT, 1)
    assert np.std(y - worse.simulate(u[:, [1, 2]])) > 3.0 * np.std(y - found(u))
    assert identify(u[:, [1]], one, DT, "arx", orders=(1, 2)).model.dc_gain == pytest.approx([4.0], rel=1e-4)


def test_too_little_is_refused():
    u = warming(30, 12)
    with pytest.raises(ModelError, match="unknowns"):
        fit_oe(u, np.where(np.arange(30) < 4, 1.0, np.nan), DT, 2)
    with pytest.raises(ModelError, match="never change"):
        identify(np.zeros((30, 2)), np.arange(30.0), DT)

"""Noise that remembers and model discrepancy: the whitening is the inverse root of the covariance it stands for."""

import numpy as np
import pytest

from twin.calibrate.fit.noise import Channels, Noise, estimated, white


def ar1(rng, phi, sigma, n):
    e = sigma * rng.standard_normal(n)
    r = np.empty(n)
    r[0] = e[0] / np.sqrt(1 - phi**2)
    for t in range(1, n):
        r[t] = phi * r[t - 1] + e[t]
    return r


def covariance(phi, sigma, n):
    lag = np.abs(np.subtract.outer(np.arange(n), np.arange(n)))
    return sigma**2 / (1 - phi**2) * phi**lag


def test_whitening_is_an_inverse_root_of_the_covariance():
    n, rng = 40, np.random.default_rng(0)
    form = rng.standard_normal((n, 2, 3))
    noise = Noise(Channels(np.array([0.3, 2.0]), np.array([0.0, 0.9])), form)
    for c, (phi, sigma) in enumerate(((0.0, 0.3), (0.9, 2.0))):
        values = np.zeros((n, 2, n))
        values[:, c] = np.eye(n)
        W = noise.whiten(values)[:, c]
        whole = covariance(phi, sigma, n) + form[:, c] @ form[:, c].T
        np.testing.assert_allclose(W @ whole @ W.T, np.eye(n), atol=1e-9)


def test_gaps_interrupt_a_channel():
    rng = np.random.default_rng(1)
    values = np.array([ar1(rng, 0.8, 1.0, 30)]).T
    values[10:13] = np.nan
    channels = Channels(np.array([1.0]), np.array([0.8]))
    got = channels.whiten(values)
    assert np.all(got[10:13] == 0.0)
    np.testing.assert_allclose(got[13], np.sqrt(1 - 0.64) * values[13])
    np.testing.assert_allclose(got[14], values[14] - 0.8 * values[13])


@pytest.mark.parametrize("phi", [0.0, 0.6, 0.9])
def test_memory_is_estimated_beside_white_noise(phi):
    rng = np.random.default_rng(2)
    residual = np.array([ar1(rng, phi, 0.05, 2000) + 0.02 * rng.standard_normal(2000) for _ in range(8)]).T
    found = estimated(residual, np.full(8, 0.02))
    assert np.median(found.phi) == pytest.approx(phi, abs=0.06)
    # what is whitened has unit variance, though white noise is counted as memory's own
    assert np.std(found.whiten(residual)) == pytest.approx(1.0, abs=0.05)


def test_an_offset_is_memory_but_capped_and_a_floor_holds():
    residual = np.column_stack([np.ones(100), 1e-9 * np.ones(100)])
    found = estimated(residual, np.array([0.01, 0.01]))
    assert 0.9 < found.phi[0] < 0.995  # less than one: what is whitened keeps some of the offset
    assert np.abs(found.whiten(residual)[1:, 0]).min() > 0.0
    assert estimated(residual, np.array([0.01, 0.01]), cap=0.6).phi[0] == 0.6
    assert found.sigma[1] == 0.01


def test_residuals_below_the_stated_noise_are_white():
    """A cautious sigma is no memory: a capped phi would throw the data away."""
    slow = 0.1 * np.sin(np.linspace(0.0, 6.0, 200))[:, None]
    found = estimated(slow, np.array([0.5]))
    assert found.phi[0] == 0.0
    assert found.sigma[0] == 0.5


def test_short_channels_keep_their_scatter_and_have_no_memory():
    found = estimated(np.full((5, 1), 0.3), np.array([0.1]))
    assert found.phi[0] == 0.0
    assert found.sigma[0] == pytest.approx(0.3)


def test_what_form_explains_is_taken_out_before_noise_is_judged():
    rng = np.random.default_rng(3)
    n = 300
    form = np.cumsum(rng.standard_normal((n, 1, 1)), axis=0)
    residual = (2.0 * form[:, :, 0]) + 0.1 * rng.standard_normal((n, 1))
    noise = Noise(white(np.array([0.1])), form)
    assert np.std(noise.without_form(residual)) == pytest.approx(0.1, rel=0.15)
    assert np.std(residual) > 1.0

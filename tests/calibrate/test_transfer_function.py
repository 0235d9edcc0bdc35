"""Poles and residues against the anchors of paper 003's Table 2 (erratum E-003-6), and their algebra."""

import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from twin.calibrate.transfer_function.direct_form import ConditioningWarning, conditioning, from_direct_form
from twin.calibrate.transfer_function.model import TransferFunction, first_order_lags
from twin.errors import ModelError

# Table 2 as printed, um/K at 1 s: the digits are taken as exact decimals
A = np.array([-0.0130427, 0.0130361, 0.0])
B = np.array([1.0, -1.9982716, 0.998272])
HALF_DIGITS = np.array([5e-8, 5e-7])  # of b_1 and b_2, which has six digits


@pytest.fixture
def table_2() -> TransferFunction:
    with pytest.warns(ConditioningWarning, match="single precision"):
        return from_direct_form(A, B, 1.0)


def direct_form(a: np.ndarray, b: np.ndarray, n: int, kind: type) -> np.ndarray:
    """Step response (n,) of eq (3) as a control would run it in numbers of one kind."""
    a0, a1, a2, b1, b2 = (kind(x) for x in (*a, *b[1:]))
    one, zero = kind(1.0), kind(0.0)
    u1 = u2 = y1 = y2 = zero
    response = np.zeros(n, dtype=kind)
    for k in range(n):
        y = a0 * one + a1 * u1 + a2 * u2 - b1 * y1 - b2 * y2
        response[k], y1, y2, u1, u2 = y, y, y1, one, u1
    return response


def test_table_2_has_the_paper_s_gain_poles_and_zero(table_2):
    assert table_2.dc_gain == pytest.approx([-16.5], abs=0.001)
    np.testing.assert_allclose(np.sort(table_2.poles.real), [0.99854687, 0.99972473], atol=5e-9)
    assert not table_2.poles.imag.any()
    np.testing.assert_allclose(np.sort(table_2.time_constants), [688.0, 3632.0], atol=0.5)


@pytest.mark.parametrize(
    ("time", "response"), [(60, -0.767), (600, -5.621), (1800, -10.320), (3600, -13.017), (7200, -15.221)]
)
def test_step_responses_are_those_of_the_paper(table_2, time, response):
    assert table_2.step_response(7201)[time] == pytest.approx(response, abs=6e-4)
    assert table_2.simulate(np.ones(7201))[time] == pytest.approx(response, abs=6e-4)


def test_rise_times_are_those_of_the_paper(table_2):
    assert table_2.rise_time(1.0 - np.exp(-1.0)) == pytest.approx(1848.0, abs=1.0)
    assert table_2.rise_time(0.95) == pytest.approx(8792.0, abs=1.0)


def test_float32_settles_elsewhere_in_direct_form_only(table_2):
    """17 % off in direct form; poles and residues rounded to the same precision keep the gain."""
    direct = direct_form(A, B, 40_000, np.float32)
    assert direct[-1] == pytest.approx(-13.7, abs=0.05)
    assert direct[-1] == direct[-5000]  # settled
    rounded = TransferFunction(
        1.0,
        table_2.poles.astype(np.complex64).astype(complex),
        table_2.residues.astype(np.complex64).astype(complex),
        table_2.direct.astype(np.float32).astype(float),
    )
    assert rounded.dc_gain == pytest.approx([-16.5], rel=1e-3)
    np.testing.assert_allclose(direct_form(A, B, 9000, np.float64), table_2.step_response(9000), rtol=1e-6)


def test_the_printed_digits_do_not_determine_the_model():
    """Half a digit of b_2: -7.33 um/K, or unstable with a pole at 1.000056."""
    up, down = B + [0.0, 0.0, 5e-7], B - [0.0, 0.0, 5e-7]
    with pytest.warns(ConditioningWarning):
        assert from_direct_form(A, up, 1.0).dc_gain == pytest.approx([-7.333], abs=1e-3)
    with pytest.warns(ConditioningWarning), pytest.raises(ModelError, match=r"unstable.*1\.000056"):
        from_direct_form(A, down, 1.0)
    with pytest.warns(ConditioningWarning, match="may be unstable"):
        from_direct_form(A, B, 1.0, HALF_DIGITS)
    told = conditioning(A, B, HALF_DIGITS)
    assert told.may_be_unstable
    assert told.dc_gain_range[0] == pytest.approx(-6.6e-6 / 9.5e-7)
    assert told.amplification == pytest.approx((1.9982716 + 0.998272) / 4e-7, rel=1e-6)


def test_a_well_conditioned_direct_form_needs_no_warning():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = from_direct_form(np.array([0.0, 0.5]), np.array([2.0, -1.0]), 1.0)
    np.testing.assert_allclose(found.simulate(np.ones(4)), [0.0, 0.25, 0.375, 0.4375])


def test_what_is_no_stable_model_is_refused():
    zero = np.zeros(1)
    with pytest.raises(ModelError, match="unstable"):
        TransferFunction(1.0, np.array([1.0 + 0j]), np.ones((1, 1)), zero)
    with pytest.raises(ModelError, match="not finite"):
        TransferFunction(1.0, np.array([np.nan + 0j]), np.ones((1, 1)), zero)
    with pytest.raises(ModelError, match="positive imaginary"):
        TransferFunction(1.0, np.array([0.5 - 0.1j]), np.ones((1, 1)), zero)
    with pytest.raises(ModelError, match="coincide"):
        from_direct_form(np.array([1.0]), np.array([1.0, -1.0, 0.25]), 1.0)
    with pytest.raises(ModelError, match="starts"):
        first_order_lags(np.array([100.0]), np.ones(1), 1.0).simulate(np.ones(5), starts=(1,))


def random_model(seed: int) -> TransferFunction:
    rng = np.random.default_rng(seed)
    tau = rng.uniform(3.0, 300.0, 2)
    pair = np.exp(-1.0 / rng.uniform(20.0, 200.0) + 1j * rng.uniform(0.01, 2.0))
    residues = rng.standard_normal((3, 2)) + 1j * np.array([[0.0], [0.0], [1.0]]) * rng.standard_normal((3, 2))
    return TransferFunction(1.0, np.array([*np.exp(-1.0 / tau), pair]), residues, rng.standard_normal(2))


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6), st.integers(0, 60))
def test_state_carries_over_and_starts_forget_it(seed, cut):
    """In two goes as in one; with a start there, the rest is what a fresh model gives (E-003-7)."""
    model = random_model(seed)
    u = np.random.default_rng(seed + 1).standard_normal((60, 2))
    whole = model.simulate(u)
    first, state = model.advance(model.rest(), u[:cut])
    second, _ = model.advance(state, u[cut:])
    np.testing.assert_allclose(np.concatenate([first, second]), whole, rtol=1e-9, atol=1e-9)
    if 0 < cut < 60:
        np.testing.assert_array_equal(model.simulate(u, (0, cut))[cut:], model.simulate(u[cut:]))


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6))
def test_the_definition_holds_and_files_keep_it(seed):
    """The recursion of the docstring, written out; JSON gives the same numbers back."""
    model = random_model(seed)
    u = np.random.default_rng(seed + 1).standard_normal((40, 2))
    x = np.zeros((3, 2), dtype=complex)
    expected = []
    for row in u:
        parts = model.residues * x
        expected.append(row @ model.direct + parts[:2].sum().real + 2.0 * parts[2].sum().real)
        x = model.poles[:, None] * x + row
    np.testing.assert_allclose(model.simulate(u), expected, rtol=1e-9, atol=1e-10)
    again = TransferFunction.from_json(model.to_json())
    for name in ("poles", "residues", "direct"):
        np.testing.assert_array_equal(getattr(again, name), getattr(model, name))
    steps = np.column_stack([np.ones(4000), np.zeros(4000)])
    assert model.simulate(steps)[-1] == pytest.approx(model.dc_gain[0], rel=1e-4, abs=1e-3)


@pytest.mark.parametrize("hold", ["zero", "linear"])
def test_lags_are_exact_for_inputs_held_so(hold):
    """Against the exponential, solved at 1/1000 of the interval for an input of that kind."""
    dt, tau, gain, fine = 60.0, 200.0, -4.0, 1000
    u = np.random.default_rng(3).standard_normal(30)
    time = np.arange(29 * fine + 1) * dt / fine
    inputs = np.interp(time, dt * np.arange(30), u) if hold == "linear" else np.repeat(u, fine)[: len(time)]
    y, a = np.zeros(len(time)), np.exp(-dt / fine / tau)
    for k in range(1, len(time)):
        y[k] = a * y[k - 1] + (1.0 - a) * 0.5 * (inputs[k - 1] + (inputs[k] if hold == "linear" else inputs[k - 1]))
    model = first_order_lags(np.array([tau]), np.array([gain]), dt, hold)
    at = model.simulate(u)
    ramp_from_rest = gain * y[::fine]
    if hold == "linear":  # the model's input is a line from zero to u(0) in the interval before
        lead = gain * u[0] * (1.0 - tau / dt * (1.0 - np.exp(-dt / tau)))
        ramp_from_rest = ramp_from_rest + lead * np.exp(-dt * np.arange(30) / tau)
    np.testing.assert_allclose(at, ramp_from_rest, atol=2e-6)
    assert model.dc_gain == pytest.approx([gain])

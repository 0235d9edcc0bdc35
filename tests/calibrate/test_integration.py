"""The window model's step: the runtime's own numbers at any values of the parameters, and their derivatives."""

from dataclasses import replace

import numpy as np
import pytest

from tests.calibrate import lumped_case
from twin.calibrate.fit.batch import batch
from twin.calibrate.fit.options import Options
from twin.calibrate.fit.problem import problem
from twin.calibrate.fit.training import fields_of, states_at
from twin.rom.load_model import LawUse

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def case():
    """All parameters of the lumped machine; initial temperatures free. The window model has every state."""
    a = lumped_case.artefact()
    run = replace(lumped_case.truth({}), initial_temperature=None)
    made = problem(a, [run], a.parameters, Options(draws=3))
    assert {p.kind for p in a.parameters} == {
        "source", "film", "joint", "contact", "capacity", "expansion", "environment",
    }  # fmt: skip
    return a, made


def runtime(a, made, x):
    """The artefact's runtime at x, every factor exact."""
    import twin.calibrate.fit.training as training

    run = made.runs[0]
    one = np.concatenate([b.one for b in a.model.bodies])
    x0 = (run.start - a.model.reference_temperature) * one
    n = len(made.parameters)
    x0 = x0 + fields_of(a.model, made.starts) @ (x[n:] * made.scale[n:])
    exact = training.inputs_of
    training.inputs_of = lambda load, drive, substeps: exact(load, drive, substeps, follow=0.0)
    try:
        return states_at(a.model, a.parameters, made.values(x), run.drive, x0, made.options.substeps)
    finally:
        training.inputs_of = exact


@pytest.mark.parametrize("spread", [0.0, 0.8])
def test_equals_the_runtime(case, spread):
    a, made = case
    x = spread * np.random.default_rng(4).standard_normal(len(made.scale))
    wanted = runtime(a, made, x)
    got = made.states(made.runs[0], x) @ made.basis.T
    size = np.abs(wanted).max()
    # all 50 parameters elsewhere: the basis was trained at three draws, so this also bounds what it leaves out
    assert np.abs(got - wanted).max() < (1e-9 if made.model.n == a.model.n else 2e-4) * size


def test_derivatives_are_those_of_differences(case):
    """Against differences of the outputs, with every kind of parameter; laws are tables with kinks, hence 1e-3."""
    _, made = case
    x = 0.3 * np.random.default_rng(5).standard_normal(len(made.scale))
    ((dT, dw),) = made.jacobian(x)
    h = 1e-3
    for k in range(0, len(x), 7):
        ahead, behind = x.copy(), x.copy()
        ahead[k] += h
        behind[k] -= h
        ((Ta, wa),), ((Tb, wb),) = made.outputs(ahead), made.outputs(behind)
        for got, a, b in ((dT[..., k], Ta, Tb), (dw[..., k], wa, wb)):
            difference = (a - b) / (2 * h)
            scale = max(np.abs(difference).max(), 1e-6 * np.abs(a).max())
            assert np.abs(got - difference).max() < 2e-3 * scale, made.names[k]


def test_derivatives_are_exact_where_laws_are_smooth():
    """Constant films: outputs are analytic in the parameters, and differences agree to their rounding."""
    a = lumped_case.artefact()
    constant = LawUse("constant_film", {"natural": 8.0}, {})
    load = replace(
        a.model.load_model, films=tuple(replace(f, use=constant, emissivity=0.0) for f in a.model.load_model.films)
    )
    a = replace(a, model=replace(a.model, load_model=load))
    chosen = [p for p in a.parameters if p.kind in ("film", "joint", "contact", "capacity", "source")]
    steady = [s.name for s in load.sources if "temperature" not in s.use.signals]
    chosen = [p for p in chosen if p.kind != "source" or p.targets[0] in steady]
    made = problem(a, [lumped_case.truth({})], chosen, Options(draws=1))
    x = np.zeros(len(chosen))
    ((dT, _),) = made.jacobian(x)
    for kind in ("film", "joint", "contact", "capacity"):
        k = next(i for i, p in enumerate(chosen) if p.kind == kind)
        h = 1e-3
        step = h * np.eye(len(x))[k]
        ((a2, _),), ((a1, _),) = made.outputs(x + 2 * step), made.outputs(x + step)
        ((b1, _),), ((b2, _),) = made.outputs(x - step), made.outputs(x - 2 * step)
        difference = (8.0 * (a1 - b1) - (a2 - b2)) / (12.0 * h)  # fourth order
        assert np.abs(dT[..., k] - difference).max() < 1e-5 * np.abs(difference).max(), chosen[k].path


def test_a_batch_is_its_samples_one_by_one(case):
    _, made = case
    samples = 0.5 * np.random.default_rng(6).standard_normal((100, len(made.scale)))
    done = []
    many = batch(made, made.runs[0], samples, done.append)
    assert sum(done) == len(samples)
    assert len(done) > 1  # not all at once: the first and the last of every portion
    ends = np.cumsum(done)
    for k in sorted({*(ends - done), *(ends - 1)}):
        ((T, w),) = made.outputs(samples[k])
        np.testing.assert_allclose(many.temperature[k], T, atol=1e-9)
        np.testing.assert_allclose(many.tcp[k], w, atol=1e-15)

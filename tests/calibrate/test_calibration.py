"""Calibration end to end: truth from a finer model with planted parameters and noise."""

from dataclasses import replace

import numpy as np
import pytest

from tests.calibrate import lumped_case
from twin.calibrate.fit.calibration import calibrate, chosen, windows
from twin.calibrate.fit.evaluated import Evaluated, floors
from twin.calibrate.fit.experiments import propose
from twin.calibrate.fit.fit import Stop, _seen, fit
from twin.calibrate.fit.options import Options
from twin.calibrate.fit.problem import problem
from twin.calibrate.fit.separation import separation
from twin.errors import LogError, TwinError
from twin.rom.apply import with_values
from twin.run.replay import replay

ONLY = ("sources.*", "films.*", "environment.*.offset")
OPTIONS = Options(temperature_sigma=lumped_case.NOISE_TEMPERATURE, tcp_sigma=lumped_case.NOISE_TCP, draws=4)


def planted(parameters, seed):
    x = np.clip(np.random.default_rng(seed).standard_normal(len(parameters)), -2, 2)
    return x, {p.path: p.value(float(c)) for p, c in zip(parameters, x, strict=True)}


@pytest.fixture(scope="module")
def parameters():
    return chosen(lumped_case.artefact(), ONLY)


@pytest.fixture(scope="module")
def case(parameters):
    x, values = planted(parameters, 1)
    run = lumped_case.truth(values, 1)
    return x, run, calibrate(lumped_case.artefact(), [run], parameters, OPTIONS)


def test_planted_values_are_recovered(case, parameters):
    x, _, result = case
    z = (result.fit.x - x) / result.fit.sigma
    assert result.fit.stopped == "minimum"
    assert np.sqrt(np.mean(z**2)) < 1.5
    assert np.abs(z).max() < 3.5
    assert result.fit.sigma.min() < 0.2  # and something was learned
    assert result.agreement.enough


def test_residuals_are_the_noise(case):
    _, run, result = case
    ((T, w),) = result.fit.residual
    assert np.nanstd(T) < 1.5 * lumped_case.NOISE_TEMPERATURE / np.sqrt(5)  # bins of five minutes
    assert np.std(w) < 1.5 * lumped_case.NOISE_TCP
    assert len(w) == len(run.tcp.time)


def test_the_fitted_artefact_predicts_another_run_of_the_truth(case, parameters):
    """Not by the window model: the artefact with fitted values against the finer model, without noise, other loads."""
    _, _, result = case
    a = lumped_case.artefact()
    _, values = planted(parameters, 1)
    clean = lumped_case.truth(values, 0, noise=0.0)
    errors = []
    for made in ({}, result.fit.problem.values(result.fit.x)):
        other = replace(a, model=with_values(a.model, a.parameters, made))
        simulated = replay(other, clean)
        wanted = np.column_stack([clean.temperatures.columns[s] for s in a.model.sensors])
        errors.append(np.sqrt(np.mean((simulated.temperature[:, : len(a.model.sensors)] - wanted) ** 2)))
    assert errors[1] < 0.1 * errors[0]


def test_a_fit_stops_where_told_and_stays_within_bounds(parameters):
    run = lumped_case.truth(planted(parameters, 2)[1], 2)
    narrow = tuple(replace(p, low=p.value(-0.3), high=p.value(0.3)) if p.kind == "source" else p for p in parameters)
    made = problem(lumped_case.artefact(), [run], narrow, OPTIONS)
    seen = []
    few = fit(made, Stop(iterations=2), report=seen.append)
    assert few.stopped == "iterations"
    assert len(few.history) <= 3
    low, high = made.bounds
    for iteration in seen:
        assert np.all(iteration.x >= low - 1e-12)
        assert np.all(iteration.x <= high + 1e-12)
    timed = fit(made, Stop(seconds=0.0))
    assert timed.stopped == "time"
    assert np.all(np.isfinite(timed.covariance))
    whole = fit(made)
    assert whole.at_bound.any()

    def interrupt(iteration):
        if iteration.number == 1:
            raise KeyboardInterrupt

    stopped = fit(made, report=interrupt)
    assert stopped.stopped == "interrupted"
    np.testing.assert_array_equal(stopped.x, seen[1].x)


def test_a_fit_of_a_poor_model_is_repeated_until_its_own_noise_changes_it_no_more(parameters):
    run, rng = lumped_case.truth(planted(parameters, 2)[1], 2), np.random.default_rng(2)
    time = run.temperatures.time
    columns = {  # about 1 K that no machine of this form can do
        name: values + rng.uniform(0.5, 1.5) * np.sin(time / rng.uniform(1500.0, 6000.0) + rng.uniform(0.0, 6.0))
        for name, values in run.temperatures.columns.items()
    }
    made = problem(
        lumped_case.artefact(), [replace(run, temperatures=replace(run.temperatures, columns=columns))], parameters,
        OPTIONS,
    )  # fmt: skip
    found = fit(made)
    noise = _seen(Evaluated(made), found.noise, [floors(made, own) for own in made.runs], found.x)
    again = fit(made, start=found.x, known=noise)
    assert found.stopped == "minimum"
    assert np.max(np.abs(again.x - found.x) / found.sigma) < 0.3  # 1.5 after two repetitions


@pytest.mark.long
def test_an_unknown_initial_temperature_is_found(parameters):
    """A machine that stood in the sun: the housing is 2 K warmer at the start, and the run does not say so."""
    a = lumped_case.artefact()
    made = problem(
        a, [replace(lumped_case.truth({}), initial_temperature=None)], parameters, replace(OPTIONS, initial_sigma=1.0)
    )
    k = made.names.index("initial.truth.housing")
    x = np.zeros(len(made.scale))
    x[k] = 2.0
    ((T, w),) = made.outputs(x)
    rng = np.random.default_rng(0)
    measured = replace(
        made.runs[0].measured,
        temperature=T + 0.02 * rng.standard_normal(T.shape),
        tcp=w + 3e-7 * rng.standard_normal(w.shape),
    )
    made = replace(made, runs=(replace(made.runs[0], measured=measured),))
    found = fit(made)
    assert found.x[k] == pytest.approx(2.0, abs=4 * found.sigma[k])
    assert found.sigma[k] < 0.2


@pytest.mark.long
def test_two_runs_share_the_machine_but_not_their_start(parameters):
    _, values = planted(parameters, 3)
    runs = [replace(lumped_case.truth(values, s, name=f"day_{s}"), initial_temperature=None) for s in (1, 2)]
    made = problem(lumped_case.artefact(), runs, parameters, OPTIONS)
    starts = [name for name in made.names if name.startswith("initial.")]
    assert len(starts) == 2 * sum(len(b.members) for b in lumped_case.artefact().model.bodies)
    first = made.names.index(starts[0])
    (dT_1, _), (dT_2, _) = made.jacobian(np.zeros(len(made.scale)))
    assert np.abs(dT_1[..., first]).max() > 0.0
    assert np.abs(dT_2[..., first]).max() == 0.0


@pytest.mark.long
def test_a_film_and_a_source_at_rest_are_not_separable_and_an_experiment_would():
    """Constant load from cold: the housing's warm end state tells only one number about heat in and heat out."""
    a = lumped_case.artefact()
    pair = chosen(a, ("sources.*", "films.*"))
    run = lumped_case.truth({}, 0)
    made = problem(a, [replace(run, tcp=None)], pair, replace(OPTIONS, exclude=tuple(a.model.sensors[1:]), draws=1))
    found = fit(made, Stop(iterations=3))
    left = separation(made.names, found.information)
    assert left.combinations
    assert left.learned.min() < 0.5
    proposals = propose(found, left.combinations[:1])
    ((best, *_),) = proposals.values()
    assert best.sigma_after < best.sigma_before


def test_held_and_unmeasured_parameters_are_not_fitted():
    a = lumped_case.artefact()
    assert {p.kind for p in chosen(a, hold=("contacts.*",))} >= {"source", "film"}
    assert not any(p.kind in ("joint", "contact") for p in chosen(a, hold=("contacts.*",)))
    assert not any(p.kind == "expansion" for p in chosen(a, tcp=False))
    with pytest.raises(TwinError, match="matches no parameter"):
        chosen(a, ("sources.spindel*",))
    with pytest.raises(TwinError, match="no parameter is left"):
        chosen(a, ("sources.*",), ("*",))


def test_runs_without_measurements_are_refused(parameters):
    run = replace(lumped_case.truth({}), temperatures=None, tcp=None)
    with pytest.raises(LogError, match="nothing measured"):
        problem(lumped_case.artefact(), [run], parameters, OPTIONS)


def test_windows_slide():
    run = lumped_case.truth({})
    end = run.loads.time[-1]
    parts = windows(run, 1800.0, 1200.0)
    assert len(parts) == round(end / 1200.0)
    for k, part in enumerate(parts):
        stop = (k + 1) * 1200.0
        assert part.loads.time[0] == run.loads.time[0]  # the model starts with the run
        assert part.temperatures.time[-1] <= stop
        assert part.temperatures.time[0] > stop - 1800.0 - 1e-9
        assert np.all(part.tcp.time <= stop)


def test_nominal_values_of_a_calibrated_model_are_those_fitted(case, parameters):
    from twin.calibrate.fit.product import calibrated

    _, _, result = case
    a = lumped_case.artefact()
    values = result.fit.problem.values(result.fit.x)
    model, now = calibrated(a, parameters, values)
    assert {p.path: p.nominal for p in now if p.path in values} == pytest.approx(values)
    again = with_values(model, now, {p.path: p.nominal for p in now})
    for one, other in zip(model.bodies, again.bodies, strict=True):
        np.testing.assert_allclose(one.E, other.E, rtol=1e-12, atol=1e-12)

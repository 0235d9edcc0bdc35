"""Films whose law has other exponents than described, of their rise or of a speed."""

from __future__ import annotations

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.calibrate.fit.noise import Channels
from twin.diagnose.evidence.film_laws import with_film_laws
from twin.diagnose.evidence.fitter import Fitter
from twin.diagnose.evidence.nulls import Form
from twin.diagnose.evidence.settled import settled_alone
from twin.diagnose.evidence.whiten import Whitener
from twin.diagnose.model.probed_model import make_probed_model
from twin.diagnose.model.study import Study, make_study
from twin.diagnose.model.surrogate import jacobian_of, make_surrogate
from twin.diagnose.search.declared import with_signal
from twin.machine.parameters import parameters
from twin.physics.laws import LAWS
from twin.rom.parameter import OF_LAWS

HEIGHT = 0.3  # m
RISE = 5.0  # K, where both laws give the described coefficient
DESCRIBED = 6.0  # W/(m^2 K), of films.air
RADIATION = 5.2  # W/(m^2 K) of a surface of emissivity 0.9 at 22 degC: 4 sigma eps T^3


@pytest.mark.slow
def test_laminar_free_convection_where_a_constant_is_described():
    """The film's gain and its exponent explain all but a tenth of what both machines differ by: that of 1/4 in what
    convection is of the film."""
    gain = DESCRIBED / float(
        LAWS["free_vertical_plate_laminar"].function(surface=20.0 + RISE, ambient=20.0, height=HEIGHT)
    )
    law = {"law": "free_vertical_plate_laminar", "parameters": {"height": f"{HEIGHT} m"}, "gain": gain}
    left, found = _explained("air", law, ("gain", "exponent"))
    assert left < 0.1
    # within what rises below half a kelvin do, at the start of a run
    np.testing.assert_allclose(found["exponent"], 0.25 * DESCRIBED / (DESCRIBED + RADIATION), rtol=0.2)


@pytest.mark.long
def test_laminar_forced_convection_where_turbulent_is_described():
    """The exponent of the speed tells most of what a share of forced convection alone does not."""
    laminar = {"parameters": {"natural": "6 W/(m^2*K)", "forced": "30 W/(m^2*K)", "exponent": 0.5}}
    without, _ = _explained("moving", laminar, ("gain", "wind"))
    left, found = _explained("moving", laminar, ("gain", "wind", "wind_exponent"))
    assert left < 0.1
    assert left < 0.5 * without
    assert found["wind_exponent"] < 0.0


def _with_law(film: str, law: dict[str, object]) -> Study:
    """The small case with another law of a film."""
    machine, study = small_case.machine(), small_case.described()
    films = machine.films | {film: machine.films[film].model_copy(update=law)}
    real = machine.model_copy(update={"films": films})
    plans = [p.measured for p in study.runs]
    return make_study(make_probed_model(real, parameters(machine), small_case.runs()), plans, study.fitted)


def _explained(film: str, law: dict[str, object], of: tuple[str, ...]) -> tuple[float, dict[str, float]]:
    """What numbers of a film's law leave of the difference to a machine with another law, and their values."""
    study, other = small_case.described(), _with_law(film, law)
    known = other.probed.parameters
    free = with_film_laws(study, Form())
    paths = [p.path for p in free.probed.parameters]
    own = [paths.index(f"films.{film}.{name}") for name in of]
    unit = np.concatenate([_units(study, k) for k in study.fitted])
    y, u = other.all_outputs(np.zeros(len(known))) / unit, np.zeros(len(free.scale))
    before = np.linalg.norm(y - free.all_outputs(u) / unit)
    for _ in range(4):  # Gauss-Newton
        J = jacobian_of(free, u)[:, own] / unit[:, None]
        u[own] += np.linalg.lstsq(J, y - free.all_outputs(u) / unit, rcond=None)[0]
    left = float(np.linalg.norm(y - free.all_outputs(u) / unit) / before)
    return left, {name: float(u[j] * free.scale[j]) for name, j in zip(of, own, strict=True)}


def test_exponents_are_as_unsure_as_described_and_physical_ones_differ():
    """A constant coefficient may be any of 0 to 1/3, free convection as laminar as described is nearer to all of
    these; 400 W/(m^2 K) of water have a sixteenth of what the same film would have in still air."""
    of_constant = np.sqrt(1.0 / 36.0 + 1.0 / 108.0)
    sigma = {p.path: p.sigma for p in with_film_laws(small_case.described(), Form()).probed.parameters}
    assert sigma["films.coolant.exponent"] == pytest.approx(of_constant / 16.0)
    assert sigma["films.air.exponent"] == pytest.approx(of_constant)
    law = {"law": "free_vertical_plate_laminar", "parameters": {"height": f"{HEIGHT} m"}, "emissivity": 0.0}
    free = {p.path: p.sigma for p in with_film_laws(_with_law("air", law), Form()).probed.parameters}
    assert free["films.air.exponent"] == pytest.approx(np.sqrt((1.0 / 4.0 - 1.0 / 6.0) ** 2 + 1.0 / 108.0), rel=0.05)


def test_films_whose_law_reads_no_speed_have_no_reaction_to_it():
    study = small_case.described()
    films = study.probed.base.load_model.films
    made = with_film_laws(study, Form()).probed.parameters
    for kind in ("wind", "wind_exponent"):
        assert [p.targets[0] for p in made if p.kind == kind] == [f.name for f in films if f.use.signals]
    assert [p.targets[0] for p in made if p.kind == "exponent"] == [f.name for f in films]
    known = with_film_laws(study, Form(exponents=(0.0, 0.0))).probed.parameters
    assert not any(p.kind == "exponent" for p in known)


@pytest.mark.long
def test_laws_as_described_change_nothing():
    study = small_case.described()
    free = with_film_laws(study, Form())
    np.testing.assert_array_equal(
        free.all_outputs(np.zeros(len(free.scale))), study.all_outputs(np.zeros(len(study.scale)))
    )


def test_a_corrected_signal_leaves_the_laws_of_films():
    """A run whose current is read anew has films at the rise and the speed that it had."""
    study = with_film_laws(small_case.described(), Form())
    x = np.array([0.8 * (p.kind in OF_LAWS) for p in study.probed.parameters])
    as_logged = with_signal(study, "spindle_current", 1.0)
    np.testing.assert_allclose(as_logged.all_outputs(x), study.all_outputs(x), rtol=0.0, atol=1e-9)
    assert np.abs(study.all_outputs(x) - study.all_outputs(0.0 * x)).max() > 0.05


def test_coefficients_are_those_of_the_rise_at_which_they_are_stated():
    study = with_film_laws(small_case.described(), Form())
    assert all(np.all(study.probed.runs[k].loads.usual == RISE) for k in study.fitted)


@pytest.mark.long
def test_the_delivered_calibration_has_the_laws_of_the_description():
    study = with_film_laws(small_case.described(), Form())
    sensors = (np.full(len(study.runs[k].measured.sensors), small_case.NOISE) for k in study.fitted)
    tcp = Channels(np.full(3, small_case.TCP_NOISE), np.zeros(3))
    whiten = Whitener(study, tuple((Channels(s, np.zeros(len(s))), tcp) for s in sensors))
    fitter = Fitter(study, make_surrogate(study), whiten, np.zeros((study.rows[-1].stop, 0)))
    laws = [p.kind in OF_LAWS for p in study.probed.parameters]
    x = np.array([0.8 * (p.path == "films.air.exponent") for p in study.probed.parameters])
    y = study.all_outputs(x)
    np.testing.assert_allclose(fitter(y).x, x, rtol=0.0, atol=0.1)
    assert not settled_alone(fitter, y)[0][laws].any()


def _units(study, k: int) -> np.ndarray:
    """K and m per number of a run: the noise of the case."""
    (bins, sensors), (rows, three) = study.runs[k].shapes
    return np.concatenate([np.full(bins * sensors, small_case.NOISE), np.full(rows * three, small_case.TCP_NOISE)])

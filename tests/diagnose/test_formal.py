"""What a film law of another exponent does: known in its shape before anything is measured."""

from __future__ import annotations

import numpy as np

from tests.diagnose import small_case
from twin.diagnose.evidence.nulls import Form
from twin.diagnose.faults.forms import _steeper
from twin.diagnose.model.probed_model import make_probed_model
from twin.diagnose.model.study import make_study
from twin.machine.parameters import parameters
from twin.physics.laws import LAWS

HEIGHT = 0.3  # m
RISE = 5.0  # K, where both laws give the described coefficient
DESCRIBED = 6.0  # W/(m^2 K), of films.air


def test_laminar_free_convection_where_a_constant_is_described():
    """Beside what the film's own gain takes, most of the difference of both machines has the shape of the column, and
    its size: an exponent of 1/4 more."""
    machine, study = small_case.machine(), small_case.study()
    law = LAWS["free_vertical_plate_laminar"].function
    gain = DESCRIBED / float(law(surface=20.0 + RISE, ambient=20.0, height=HEIGHT))
    film = machine.films["air"].model_copy(
        update={"law": "free_vertical_plate_laminar", "parameters": {"height": f"{HEIGHT} m"}, "gain": gain}
    )
    real = machine.model_copy(update={"films": machine.films | {"air": film}})
    plans, known = [p.measured for p in study.runs], parameters(machine)
    other = make_study(make_probed_model(real, known, small_case.runs()), plans, study.fitted)
    x = np.zeros(len(known))
    apart = np.concatenate([other.outputs(k, x) - study.outputs(k, x) for k in study.fitted])
    (j,) = [i for i, p in enumerate(known) if p.path == "films.air.gain"]
    own = np.concatenate([study.jacobian(k, x)[:, j] for k in study.fitted])
    raw = small_case.responses()
    form = Form()
    columns = _steeper(study, small_case.elements(), small_case.nominal(), raw, form)
    films = [f.name for f in study.probed.base.load_model.films]
    column = columns[films.index("air")]
    unit = np.concatenate([_units(study, k) for k in study.fitted])
    apart, own, column = apart / unit, own / unit, column / unit
    apart, column = (v - own * (own @ v) / (own @ own) for v in (apart, column))
    share = float(apart @ column) / float(column @ column)
    # an hour's mean at the start, where the rise goes through decades, and second order leave half of it
    assert np.linalg.norm(apart - share * column) < 0.6 * np.linalg.norm(apart)
    np.testing.assert_allclose(share, 0.25 / form.steep, rtol=0.3)


def test_forced_convection_and_coolants_have_little_of_it():
    """400 W/(m^2 K) of water have a sixteenth of the exponent that the same film would have in still air."""
    study, nominal = small_case.study(), small_case.nominal()
    films = [f.name for f in study.probed.base.load_model.films]
    raw, elements = small_case.responses(), small_case.elements()
    column = _steeper(study, elements, nominal, raw, Form())[films.index("coolant")]
    own = raw[:, elements.block_of["group", "coolant"]].astype(float)
    weights = np.linalg.lstsq(own, column, rcond=None)[0]
    assert np.abs(weights).max() < Form().steep / 16.0 * np.log(100.0)
    assert np.abs(weights).max() > 0.0


def _units(study, k: int) -> np.ndarray:
    """K and m per number of a run: the noise of the case."""
    (bins, sensors), (rows, three) = study.runs[k].shapes
    return np.concatenate([np.full(bins * sensors, small_case.NOISE), np.full(rows * three, small_case.TCP_NOISE)])

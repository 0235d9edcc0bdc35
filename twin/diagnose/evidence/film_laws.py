"""Films that react otherwise than described to their own rise and to speed: parameters of a diagnosis alone.

    h = h_described (rise / usual)^e exp(w (s - mean s)),      e ~ N(0, steep^2),  w ~ N(0, speed^2)

usual: the geometric mean of the rise over the runs, and s 0 .. 1 the reaction to the relative speed that its law
reads, so that neither says how strong a film is in the mean. Radiation is part of h: emissivities are known no better
than laws.

They are fitted with the exact model, like the numbers of the description: a calibration can make the described film of
a motor 0.4 times as strong, and there the response linearised at the description has another shape.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from twin.diagnose.evidence.nulls import Form, convection, winds
from twin.diagnose.model.integration import LITTLE
from twin.diagnose.model.study import Study, make_study
from twin.rom.parameter import Kind, Parameter

FREE = 25.0  # W/(m^2 K), the most that free convection in a gas is (Incropera, DeWitt, 6th ed. 2007, table 1.1)
EXPONENT = 0.65  # of speeds in films: between laminar, 0.5, and turbulent, 0.8 (Incropera, DeWitt, 7.2)
# forced convection at the top speed over what there is at rest: two laws h (1 + c s^m) differ in ln h by
# s^m / (1 + c s^m), to first order in c; free convection with radiation is 6 to 12, forced air 10 to 30 W/(m^2 K)
FORCED = 2.0
# bounds, standard deviations: as far as synthetic measurements draw
MOST = 2.5


def with_film_laws(study: Study, form: Form) -> Study:
    """The study with an exponent more for every film, and a reaction to speed for each whose law reads one. A
    coefficient that is too large for free convection has the exponent in the share that free convection may be."""
    probed = study.probed
    films = probed.base.load_model.films
    n, fitted = len(films), study.fitted
    most = np.max([convection(probed.runs[k].drive, n).mean(axis=0) for k in fitted], axis=0)
    usual = np.exp(np.mean(np.concatenate([_log_rise(study, k) for k in fitted]), axis=0))
    moving = [winds(study, k, np.full(n, EXPONENT)) for k in range(len(study.runs))]
    reaction = [s * (1.0 + FORCED) / (1.0 + FORCED * s) for s in moving]
    mean = np.mean(np.concatenate([reaction[k] for k in fitted]), axis=0)
    parameters = list(probed.parameters)
    for f, film in enumerate(films):
        if form.steep > 0.0:
            parameters.append(_of(film.name, "exponent", form.steep * min(1.0, FREE / max(float(most[f]), FREE))))
        if form.speed > 0.0 and any(reaction[k][:, f].any() for k in fitted):
            parameters.append(_of(film.name, "wind", form.speed))
    runs = tuple(
        replace(run, loads=replace(run.loads, usual=np.tile(usual, (run.drive.n_steps, 1)), wind=own - mean))
        for run, own in zip(probed.runs, reaction, strict=True)
    )
    wider = replace(probed, parameters=tuple(parameters), runs=runs)
    return make_study(wider, [planned.measured for planned in study.runs], fitted)


def _of(film: str, kind: Kind, sigma: float) -> Parameter:
    return Parameter(f"films.{film}.{kind}", kind, (film,), 0.0, "1", -MOST * sigma, MOST * sigma, sigma, "linear")


def _log_rise(study: Study, k: int) -> np.ndarray:
    """(n, n_films) ln of the rise [K] of films' surfaces above their air in run k, as described."""
    system, run = study.probed.system, study.runs[k].run
    states = study.states(k, np.zeros(len(study.scale)))[:-1]
    surface = np.asarray(system.reference_temperature + states @ system.film_rows.T / system.safe_area)
    air = system.film_plan.air(np.asarray(run.loads.environment), np.asarray(run.loads.position))
    return np.log(np.maximum(np.abs(surface - air), LITTLE))

"""Films that react otherwise than described to their own rise and to speed: parameters of a diagnosis alone.

    h = h_described (rise / usual)^e exp(w (s - mean s) + m (b - mean b)),
    e ~ N(0, steep^2),  w ~ N(0, speed^2),  m ~ N(0, speed_exponent^2)

usual: the rise at which coefficients are stated. steep: the described film has an exponent p of the rise, its
radiation included, and the real one any of those that physics allows; what both differ by then is, in rms,

    steep^2 = (middle - p)^2 + width^2 / 12.

With a relative speed v and h = h_0 (1 + c v^m) b = d ln h / dm = c v^m ln v / (1 + c v^m), and s is d ln h / d ln c as
a share of what it is at the top speed; c as described. Means are subtracted, so that none of them says how strong a
film is in the mean. Radiation is part of h: emissivities are known no better than laws.

They are fitted with the exact model, like the numbers of the description: a calibration can make the described film of
a motor 0.4 times as strong, and there the response linearised at the description has another shape.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.special import xlogy

from twin.diagnose.evidence.nulls import Form
from twin.diagnose.evidence.speeds import relative_speed
from twin.diagnose.model.probed_loads import convection
from twin.diagnose.model.study import Study, make_study
from twin.physics.radiation import radiation_coefficient
from twin.rom.following import DIFFERENCES
from twin.rom.parameter import Kind, Parameter

FREE = 25.0  # W/(m^2 K), the most that free convection in a gas is (Incropera, DeWitt, 6th ed. 2007, table 1.1)
EXPONENT = 0.65  # of speeds in films: between laminar, 0.5, and turbulent, 0.8 (Incropera, DeWitt, 7.2)
# least c, forced convection at the top speed over what there is at rest: free convection with radiation is 6 to 12,
# forced air 10 to 30 W/(m^2 K). A description of less says nothing of how a film reacts to a speed that it does feel
FORCED = 2.0
# K, rise at which a coefficient is as sure as its tolerance says: tables give it of surfaces some kelvins warmer than
# the air. Judged, as drawn machines have it; at the rise of the runs instead, 0.8 K, drawn network 400 with nothing
# hidden had a film of 2.5 times
STATED = 5.0
LEAST = 1.0  # W/(m^2 K), of a film at rest
# bounds, standard deviations: as far as synthetic measurements draw
MOST = 2.5


def with_film_laws(study: Study, form: Form) -> Study:
    """The study with an exponent more for every film, and a reaction to speed with its own exponent for each whose law
    reads one. A coefficient that is too large for free convection has the first in the share that free convection may
    be."""
    probed = study.probed
    films = probed.base.load_model.films
    n, fitted = len(films), study.fitted
    described = [convection(probed.runs[k].drive, n) for k in fitted]
    most = np.max([h.mean(axis=0) for h in described], axis=0)
    steep = [_steepness(p, form.exponents) for p in _exponents(study)]
    least, largest = (of([of(h, axis=0) for h in described], axis=0) for of in (np.min, np.max))
    c = np.maximum(largest / np.maximum(least, LEAST) - 1.0, FORCED)
    speed = _relative_speeds(study)
    forced = [c * v**EXPONENT / (1.0 + c * v**EXPONENT) for v in speed]
    wind = [s * (1.0 + c) / c for s in forced]
    bent = [xlogy(s, v) for s, v in zip(forced, speed, strict=True)]
    mean_wind, mean_bent = (np.mean(np.concatenate([own[k] for k in fitted]), axis=0) for own in (wind, bent))
    parameters = list(probed.parameters)
    for f, film in enumerate(films):
        if form.exponents[1] > form.exponents[0]:
            parameters.append(_of(film.name, "exponent", steep[f] * min(1.0, FREE / max(float(most[f]), FREE))))
        if any(speed[k][:, f].any() for k in fitted):
            parameters.append(_of(film.name, "wind", form.speed))
            parameters.append(_of(film.name, "wind_exponent", form.speed_exponent))
    runs = []
    for k, run in enumerate(probed.runs):
        constant = np.full((run.drive.n_steps, n), STATED)
        loads = replace(run.loads, usual=constant, wind=wind[k] - mean_wind, wind_exponent=bent[k] - mean_bent)
        runs.append(replace(run, loads=loads))
    wider = replace(probed, parameters=tuple(parameters), runs=tuple(runs))
    return make_study(wider, [planned.measured for planned in study.runs], fitted)


def _relative_speeds(study: Study) -> list[np.ndarray]:
    """Per run (n, n_films) the speed that the law of each film reads, of the largest in the fitted runs; 0 where it
    reads none."""
    films = study.probed.base.load_model.films
    of_films = [relative_speed(study, film.use.signals.values()) for film in films]
    none = [np.zeros((run.drive.n_steps, 0)) for run in study.probed.runs]
    return [np.stack(own, axis=1) for own in zip(*of_films, strict=True)] or none


def _of(film: str, kind: Kind, sigma: float) -> Parameter:
    return Parameter(f"films.{film}.{kind}", kind, (film,), 0.0, "1", -MOST * sigma, MOST * sigma, sigma, "linear")


def _steepness(exponent: float, allowed: tuple[float, float]) -> float:
    """Standard deviation of the exponent of a film that is described with another one."""
    low, high = allowed
    return float(np.hypot((low + high) / 2.0 - exponent, (high - low) / np.sqrt(12.0)))


def _exponents(study: Study) -> np.ndarray:
    """(n_films,) d ln h / d ln rise of films as described, radiation included, from half to twice the rise at which
    coefficients are stated, in the mean of the fitted runs."""
    probed, ends = study.probed, (STATED / 2.0, 2.0 * STATED)
    films, air = probed.base.load_model.films, probed.base.reference_temperature
    result = np.zeros(len(films))
    tables = [probed.runs[k].drive.films for k in study.fitted]
    for i, f in enumerate(tables[0].index):
        convection = np.mean([table.value[:, i].mean(axis=0) for table in tables], axis=0)
        half, twice = (
            np.interp(rise, DIFFERENCES, convection) + radiation_coefficient(air + rise, air, films[f].emissivity)
            for rise in ends
        )
        result[f] = np.log(twice / half) / np.log(ends[1] / ends[0])
    return result

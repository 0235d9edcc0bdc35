"""Films that react to a speed otherwise than their law says: responses with the exact model, as model discrepancy.

The films of motors and screws stand 15 K above the air, and half as much again of their coefficient is no small change:
their reaction to a speed needs its own exponents and its second order.
"""

from __future__ import annotations

import numpy as np

from twin.build.workers import each
from twin.diagnose.evidence.nulls import EXPONENTS, Form, winds
from twin.diagnose.model.study import Study
from twin.progress import Progress, silent

SPREAD = 12.0**-0.5  # standard deviation of a uniform law of width 1
BENT = 2.0**-0.5  # and of half a squared standard normal


def wind_columns(study: Study, form: Form, progress: Progress = silent) -> np.ndarray:
    """(m, 3 films that hear a speed) outputs [K, m] of one standard deviation each.

    Per film: its reaction with the mean of two exponents, the difference of exponents, the second order.
    """
    n = len(study.probed.base.load_model.films)
    heard = [f for f in range(n) if any(winds(study, k, np.ones(n))[:, f].any() for k in study.fitted)]
    if not heard or form.wind == 0.0:
        return np.zeros((sum(study.runs[k].size for k in study.fitted), 0))
    with progress("films that hear a speed", len(heard)) as advance:
        made = each(_of_film, (study, form), heard, lambda _: advance(""))
    return np.hstack(made)


def _of_film(shared: tuple[Study, Form], f: int) -> np.ndarray:
    study, form = shared
    x = np.zeros(len(study.probed.parameters))
    n_films = len(study.probed.base.load_model.films)
    parts = []
    for k in study.fitted:
        slots = study.slots(k)
        shapes = [winds(study, k, np.full(n_films, e))[:, f] for e in EXPONENTS]
        film = np.array(slots.film)
        for q, shape in enumerate((*shapes, (shapes[0] + shapes[1]) / 2)):
            film[:, q, f] = shape
        slots.film[:] = film
        y, D = study.by_amplitudes(k, x, slots, (0.0, 0.0, 0.0))
        more, less = (study.outputs(k, x, slots, (0.0, 0.0, a)) for a in (form.wind, -form.wind))
        parts.append(
            np.stack([form.wind * D[:, 2], SPREAD * form.wind * (D[:, 1] - D[:, 0]), BENT * (more + less - 2 * y)], 1)
        )
    return np.vstack(parts)

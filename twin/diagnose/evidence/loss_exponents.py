"""What another exponent of its speed would make of the heat of every source that rubs.

    P = P_described (v / v_mean)^l,      l ~ N(0, loss_exponent^2)

Friction warms as a power of the speed. Of a bearing's torque the part that its load makes does not depend on the speed,
and the part that its lubricant makes goes with it to the power 2/3 (Palmgren; Harris, Kotzalas, Rolling bearing
analysis, 5th ed. 2007, chapter 10): the exponent of its heat is between 1 and 5/3, and one that is stated belongs to
the speeds that it was measured at. v_mean: `speeds.log_speed`.

It is known to first order, at the description. Rejected, on the tests' machine: a parameter that is fitted as those of
films, which strong causes bend to its bounds; and synthetic measurements by the exact model, of which much is left that
passes for noise that lasts.
"""

from __future__ import annotations

import numpy as np

from twin.diagnose.evidence.discretisation import Difference
from twin.diagnose.evidence.nulls import Form, emitted
from twin.diagnose.evidence.speeds import log_speed, rubs
from twin.diagnose.model.study import K, Study


def other_exponents(study: Study, form: Form) -> tuple[Difference, ...]:
    """By one standard deviation, of every source for itself; with what the machine makes of it, as friction falls where
    it warms."""
    rubbing = [j for j in range(len(study.probed.base.load_model.sources)) if rubs(study, j)]
    found = list[Difference]()
    for first in range(0, len(rubbing), K):
        chosen, parts = rubbing[first : first + K], []
        for k in study.fitted:
            slots = study.slots(k)
            for s, j in enumerate(chosen):
                slots.forcing[:, s] = log_speed(study, k, j)[:, None] * emitted(study, k, j)
            parts.append(study.by_amplitudes(k, np.zeros(len(study.scale)), slots, [0.0] * len(chosen))[1])
        for column in (form.loss_exponent * np.vstack(parts)[:, : len(chosen)]).T:
            alone, none = column[:, None], np.zeros((len(column), 0))
            found.append(Difference(alone, alone, none, np.zeros(len(column), dtype=int)))
    return tuple(found)

"""Conductances that are nearly gone: responses with the exact model, to tell which contacts to look at closely.

Such a contact moves temperatures nine times as far as its derivative says, by which it may score nothing. What passes
here is refitted before it is believed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.build.workers import each
from twin.diagnose.evidence.batch import Batch, Hypothesis
from twin.diagnose.evidence.whiten import Projector, Whitener
from twin.diagnose.faults.acted import slots_with
from twin.diagnose.faults.elements import Elements
from twin.diagnose.faults.fault import Unit
from twin.diagnose.faults.table import FAULTS, fault_of
from twin.diagnose.model.study import Study
from twin.progress import Progress, silent

LEFT = 0.15  # of a conductance
NEAR = (0.3, 1.8)  # of the response at LEFT, within which it may be one


@dataclass(frozen=True)
class Lost:
    """n contacts and joints."""

    names: tuple[tuple[str, str], ...]  # kind and place
    responses: np.ndarray  # (m, n) white, of LEFT

    def response(self, h: Hypothesis) -> np.ndarray | None:
        """(m,) of a contact or joint; None of anything else."""
        name = h.batch.kind, fault_of(h).bare(h.name)
        return self.responses[:, self.names.index(name)] if name in self.names else None


def lost_conductances(study: Study, elements: Elements, whiten: Whitener, progress: Progress = silent) -> Lost:
    """Of every contact and joint of the machine, from the start of every run on."""
    names = tuple(dict.fromkeys(key for key in elements.block_of if key[0] in ("joint", "contact")))
    if not names:
        return Lost((), np.zeros((study.rows[-1].stop, 0)))
    with progress("contacts that are nearly gone", len(names)) as advance:
        outputs = each(_without, (study, elements), names, lambda _: advance(""))
    nominal = study.all_outputs(np.zeros(len(study.probed.parameters)))
    return Lost(names, whiten(np.stack(outputs, axis=1) - nominal[:, None]))


def _without(shared: tuple[Study, Elements], name: tuple[str, str]) -> np.ndarray:
    study, elements = shared
    always = tuple(np.ones(p.run.drive.n_steps) for p in study.runs)
    kind, place = name
    unit, x = Unit(FAULTS["joint", kind], place, -1, always), np.zeros(len(study.probed.parameters))
    parts = [study.outputs(k, x, slots_with(study, elements, [unit], k), (LEFT - 1.0,)) for k in study.fitted]
    return np.concatenate(parts)


def lost_candidates(lost: Lost, batches: Sequence[Batch], projector: Projector, white: np.ndarray) -> list[Hypothesis]:
    """Contacts whose loss would explain white residuals (m,): scores at LEFT, always."""
    if not lost.names:
        return []
    P = projector(lost.responses)
    information = np.maximum((lost.responses * P).sum(axis=0), 1e-30)
    found = []
    for (kind, bare), share, own in zip(lost.names, P.T @ white / information, information, strict=True):
        place = FAULTS["joint", kind].prefix + bare
        batch = next((b for b in batches if b.kind == kind and place in b.places), None)
        if batch is not None and NEAR[0] < share < NEAR[1]:
            always = next(h for h in batch.histories if h.name == "always")
            size = share * (LEFT - 1.0)
            i = batch.places.index(place)
            found.append(Hypothesis(batch, i, always, float(share**2 * own), (size,)))
    return found

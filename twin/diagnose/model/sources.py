"""The places that the described sources heat."""

from __future__ import annotations

import numpy as np

from twin.diagnose.model.study import Study

NEARLY_NONE = 1e-6  # cosine of two heats in a reduced basis that have no place in common: rounding


def own_place(study: Study, source: int) -> int | None:
    """The place that a source of a surface heats; None of a node beside the parts, which is none."""
    (body,) = study.probed.base.bodies
    B = body.B[:, body.sources.index(source)]
    alike = [abs(B @ b) / np.linalg.norm(b) for b in study.probed.B]
    best = int(np.argmax(alike))
    return best if alike[best] > NEARLY_NONE * np.linalg.norm(B) else None


def heated_places(study: Study) -> list[int]:
    """The faces that sources enter at, but contacts; none of lumped machines, whose nodes have no faces."""
    sources, places = study.probed.base.load_model.sources, study.probed.places
    own = {own_place(study, j) for j, source in enumerate(sources) if not source.contact}
    return sorted(p for p in own if p is not None and places[p].surfaces)

"""The places that the described sources heat."""

from __future__ import annotations

import numpy as np

from twin.diagnose.model.study import Study


def own_place(study: Study, source: int) -> int:
    """The place that a source of a surface heats."""
    (body,) = study.probed.base.bodies
    B = body.B[:, body.sources.index(source)]
    return int(np.argmax([abs(B @ b) / np.linalg.norm(b) for b in study.probed.B]))


def heated_places(study: Study) -> list[int]:
    """The faces that sources enter at, but contacts; none of lumped machines, whose nodes have no faces."""
    sources, places = study.probed.base.load_model.sources, study.probed.places
    own = {own_place(study, j) for j, source in enumerate(sources) if not source.contact}
    return sorted(p for p in own if places[p].surfaces)

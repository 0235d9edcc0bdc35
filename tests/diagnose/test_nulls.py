"""Synthetic measurements without a cause: how coefficients differ among the faces of a film."""

from __future__ import annotations

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.diagnose.evidence.nulls import shared_by_film
from twin.diagnose.model.probed_loads import convection


@pytest.mark.parametrize("seed", range(5))
def test_no_face_exchanges_less_than_nothing_at_rest(seed):
    """A film that motion makes many times as large has a fifth at least of what it has at any moment, everywhere."""
    study = small_case.study()
    places = study.probed.places
    local = np.clip(np.random.default_rng(seed).standard_normal(len(places)), -0.8, 0.8)
    mean, apart = shared_by_film(study, local)
    films = [f.name for f in study.probed.base.load_model.films]
    of = np.array([films.index(p.film) if p.film else -1 for p in places])
    for k in study.fitted:
        h = convection(study.runs[k].run.drive, len(films))
        least, usual = h.min(axis=0), h.mean(axis=0)
        assert (least <= usual).all()
        assert (least < 0.9 * usual).any()  # of a film that hears a speed
        for now in (least, usual):
            total = now[of] * (1.0 + mean[of]) + apart * least[of]
            assert (total[of >= 0] >= 0.19 * now[of][of >= 0]).all()
        at_rest = least[of] * (1.0 + mean[of]) + apart * least[of]
        np.testing.assert_allclose(at_rest[of >= 0], (least[of] * (1.0 + local))[of >= 0])


def test_a_film_of_one_face_differs_in_proportion():
    study = small_case.study()
    places = study.probed.places
    local = np.linspace(-0.5, 0.5, len(places))
    mean, apart = shared_by_film(study, local)
    films = [f.name for f in study.probed.base.load_model.films]
    alone = [f for f, name in enumerate(films) if sum(p.film == name for p in places) == 1]
    assert alone
    for f in alone:
        (own,) = (i for i, p in enumerate(places) if p.film == films[f])
        assert mean[f] == pytest.approx(local[own])
        assert apart[own] == pytest.approx(0.0)

"""What calibration absorbs is said too: a declared number that cannot hold."""

from __future__ import annotations

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.diagnose.catalogue import FAMILIES
from twin.diagnose.search import PULLED, search
from twin.diagnose.verdict import verdict_of


@pytest.mark.parametrize(("pull", "wanted"), [(0.8, "nothing"), (4.5, "out_of_tolerance")])
def test_a_source_beyond_its_tolerance_is_out_of_it(pull, wanted):
    yard = small_case.yardstick()
    study = yard.study
    source = next(i for i, p in enumerate(study.bench.parameters) if p.kind == "source")
    x = np.zeros(len(study.bench.parameters))
    x[source] = pull
    y = np.concatenate([study.outputs(k, x) for k in study.fitted])
    noise = yard.whiten.colour(np.random.default_rng(1).standard_normal(len(y)))
    verdict, causes = verdict_of(search(yard, np.where(np.isfinite(noise), y + noise, np.nan)), FAMILIES)
    assert verdict == wanted
    if wanted == "nothing":
        assert causes == ()
        return
    parameter = study.bench.parameters[source]
    (cause,) = causes
    assert (cause.family, cause.place, cause.history) == ("loss_law", parameter.path.removesuffix(".gain"), "always")
    assert cause.statistic > PULLED**2
    assert 1.0 < cause.ci95[0] < np.exp(parameter.sigma * pull) < cause.ci95[1]  # freed of its tolerance

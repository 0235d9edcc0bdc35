"""A sealed run that holds what no other run has is told, and one that is as well predicted as others is not."""

from __future__ import annotations

import numpy as np
import pytest

from tests.diagnose.made_up import series
from twin.diagnose.search.policy import POLICY
from twin.diagnose.search.sealed_alone import sealed_alone


@pytest.mark.parametrize(("more", "told"), [(0.0, False), (1.0, True)])
def test_what_a_sealed_run_alone_holds_is_told_with_its_channel(more, told):
    rng = np.random.default_rng(1)
    runs, sealed = [series(f"run_{k}", rng) for k in (1, 2)], series("wednesday", rng, sealed=True)
    sealed.extended[:, 3] += more  # K, at a noise of 0.05 K
    sealed.extended[:5, 3] = np.nan  # and what is not measured says nothing
    notes = sealed_alone([*runs, sealed], POLICY)
    assert bool(notes) is told
    if told:
        assert notes[0].startswith("wednesday: effect absent from the other runs: residual of sensor_3 ")


def test_a_channel_that_only_the_sealed_run_has_says_nothing():
    rng = np.random.default_rng(1)
    run, sealed = series("run_1", rng, sensors=2), series("wednesday", rng, sensors=3, sealed=True)
    assert sealed_alone([run, sealed], POLICY) == []

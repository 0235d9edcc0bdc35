"""Further windows are taken where they explain enough, and not where they only mend a strong cause's misfit."""

from __future__ import annotations

import numpy as np
import pytest

from twin.diagnose.batch import Batch, History, Hypothesis
from twin.diagnose.diagnosis import Window
from twin.diagnose.growth import GROWTH, SHARE, grown

BLOCKS = 6


def hypothesis(g: np.ndarray) -> Hypothesis:
    """The first of six hours, with unit information in each."""
    windows = [History(f"hour {b}", np.eye(BLOCKS)[[b]], windows=(Window("a", 3600.0 * b, 3600.0 * (b + 1)),))
               for b in range(BLOCKS)]  # fmt: skip
    batch = Batch("heat_source", "heat", "W", ("p",), np.arange(BLOCKS)[None], tuple(windows), 1)
    return Hypothesis(batch, 0, windows[0], float(g[0] ** 2), (float(g[0]),), 1.0)


@pytest.mark.parametrize(("size", "more", "wanted"), [(10.0, 10.0, 2), (10.0, 0.5, 1), (4.0, 4.0, 2), (3.0, 3.0, 1)])
def test_a_window_must_bring_its_price(size, more, wanted):
    g = np.zeros(BLOCKS)
    g[0], g[3] = size, more
    found = grown(hypothesis(g), g, np.eye(BLOCKS))
    assert len(found.when.windows) == wanted
    if wanted == 2:  # one size for both: (g1 + g2)^2 / 2
        assert found.statistic == pytest.approx((size + more) ** 2 / 2.0, rel=1e-6)
        assert found.statistic > size**2 + GROWTH


def test_the_price_rises_with_what_is_explained_already():
    """A second hour of 1500 + 0.02 x 1500 is worth more than GROWTH, and less than its share."""
    g = np.zeros(BLOCKS)
    g[0] = 1500.0**0.5
    g[3] = (2.0 * 1.02) ** 0.5 * g[0] - g[0]
    brings = (g[0] + g[3]) ** 2 / 2.0 - g[0] ** 2
    assert GROWTH < brings < SHARE * g[0] ** 2
    assert len(grown(hypothesis(g), g, np.eye(BLOCKS)).when.windows) == 1

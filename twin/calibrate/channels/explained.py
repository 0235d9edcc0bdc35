"""What all other channels refute and the model explains: a light bearing rises by 10 K within minutes of its start.

The channels know nothing of the loads, the model does. A leap is no fault where what the model computes rises there,
too: an hour before and after it are compared, so that an error that lasts counts for nothing, and what was measured
must be nearer to what is computed than the same less the fault is. Two channels are not swapped where that one of them
is the warmer one which is so in the model. A model that misses by some kelvin tells both.
"""

from __future__ import annotations

from twin.run.replay import replay  # isort: skip  first: it prepares JAX before NumPy is loaded

from collections.abc import Sequence
from functools import cache

import numpy as np

from twin.calibrate.channels.finding import Finding
from twin.calibrate.channels.judge import BESIDE, Judgement, judge
from twin.logs.run import Run
from twin.rom.artefact import Artefact
from twin.run.results import Result


def judge_beside(artefact: Artefact, runs: Sequence[Run]) -> Judgement:
    """What all temperature channels of runs say of each other (`judge`), without the leaps and exchanged names that the
    model explains with the values that the artefact has. A run is computed where one of these is found in it.

    Raises what `replay` raises, where it takes the model to tell.
    """
    model = artefact.model

    @cache
    def computed(run: int) -> Result:
        return replay(artefact, runs[run])

    def explained(f: Finding) -> bool:
        asked = f.what in ("leap", "swapped") and set(f.channels) <= set(model.sensors)
        return asked and _explained(f, runs[f.runs[0]], computed(f.runs[0]))

    return judge(runs, sensors=model.all_sensors, explained=explained)


def _explained(f: Finding, run: Run, computed: Result) -> bool:
    """Whether the model explains what a finding is about in the first of its runs."""
    table = run.temperatures
    if table is None:
        return False
    time, columns = table.time, [table.columns[c] for c in f.channels]
    of_model = [np.interp(time, computed.time, computed.temperature[:, computed.sensors.index(c)]) for c in f.channels]
    if f.what == "swapped":
        (a, b), (x, y) = columns, of_model
        return bool(np.nansum(((a - b) * (x - y))[time >= f.start]) > 0.0)
    beyond = columns[0] - of_model[0]
    near = np.isfinite(beyond) & (np.abs(time - f.start) <= BESIDE)
    before, after = beyond[near & (time < f.start)], beyond[near & (time >= f.start)]
    if not (len(before) and len(after)):
        return False
    leap = float(np.median(after) - np.median(before))
    return abs(leap) <= abs(leap - f.size)

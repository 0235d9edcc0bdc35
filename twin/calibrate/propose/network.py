"""A description of a machine that nobody described: nodes that follow what was logged, as found in the runs."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Sequence

from twin.calibrate.members.describe import with_members
from twin.calibrate.members.find import Found
from twin.logs.run import Run

_HEAD = """\
# Proposed by `twin new --from-log` from {runs}: a network without geometry. Each node follows a logged
# temperature, or the heat of a logged load, with one time constant, and moves the tool by its row in [tcp.expansion].
# All numbers come from the log; docs/members.md says how. What you know better, write in its place.

[machine]
name = {name}
reference_temperature = "20 degC"
"""


def description(name: str, found: Found, runs: Sequence[Run]) -> str:
    """machine.toml of a machine that consists of the members found, its logged temperatures as sensors."""
    from twin.machine.extend import appended

    names = ", ".join(run.folder.name for run in runs)
    text = _HEAD.format(runs=names if len(names) < 60 else f"{len(runs)} runs", name=json.dumps(name))
    text = with_members(text, found.members, found.selected.explained.scale, runs, "proposed")
    data = tomllib.loads(text)
    sensors = [  # inputs of the model, shown beside what is computed
        (f"sensors.{data['signals'][e['signal']]['column']}", {"environment": name})
        for name, e in data["environment"].items()
        if "signal" in e
    ]
    return appended(text, sensors, "the logged temperatures", "proposed") if sensors else text

"""A body that the description lacks: it follows a logged temperature or heat and moves the tool.

Looked for by `twin.diagnose.search.missing`, where nothing else explains what moves the tool; no batch of the search.
"""

from __future__ import annotations

from twin.diagnose.faults.context import Singly
from twin.diagnose.faults.fault import Family, Fault
from twin.diagnose.result.diagnosis import Cause

FAULTS: tuple[Fault, ...] = ()  # it needs no model of heat, and is found by the evidence of displacements alone


def written_elsewhere(cause: Cause) -> bool:
    """No edit of its own: its nodes are written with those of all drivers."""
    return False


FAMILY = Family(
    20, "missing_member", "Missing member, or another air",
    "A probe holder, cover, column or foundation follows an air, a measured temperature or a heat, and moves the tool.",
    "w + sum_k a_k (tau_k-lag of a logged column)", "displacements that no heat in the machine explains",
    "3 in ln evidence", "either", "every logged temperature, speed and power, with lags of 1 min to 5.3 h", "machine",
    Singly(FAULTS), what="missing member", kind_told=True, weighed=True,
    editable=written_elsewhere,
)  # fmt: skip

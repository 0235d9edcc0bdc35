"""The measurement of the TCP itself: its probe drifts, its frame is skewed, it heats the machine."""

from __future__ import annotations

from twin.diagnose.faults.context import Singly
from twin.diagnose.faults.fault import Family, Fault

FAULTS = (
    Fault(
        "measurement", "probe", "m/s", "tcp.", 0, 1e-6 / 43200, read=True, lasts=True, called="drift",
        largest=1e-4 / 43200.0,  # m/s: 100 um in half a day
    ),
    # a millimetre per metre
    Fault("measurement", "frame", "1", "tcp.", 0, 2e-6, 1e-3, read=True, lasts=True, called="frame"),
    Fault("measurement", "heated", "m", "tcp.", 0, 1e-6, 5e-5, read=True, lasts=True, called="heating"),
)  # fmt: skip

FAMILY = Family(
    17, "measurement", "TCP measurement at fault",
    "The probe drifts, the measuring frame is skewed, or measuring heats the machine.",
    "w + a t;  w + a position;  event input", "only in TCP rows; no sensor shares it", "1 um, 2 um/m", "either",
    "every TCP component: drift, every axis, growth within a measurement", "reading", Singly(FAULTS),
    what="TCP measurement at fault", kind_told=True,
)  # fmt: skip

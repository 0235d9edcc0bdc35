"""One fault of measured channels, as data: what a check tells, and what a diagnosis or a calibration may weigh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Kind = Literal["noise", "spike", "rail", "leap", "rezero", "stuck", "held", "splice", "offset", "offset_or_warm"]
MEANS: dict[Kind, str] = {  # kind: what happened, and what `size` is
    "noise": "leaps, and is noise from then on; how far its readings typically depart from their neighbours",
    "spike": "leaps away and comes back within three rows; how far",
    "rail": "leaps to a value that it does not leave, as an open circuit does; that value",
    "leap": "changes within one row by more than heat can; the change",
    "rezero": "leaps to zero: somebody set the probe to zero; the change",
    "stuck": "stands still while others go on; its value there",
    "held": "repeats a reading, as a logger does that has none; that value",
    "splice": "most channels leap in one row: rows of another time; the largest change of a temperature",
    "offset": "begins apart from the others, and the machine was cold; how much higher than their median",
    "offset_or_warm": "begins apart from the others, and it is not known whether the machine was cold; the same",
}


@dataclass(frozen=True)
class Fault:
    """Something wrong with one channel, or with several at once. Rows count from zero, the row under the header."""

    kind: Kind
    table: str  # "temperatures" or "tcp"
    channels: tuple[str, ...]  # columns of the table
    first_row: int  # at fault
    last_row: int  # at fault; of what lasts, the last of the table
    first_time: float  # s since the start of the run
    last_time: float  # s
    size: float  # SI, of the channel where it is largest; what it is says MEANS
    unit: str  # SI: "K" of changes, "degC" of values, "m"

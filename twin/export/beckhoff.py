"""Temperature compensation of TwinCAT CNC: ds = offset_0 + coefficient (s - s_0) per axis, as axis parameters.

P-AXIS-00271 lr_param.temp_comp: on; P-AXIS-00272 temp_comp_position_0 [0.1 um]; P-AXIS-00273 temp_comp_offset_0
[0.1 um]; P-AXIS-00274 temp_comp_coefficient [um/m]: whole numbers (SGN32), so the line is rounded.
Source: Beckhoff Information System, TwinCAT CNC, axis parameters P-AXIS-00271 to 00274, and axis compensation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from twin.atomic import atomic_path
from twin.errors import TwinError
from twin.export.axis_lines import AxisLine, fit_lines, line_offsets
from twin.export.axis_offsets import Left, at_poses, left
from twin.export.control_table import Source, commented, head, source_of, summary
from twin.export.options import ExportOptions
from twin.rom.artefact import Artefact

LENGTH, SLOPE = 1e-7, 1e-6  # m and 1 per count
LARGEST = 2**31 - 1  # SGN32
LOSES = "offsets of one axis that depend on the position of another, curves, and less than 0.1 um"


def export_beckhoff(artefact: Artefact, path: Path, options: ExportOptions) -> tuple[str, ...]:
    """The format `beckhoff`: `write_beckhoff` of the result that the options name."""
    return summary(path, write_beckhoff(path, source_of(artefact, options)))


def write_beckhoff(path: Path, source: Source) -> Left:
    """Write one block of parameters per axis; returns what they leave. Raises TwinError where a value does not fit."""
    lines = [_rounded(line) for line in fit_lines(at_poses(source.errors, source.jacobian))]
    for line in lines:
        if max(abs(_count(line.constant, LENGTH)), abs(_count(line.reference, LENGTH))) > LARGEST:
            what = f"axis '{line.name}' has a position or an offset that its parameter cannot hold (SGN32 of 0.1 um)"
            raise TwinError(what, str(path), "check the poses of the machine and the run")
    found = left(lambda position: line_offsets(lines, position), source.errors, source.jacobian)
    text = [*commented("#", ["TwinCAT CNC temperature compensation: one block per list of axis parameters",
                             *head(source, found, LOSES)]), *_blocks(lines), ""]  # fmt: skip
    with atomic_path(path) as temporary:
        temporary.write_text("\n".join(text), encoding="ascii")
    return found


def _count(value: float, unit: float) -> int:
    return round(value / unit)


def _rounded(line: AxisLine) -> AxisLine:
    return replace(
        line,
        constant=LENGTH * _count(line.constant, LENGTH),
        slope=SLOPE * _count(line.slope, SLOPE),
        reference=LENGTH * _count(line.reference, LENGTH),
    )


def _blocks(lines: Sequence[AxisLine]) -> list[str]:
    result = []
    for number, line in enumerate(lines, 1):
        result += [
            "#",
            f"# axis {line.name.upper()}; kopf.achs_nr is the number of its list on your control",
            f"kopf.achs_nr {number}",
            "lr_param.temp_comp 1",
            f"lr_param.temp_comp_position_0 {_count(line.reference, LENGTH)}",
            f"lr_param.temp_comp_offset_0 {_count(line.constant, LENGTH)}",
            f"lr_param.temp_comp_coefficient {_count(line.slope, SLOPE)}",
        ]
    return result

"""Temperature compensation of SINUMERIK: dK = K0 + tan_beta (P - P0) per axis, as a part program that sets it.

SD43900 $SA_TEMP_COMP_ABS_VALUE: K0 [mm]; SD43910 $SA_TEMP_COMP_SLOPE: tan beta; SD43920 $SA_TEMP_COMP_REF_POSITION:
P0 [mm]. MD32750 $MA_TEMP_COMP_TYPE = 3 activates both parts; MD32760 $MA_COMP_ADD_VELO_FACTOR limits the slope.
Source: SINUMERIK 840D sl, Function Manual Extended Functions, K3, 6FC5397-1BP40-3BA1, 03/2013, section 4.2.
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

STEEPEST = 0.01  # default of MD32760, which limits tan beta (SINUMERIK 808D, parameter manual, MD32760)
LOSES = "offsets of one axis that depend on the position of another, and curves"


def export_siemens(artefact: Artefact, path: Path, options: ExportOptions) -> tuple[str, ...]:
    """The format `siemens`: `write_siemens` of the result that the options name."""
    return summary(path, write_siemens(path, source_of(artefact, options)))


def write_siemens(path: Path, source: Source) -> Left:
    """Write the table; returns what it leaves. Raises TwinError for slopes that the control would limit."""
    lines = [_rounded(line) for line in fit_lines(at_poses(source.errors, source.jacobian))]
    for line in lines:
        if abs(line.slope) > STEEPEST:
            what = f"axis '{line.name}' needs a slope of {line.slope:.3g}, more than MD32760 lets through"
            raise TwinError(what, str(path), "check the run: no heat makes a machine longer by a hundredth")
    found = left(lambda position: line_offsets(lines, position), source.errors, source.jacobian)
    text = [
        *commented(";", ["SINUMERIK temperature compensation", *head(source, found, LOSES)]),
        *_data(lines),
        "M17",
        "",
    ]
    with atomic_path(path) as temporary:
        temporary.write_text("\n".join(text), encoding="ascii")
    return found


def _rounded(line: AxisLine) -> AxisLine:
    """As the file has it: 1 nm, and 1e-9, which is 1 nm on a metre."""
    return replace(
        line, constant=round(line.constant, 9), slope=round(line.slope, 9), reference=round(line.reference, 9)
    )


def _data(lines: Sequence[AxisLine]) -> list[str]:
    result = []
    for line in lines:
        axis = line.name.upper()
        result += [
            f"; MD32750 $MA_TEMP_COMP_TYPE[{axis}] = 3 is set when commissioning, and takes effect at power on",
            f"$SA_TEMP_COMP_ABS_VALUE[{axis}]={1e3 * line.constant:.6f}",
            f"$SA_TEMP_COMP_SLOPE[{axis}]={line.slope:.9f}",
            f"$SA_TEMP_COMP_REF_POSITION[{axis}]={1e3 * line.reference:.6f}",
        ]
    return result

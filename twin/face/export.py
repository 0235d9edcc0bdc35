"""An artefact in another tool's format."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING

from twin.errors import TwinError

if TYPE_CHECKING:
    from twin.export.options import ExportOptions
    from twin.face.model import Model

# Files of run folders and results: a log that was measured, a summary that says which files belong together.
OF_RUNS = ("loads.csv", "temperatures.csv", "tcp.csv", "summary.json", "correction.json")


def export(
    model: Model | str | Path, format: str, output: str | Path, options: ExportOptions | None = None
) -> tuple[str, ...]:
    """Write a model in a format of `twin.export.formats.FORMATS`; returns what there is to tell of it, a line each.

    Raises TwinError for an unknown format, options that it does not know, an output that is an input or cannot be
    written, and what the format itself refuses (docs/exports.md).
    """
    from twin.atomic import check_file, check_folder
    from twin.export.formats import FORMATS
    from twin.export.options import ExportOptions
    from twin.face.model import read
    from twin.nearest import did_you_mean

    if format not in FORMATS:
        raise TwinError(f"no format '{format}'", "--format", did_you_mean(format, FORMATS, "formats"))
    chosen, wanted = FORMATS[format], options or ExportOptions()
    for field in fields(ExportOptions):
        if field.name not in chosen.options and getattr(wanted, field.name) != field.default:
            known = ", ".join(f"--{name}" for name in chosen.options) or "none"
            raise TwinError(f"format '{format}' has no such option", f"--{field.name}", f"its options: {known}")
    target = Path(output)
    if chosen.folder:
        check_folder(target)
    else:
        check_file(target)
    if target.suffix in (".h5", ".toml", ".msh") or (target.name in OF_RUNS and target.exists()):
        raise TwinError("would replace an input", str(target), f"name a file with -o, for example out/x{chosen.suffix}")
    return chosen.write(read(model).artefact, target, wanted)

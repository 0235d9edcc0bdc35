"""A result as one JSON: every table with its dimensions, unit and values, and the coordinates that name them."""

from __future__ import annotations

import json
from pathlib import Path

from twin.atomic import atomic_path
from twin.export.options import ExportOptions
from twin.export.run_result import result_of
from twin.rom.artefact import Artefact


def export_json(artefact: Artefact, path: Path, options: ExportOptions) -> tuple[str, ...]:
    """The format `json`: numbers in 17 digits, so nothing is lost. Raises TwinError as `result_of`."""
    result = result_of(artefact, options)
    content = {
        "format": "twin result",
        "machine": result.machine,
        "artefact": result.artefact,
        "coordinates": {
            name: {"unit": unit, "values": values.tolist()} for name, (values, unit) in result.coordinates.items()
        },
        "tables": {
            name: {"dims": list(t.dims), "unit": t.unit, "long_name": t.long_name, "values": t.values.tolist()}
            for name, t in result.tables.items()
        },
    }
    with atomic_path(path) as temporary:
        temporary.write_text(json.dumps(content, allow_nan=False) + "\n", encoding="utf-8")
    return (f"{path}: {len(result.tables)} tables at {len(result.coordinates['time'][0])} times",)

"""A machine as C: FILE.c and FILE.h, and an example beside them that reads a loads.csv."""

from __future__ import annotations

import re
from contextlib import ExitStack
from pathlib import Path

from twin.atomic import atomic_path, telling
from twin.errors import TwinError
from twin.export.c.measure import measured
from twin.export.c.source import source_of
from twin.export.options import ExportOptions
from twin.rom.artefact import Artefact


def write_c(artefact: Artefact, path: Path, options: ExportOptions) -> tuple[str, ...]:
    """Write path, its header and its example; with a run in the options the error against `twin run` is measured.

    Raises TwinError where a name is no C file, where files cannot be written, and for a run without a C compiler.
    """
    if path.suffix != ".c":
        raise TwinError("is no name of a C file", str(path), "name it with -o, for example -o out/machine.c")
    single = options.precision == "single"
    note, told = "", []
    if options.run is not None:
        error = measured(artefact, options.run, single)
        note = f"\n   {error}"
        told.append(error)
    source = source_of(artefact, single, note)
    header, example = path.with_suffix(".h"), path.with_name(f"{path.stem}_example.c")
    own = {f'"{source.name}.h"': f'"{header.name}"', f"{source.name}_example.c": example.name,
           f"{source.name}.c -lm": f"{path.name} -lm"}  # fmt: skip
    with ExitStack() as stack:  # all are written before the first is renamed
        for target, text in ((header, source.header), (path, source.code), (example, source.example)):
            head, rest = text[:10_000], text[10_000:]  # the names of files stand at the top
            for name, file in own.items():
                head = re.sub(re.escape(name), file, head)
            with telling(target):
                stack.enter_context(atomic_path(target)).write_text(head + rest, encoding="utf-8")
    size = path.stat().st_size / 1e6
    return (f"{path}, {header.name}, {example.name}: {size:.1f} MB, {options.precision} precision, "
            f"public names begin with {source.name}_", *told)  # fmt: skip

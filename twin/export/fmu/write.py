"""A machine as a co-simulation FMU: description, sources, and a binary for each platform with a compiler."""

from __future__ import annotations

import tempfile
import zipfile
from concurrent.futures import ThreadPoolExecutor
from importlib import resources
from pathlib import Path
from uuid import NAMESPACE_URL, uuid5

from twin.atomic import atomic_path
from twin.export.c.source import Source, source_of
from twin.export.c.text import named
from twin.export.compiler import compiled, put_weights, targets
from twin.export.fmu.description import build_description3, description2, description3
from twin.export.fmu.variables import Variable, variables_of
from twin.export.options import ExportOptions
from twin.rom.artefact import Artefact

_STORED_AT = (1980, 1, 1, 0, 0, 0)  # equal input gives equal bytes


def write_fmu2(artefact: Artefact, path: Path, options: ExportOptions) -> tuple[str, ...]:
    """FMI 2.0. Raises TwinError where there is no compiler, and where the file cannot be written."""
    return _write(artefact, path, options, "2")


def write_fmu3(artefact: Artefact, path: Path, options: ExportOptions) -> tuple[str, ...]:
    """FMI 3.0. Raises TwinError where there is no compiler, and where the file cannot be written."""
    return _write(artefact, path, options, "3")


def _write(artefact: Artefact, path: Path, options: ExportOptions, version: str) -> tuple[str, ...]:
    from twin import __version__

    platforms = targets()
    source = source_of(artefact)
    step = float(artefact.certificate.get("step", 60.0))
    variables = variables_of(artefact, step, options.poses, time=version == "3")
    token = "{" + str(uuid5(NAMESPACE_URL, f"{artefact.digest}/{version}/{options.poses}")) + "}"
    about = {"description": f"thermo-elastic twin of {artefact.model.name}", "generationTool": f"twin {__version__}",
             "version": artefact.digest[:16]}  # fmt: skip
    describe = description2 if version == "2" else description3
    files = {"modelDescription.xml": describe(source.name, token, variables, about)}
    inputs = variables[: len(artefact.model.load_model.signals)]
    written = sources(source, inputs, token, artefact.digest, version)
    files |= {f"sources/{name}": text.encode() for name, text in written.items()}
    if version == "3":
        files["sources/buildDescription.xml"] = build_description3(source.name)
    with tempfile.TemporaryDirectory() as scratch, atomic_path(path) as target:
        folder = Path(scratch)
        for name, content in files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(content)
        built = [folder / "binaries" / p.folders[version] / f"{source.name}{p.suffix}" for p in platforms]
        main = folder / "sources" / f"fmi{version}.c"
        with ThreadPoolExecutor() as pool:
            weights, n = put_weights(folder, source.weights), len(built)
            list(pool.map(compiled, platforms, [main] * n, built, [source.name] * n, [weights] * n))
        names = [*files, *(str(f.relative_to(folder)) for f in built)]
        with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
            for name in names:
                entry = zipfile.ZipInfo(name, _STORED_AT)
                entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
                archive.writestr(entry, (folder / name).read_bytes(), compresslevel=1)
    listed = [v for v in variables if v.listed]
    counts = {kind: sum(v.causality == kind for v in listed) for kind in ("input", "output", "parameter")}
    told = ", ".join(f"{n} {kind}s" for kind, n in counts.items())
    binaries = ", ".join(p.folders[version] for p in platforms)
    return (f"{path}: FMI {version}.0, {path.stat().st_size / 1e6:.1f} MB; {told}; binaries {binaries}, and sources",)


def sources(source: Source, signals: tuple[Variable, ...], token: str, digest: str, version: str) -> dict[str, str]:
    """Files of sources/: one that is compiled, and the machine's two, which it includes."""
    core = resources.files("twin.export.fmu")
    starts = ", ".join(repr(float(v.start or 0.0)) for v in signals)
    head = (
        f'#include "{source.name}.c"\n\n#define TOKEN "{token}"\n#define DIGEST "{digest[:16]}"\n'
        f"static const double signal_start[] = {{{starts or '0'}}};\n\n"
    )
    parts = ("slave.c", f"fmi{version}.c", "shared.c")
    text = head + named("".join((core / name).read_text(encoding="utf-8") for name in parts),
                        source.name)  # fmt: skip
    return {f"fmi{version}.c": text, f"{source.name}.c": source.code, f"{source.name}.h": source.header}

"""An engine opened from an artefact: what was compiled before is found again."""

from __future__ import annotations

import os
import sys
import zlib
from pathlib import Path

from twin import __version__
from twin.errors import ArtefactError, TwinError
from twin.live.engine import Engine
from twin.live.facts import FACTS, LIBRARY, read_facts


def _files(package: Path) -> list[Path]:
    """The code that writes C."""
    return [*sorted((package / "export" / "c").glob("*.*")), *(package / "live" / n for n in ("live.c", "prepare.py"))]


def open_engine(artefact: Path, kind: str, folder: Path) -> Engine:
    """The artefact's machine, stepped by "c" or "jax"; compiled code is kept in `folder`, one artefact's at a time.

    artefact: A.h5, or the folder of a machine compiled elsewhere (`python -m twin.live.prepare`), for computers without
    JAX or a compiler. Raises ArtefactError for what is neither, TwinError without a compiler.
    """
    if artefact.is_dir():
        return _compiled_elsewhere(artefact, kind)
    if kind == "jax":
        from twin.live.engine_jax import JaxEngine

        return JaxEngine(artefact)
    from twin.live.engine_c import CEngine

    own = folder / _key(artefact)
    if not (own / LIBRARY).is_file():
        import shutil

        for older in folder.glob("*"):
            shutil.rmtree(older, ignore_errors=True)
        _prepare(artefact, own)
    return CEngine(read_facts(own / FACTS), own / LIBRARY)


def _compiled_elsewhere(machine: Path, kind: str) -> Engine:
    from twin.live.engine_c import CEngine

    if not (machine / LIBRARY).is_file():
        remedy = "give A.h5, or the folder that `python -m twin.live.prepare A.h5 FOLDER` has made"
        raise ArtefactError("a folder without a compiled machine", str(machine), remedy)
    if kind != "c":
        raise TwinError("a compiled machine runs in C alone", "--engine", "give A.h5 for --engine jax")
    return CEngine(read_facts(machine / FACTS), machine / LIBRARY)


def _key(artefact: Path) -> str:
    """Of what the compiled code was made from, by size and time as `make` goes: a hash takes a tenth of a start."""
    package = Path(__file__).parents[1]
    try:
        told = [(path.stat().st_size, path.stat().st_mtime_ns) for path in (artefact, *_files(package))]
    except OSError as e:
        raise ArtefactError(f"cannot read: {e.strerror or e}", str(artefact), "make it with `twin build`") from e
    text = repr((__version__, os.uname().machine, told)).encode()
    return f"{zlib.crc32(text):08x}{zlib.adler32(text):08x}"


def _prepare(artefact: Path, folder: Path) -> None:
    """In a process of its own: writing C needs JAX, which this one is not to load."""
    import subprocess

    print("compiling the machine, once", file=sys.stderr, flush=True)
    command = [sys.executable, "-m", "twin.live.prepare", str(artefact), str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode < 0:
        raise TwinError("compiling was interrupted", "--engine", "start again")
    if done.returncode:
        lines = done.stderr.strip().splitlines() or ["no message"]
        what = lines[0] if done.returncode in (1, 2) and "Traceback" not in lines[0] else lines[-1]
        other = "try --engine jax"
        if "ModuleNotFoundError" in lines[-1]:
            other = "compile it where JAX is, `python -m twin.live.prepare A.h5 FOLDER`, and give FOLDER here"
        remedy = next((line.partition("remedy: ")[2] for line in lines if "remedy: " in line), other)
        raise TwinError(f"no C engine: {what}", "--engine", remedy)

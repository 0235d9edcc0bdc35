"""An engine opened from an artefact: what was compiled before is found again."""

from __future__ import annotations

import hashlib
import platform
import shutil
import subprocess
import sys
from importlib import resources
from pathlib import Path

from twin import __version__
from twin.errors import ArtefactError, TwinError
from twin.live.engine import Engine
from twin.live.facts import read_facts

_CODE = ("export/c/algebra.c", "export/c/drive.c", "export/c/step.c", "export/c/tcp.c", "export/c/runtime.h",
         "live/live.c", "live/facts.py", "live/prepare.py")  # fmt: skip


def open_engine(artefact: Path, kind: str, folder: Path) -> Engine:
    """The artefact's machine, stepped by "c" or "jax"; compiled code is kept in `folder`, one artefact's at a time.

    Raises ArtefactError for files that are no artefact, TwinError without a compiler.
    """
    if kind == "jax":
        from twin.live.engine_jax import JaxEngine

        return JaxEngine(artefact)
    from twin.live.engine_c import CEngine

    own = folder / _key(artefact)
    if not (own / "machine.so").is_file():
        for older in folder.glob("*"):
            shutil.rmtree(older, ignore_errors=True)
        _prepare(artefact, own)
    return CEngine(read_facts(own / "facts.json"), own / "machine.so")


def _key(artefact: Path) -> str:
    """Of what the compiled code was made from."""
    digest = hashlib.sha256(f"{__version__} {platform.machine()}".encode())
    for name in _CODE:
        digest.update((resources.files("twin") / name).read_bytes())
    try:
        with artefact.open("rb") as f:
            while piece := f.read(1 << 20):
                digest.update(piece)
    except OSError as e:
        raise ArtefactError(f"cannot read: {e.strerror or e}", str(artefact), "make it with `twin build`") from e
    return digest.hexdigest()[:24]


def _prepare(artefact: Path, folder: Path) -> None:
    """In a process of its own: writing C needs JAX, which this one is not to load."""
    command = [sys.executable, "-m", "twin.live.prepare", str(artefact), str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        lines = done.stderr.strip().splitlines() or ["no message"]
        what = lines[0] if done.returncode in (1, 2) and "Traceback" not in lines[0] else lines[-1]
        remedy = next((line.partition("remedy: ")[2] for line in lines if "remedy: " in line), "try --engine jax")
        raise TwinError(f"no C engine: {what}", "--engine", remedy)

"""C compilers that are there: for this machine, and for Windows."""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
import sys
from dataclasses import dataclass
from hashlib import sha256
from importlib.util import find_spec
from pathlib import Path

from twin.errors import TwinError

_FLAGS = ("-std=c99", "-O3", "-Wall", "-Wextra", "-pedantic", "-shared", "-fvisibility=hidden")
_LONGEST = 600  # s that a compiler may take


@dataclass(frozen=True)
class Target:
    """A platform and a compiler for it."""

    folders: dict[str, str]  # FMI version -> folder in binaries/
    suffix: str
    command: tuple[str, ...]


def targets() -> tuple[Target, ...]:
    """This machine's platform, and Windows where a cross compiler is there (mingw-w64, or ziglang from PyPI).

    Raises TwinError where there is no C compiler at all.
    """
    own = own_compiler()
    found = []
    if own and sys.platform == "linux" and platform.machine() == "x86_64":
        folders = {"2": "linux64", "3": "x86_64-linux"}
        found.append(Target(folders, ".so", (own, *_FLAGS, "-fPIC")))
    cross = _cross()
    if cross:
        found.append(Target({"2": "win64", "3": "x86_64-windows"}, ".dll", (*cross, *_FLAGS)))
    if not found:
        what = "no C compiler for any platform: an FMU without a binary runs nowhere"
        raise TwinError(what, "export", "install gcc, or `pip install ziglang`, or name a compiler in CC")
    return tuple(found)


def own_compiler() -> str | None:
    """The C compiler of this machine: what CC names, else gcc, clang or cc."""
    return next((c for c in (os.environ.get("CC"), "gcc", "clang", "cc") if c and shutil.which(c)), None)


def _cross() -> tuple[str, ...]:
    if shutil.which("x86_64-w64-mingw32-gcc"):
        return ("x86_64-w64-mingw32-gcc", "-static-libgcc")
    if find_spec("ziglang"):
        return (sys.executable, "-m", "ziglang", "cc", "-target", "x86_64-windows-gnu")
    return ()


def compiled(target: Target, source: Path, output: Path, name: str, weights: Path) -> None:
    """Compile a machine of this name to a shared library; weights: a file with the numbers of its tables as bytes.

    Raises TwinError with the compiler's words where it fails.
    """
    output.parent.mkdir(parents=True, exist_ok=True)
    command = [*target.command, taking(name, weights), "-o", str(output.resolve()), str(source.resolve())]
    command += [] if target.suffix == ".dll" else ["-lm"]
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=_LONGEST, check=False, cwd=weights.parent
        )
    except (OSError, subprocess.TimeoutExpired) as e:
        raise TwinError(f"the compiler {target.command[0]} failed: {e}", "export", "name another in CC") from e
    if done.returncode:
        last = done.stderr.strip().splitlines()[-1:] or ["no message"]
        raise TwinError(f"the compiler {target.command[0]} failed: {last[0]}", "export", "name another one in CC")


def taking(name: str, weights: Path) -> str:
    """What makes a compiler, called in the folder of this file, take a machine's weights from it.

    They are read as text otherwise, which takes compilers most of their time.
    """
    return f'-D{name.upper()}_WEIGHTS="{weights.name}"'


def put_weights(folder: Path, weights: bytes) -> Path:
    """A file of them, named after its content: compilers that cache do not know that they read it."""
    path = folder / f"weights-{sha256(weights).hexdigest()[:32]}.bin"
    path.write_bytes(weights)
    return path

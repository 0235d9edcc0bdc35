"""Installations from `make wheelhouse` without an index: how large they are, and whether a replay runs in them.

Needs a package index to make the wheels.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks.live import RUN, artefact

KINDS = {"all": ("twin[live,mqtt]",), "C alone": ("--no-deps", "twin", "click")}


def megabytes(path: Path) -> float:
    return sum(p.lstat().st_size for p in (path, *path.rglob("*")) if p.is_file()) / 1e6


def replayed(site: Path, machine: Path, engine: str, folder: Path) -> int:
    """Steps of a replay of experiment A with what is installed in `site`. Raises CalledProcessError."""
    state = f"state-{site.name}-{engine}"
    command = [
        sys.executable, "-S", "-m", "twin.cli.main", "live", str(machine.absolute()), "--source",
        f"replay:{RUN.absolute()}", "--speed", "0", "--out", "file:now.json", "--state", state, "--engine", engine,
    ]  # fmt: skip
    own = {**os.environ, "PYTHONPATH": str(site)}
    done = subprocess.run(command, cwd=folder, env=own, check=True, capture_output=True, text=True)
    return int(done.stdout.partition(": ")[2].partition(" steps")[0])


def main() -> None:
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        wheels, mill = folder / "wheels", folder / "mill"
        make = ["make", "-o", f"{sys.prefix}/.ready", f"VENV={sys.prefix}", f"WHEELS={wheels}", "wheelhouse"]
        subprocess.run(make, check=True, capture_output=True)
        print(f"   {len(list(wheels.iterdir()))} wheels, {megabytes(wheels):.0f} MB")
        subprocess.run([sys.executable, "-m", "twin.live.prepare", str(artefact()), str(mill)], check=True)
        print(f"   five_axis compiled: {megabytes(mill):.1f} MB; artefact {megabytes(artefact()):.1f} MB")
        for kind, what in KINDS.items():
            site = folder / kind.replace(" ", "-")
            pip = [sys.executable, "-m", "pip", "install", "-q", "--no-index", "--find-links", str(wheels)]
            subprocess.run([*pip, "--target", str(site), *what], check=True, stderr=subprocess.DEVNULL)
            engines = {"c": mill} if kind == "C alone" else {"c": mill, "jax": artefact()}
            ran = ", ".join(f"{replayed(site, m, e, folder)} steps by --engine {e}" for e, m in engines.items())
            print(f"   {kind}: {megabytes(site):.0f} MB installed; experiment A replayed, {ran}")

"""Every shipped machine from nothing: check, build, verify and run through the command line, and its certificate."""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

MODELS = Path(__file__).parents[1] / "models"


def twin(arguments: list[str], cache: Path) -> float:
    """Seconds that a command took; raises with its output where it failed."""
    began = time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-m", "twin.cli.main", *arguments],
        env=os.environ | {"TWIN_CACHE": str(cache)},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise RuntimeError(f"twin {' '.join(arguments)}: {done.returncode}\n{done.stdout}{done.stderr}")
    return time.perf_counter() - began


def processor_time() -> float:
    """Seconds that all commands so far have used, helpers included: other work on the machine leaves it as it is."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main() -> None:
    for path in sorted([*MODELS.glob("*/machine.toml"), *MODELS.glob("*/nodes.toml")]):
        with tempfile.TemporaryDirectory() as scratch:
            folder = Path(scratch)
            artefact = folder / "machine.h5"
            began = processor_time()
            check = twin(["check", str(path)], folder)
            build = twin(["build", str(path), "-o", str(artefact)], folder)
            verify = twin(["verify", str(artefact)], folder)
            used = processor_time() - began
            certificate = _certificate(artefact)
            run = sorted(p.parent for p in path.parent.glob("runs/*/run.toml"))[0]
            replay = twin(["run", str(artefact), str(run), "-o", str(folder / "result")], folder)
            told = json.loads((folder / "result" / "summary.json").read_text(encoding="utf-8"))
        print(
            f"   {path.parent.name}/{path.name}: check {check:.0f} s, build {build:.0f} s, verify {verify:.0f} s "
            f"(together {check + build + verify:.0f} s, {used:.0f} s of processor time); {certificate}; "
            f"run {run.name} {replay:.1f} s, heat balance {told['heat']['max_balance_error']:.1e}",
            flush=True,
        )


def _certificate(artefact: Path) -> str:
    from twin.rom.artefact import read_artefact

    c = read_artefact(artefact).certificate
    return (
        f"{c['max_temperature_error_in_case']:.4f} K, {1e6 * c['max_displacement_error_in_case']:.3f} um in the case, "
        f"worst output {100 * c['worst_relative']:.2f} %"
    )

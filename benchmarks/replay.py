"""`twin run` as a whole process: the first result, and 12 h of experiment A after that."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.five_axis import FOLDER
from twin.build.product import build_artefact
from twin.progress import bar

RUN = FOLDER / "runs" / "experiment_a"


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        artefact = folder / "five_axis.h5"
        build_artefact(FOLDER / "machine.toml", artefact, progress=bar)
        minute = folder / "minute"
        minute.mkdir()
        shutil.copy(RUN / "run.toml", minute)
        rows = (RUN / "loads.csv").read_text(encoding="utf-8").splitlines()
        (minute / "loads.csv").write_text("\n".join(rows[:8]) + "\n", encoding="utf-8")
        for attempt in ("nothing compiled before", "started before"):
            cache = folder / attempt  # of compiled functions; both runs of the second attempt find it filled
            if attempt == "started before":
                timed(artefact, RUN, folder / "out", cache)
            first = timed(artefact, minute, folder / "out", cache)
            whole = timed(artefact, RUN, folder / "out", cache)
            print(f"   {attempt}: first result {first:.1f} s after the command; 12 h in {whole:.1f} s, "
                  f"{whole - first:.1f} s after start-up")  # fmt: skip


def timed(artefact: Path, run: Path, out: Path, cache: Path) -> float:
    command = [sys.executable, "-m", "twin.cli.main", "run", str(artefact), str(run), "-o", str(out)]
    began = time.perf_counter()
    subprocess.run(command, check=True, capture_output=True, env=os.environ | {"TWIN_CACHE": str(cache)})
    return time.perf_counter() - began

"""Build and verify the shipped machine from nothing: time per stage and the certificate."""

from __future__ import annotations

import os
import tempfile
import time
from pathlib import Path

from benchmarks.five_axis import FOLDER
from twin.build.product import build_artefact, verify_artefact
from twin.face.certificate import Certificate
from twin.progress import bar


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        kept = os.environ.get("TWIN_CACHE")
        os.environ["TWIN_CACHE"] = f"{name}/cache"
        artefact = Path(name) / "five_axis.h5"
        try:
            began = time.perf_counter()
            build_artefact(FOLDER / "machine.toml", artefact, progress=bar)
            built = time.perf_counter()
            result = verify_artefact(artefact, progress=bar)
            print(f"   build {built - began:.0f} s, verify {time.perf_counter() - built:.0f} s")
        finally:
            os.environ.pop("TWIN_CACHE")
            if kept is not None:
                os.environ["TWIN_CACHE"] = kept
    print("\n".join("   " + line for line in Certificate(result.to_json()).lines()))

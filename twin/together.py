"""The files of a result belong together: a reader waits while another process replaces them."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from contextlib import contextmanager
from hashlib import file_digest
from pathlib import Path
from typing import Any, BinaryIO

from twin.errors import TwinError
from twin.ordinary import ordinary

_WAIT = 5.0  # s; replacing takes milliseconds, all files being written before the first is renamed
_LOOK = 0.02  # s between two looks


@contextmanager
def open_result(path: Path, wait: float = _WAIT) -> Iterator[tuple[BinaryIO, dict[str, Any]]]:
    """result.h5 of `path`, a folder of `twin run -o` or the file itself, open, and the summary.json that names it.

    What is open stays what it is, whatever is renamed over it. Where no summary.json says which file it is of (one
    moved elsewhere, results of older versions) the file is taken as it is, with what summary.json says: nothing where
    it is missing.
    Raises TwinError where the two are still of two results after `wait` [s], OSError where there is no file.
    """
    path = Path(path)
    path = path / "result.h5" if path.is_dir() else path
    until = time.monotonic() + wait
    while True:
        with ordinary(path).open("rb") as file:
            told = _summary(path.parent)
            named = told.get("files")
            named = named.get(path.name) if isinstance(named, dict) else None
            if named is None or file_digest(file, "sha256").hexdigest() == named:
                file.seek(0)
                yield file, told
                return
        if time.monotonic() > until:
            remedy = "run the artefact again, with `twin run -o`"
            raise TwinError("not the result that summary.json beside it is of", str(path), remedy)
        time.sleep(_LOOK)


def _summary(folder: Path) -> dict[str, Any]:
    try:
        told = json.loads(ordinary(folder / "summary.json").read_bytes())
    except (OSError, ValueError):
        return {}
    return told if isinstance(told, dict) else {}

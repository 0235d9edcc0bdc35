"""The files of a result belong together: a reader waits while another process replaces them."""

from __future__ import annotations

import json
import time
from hashlib import sha256
from pathlib import Path

from twin.errors import TwinError

_WAIT = 5.0  # s; replacing takes milliseconds, all files being written before the first is renamed
_LOOK = 0.02  # s between two looks


def result_h5(path: Path, wait: float = _WAIT) -> Path:
    """The result.h5 of `path`, a folder of `twin run -o` or the file itself, once summary.json names it.

    Where no summary.json says which (a file moved elsewhere, results of older versions) it is taken as it is.
    Raises TwinError where the two are still of two results after `wait` [s].
    """
    path = Path(path)
    path = path / "result.h5" if path.is_dir() else path
    until = time.monotonic() + wait
    while not _agrees(path):
        if time.monotonic() > until:
            remedy = "run the artefact again, with `twin run -o`"
            raise TwinError("not the result that summary.json beside it is of", str(path), remedy)
        time.sleep(_LOOK)
    return path


def _agrees(path: Path) -> bool:
    try:
        named = json.loads((path.parent / "summary.json").read_bytes())["files"][path.name]
        return sha256(path.read_bytes()).hexdigest() == named
    except (OSError, ValueError, KeyError, TypeError):
        return True

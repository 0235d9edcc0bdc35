"""A file of a cache entry: numpy's npz without pickles, and after it the sha256 of all bytes before.

Inside, not compressed: the JSON text of `twin.build.cache_codec` as bytes, then the arrays it refers to. np.load reads
the file as it is.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from twin.atomic import atomic_path
from twin.build.cache_codec import decode, encode

DIGEST = 32  # bytes of a sha256
CHUNK = 1 << 20


def write_entry(path: Path, value: Any, most: int) -> bool:
    """Write what `encode` can keep; False, and nothing written, where that is more than `most` bytes.

    Raises TypeError for what cannot be kept, TwinError where the file cannot be written.
    """
    structure, arrays = encode(value)
    text = np.frombuffer(json.dumps(structure).encode(), dtype=np.uint8)
    if text.nbytes + sum(array.nbytes for array in arrays) > most:
        return False
    with atomic_path(path) as temporary:
        with open(temporary, "wb") as f:
            np.savez(f, text, *arrays)
        with open(temporary, "r+b") as f:
            f.write(_digest(f, temporary.stat().st_size))
    return True


def read_entry(path: Path) -> Any:
    """What was written. Raises FileNotFoundError, or another exception for a file that is damaged or no entry."""
    with open(path, "rb") as f:  # kept open: another process may remove or replace the file meanwhile
        size = f.seek(0, 2) - DIGEST
        if size < 0 or _digest(f, size) != f.read():
            raise ValueError("its checksum does not fit")
        f.seek(0)
        with np.load(f, allow_pickle=False) as content:
            text, *arrays = (content[f"arr_{i}"] for i in range(len(content.files)))
    return decode(json.loads(text.tobytes()), arrays)


def _digest(f: BinaryIO, size: int) -> bytes:
    """Of the first `size` bytes; the file then stands behind them."""
    digest = hashlib.sha256()
    f.seek(0)
    while size > 0 and (chunk := f.read(min(CHUNK, size))):
        digest.update(chunk)
        size -= len(chunk)
    return digest.digest()

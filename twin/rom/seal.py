"""A hash over the bytes of a file, behind the end of what HDF5 reads: looked at before HDF5 sees a damaged file.

The HDF5 library does not survive every damaged file: some flipped bits in its tables end the process, with nothing to
catch. The hash of the content (`twin.rom.content`) comes too late for these. A file that another tool wrote has that
hash alone, and no seal. HDF5 allows bytes behind its end, and drops them when it changes the file.
"""

from __future__ import annotations

import hashlib

_MARK = b"\ntwin sha256 "
_TAIL = 4096  # bytes in which a seal that is not at the end is looked for
_LENGTH = len(_MARK) + 64 + 1  # hexadecimal digits, and a line feed


def sealed(image: bytes) -> bytes:
    """The bytes of an HDF5 file with their seal behind them."""
    return image + _MARK + hashlib.sha256(image).hexdigest().encode("ascii") + b"\n"


def is_broken(content: bytes) -> bool:
    """Whether the bytes of a file have a seal that is not theirs, is cut or is followed by more; False without one."""
    if len(content) < _LENGTH or not content[-_LENGTH:].startswith(_MARK):
        return _MARK in content[-_TAIL:]
    stored = content[-_LENGTH + len(_MARK) : -1]
    return stored != hashlib.sha256(memoryview(content)[:-_LENGTH]).hexdigest().encode("ascii")

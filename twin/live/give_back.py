"""Memory that compiling leaves behind, given back to the system: garbage, freed heap, and pages of the compiler itself.

XLA is a library of hundreds of megabytes, of which running a compiled step needs little. Its code is dropped from
memory page by page; what is called again comes back from the file.
"""

from __future__ import annotations

import ctypes
import gc
from pathlib import Path

_COMPILER = "libjax"  # in the name of the library
_MADV_DONTNEED = 4  # Linux: of pages that nobody has written, that they may go


def give_back() -> None:
    """Takes some 0.1 s; does what the system can and no more."""
    gc.collect()
    library = ctypes.CDLL(None)
    if hasattr(library, "malloc_trim"):  # glibc, which would keep what was freed
        library.malloc_trim(0)
    try:
        maps = Path("/proc/self/maps").read_text(encoding="utf-8")
    except OSError:
        return
    for line in maps.splitlines():
        addresses, rights, *_, name = line.split(maxsplit=5)
        if rights == "r-xp" and _COMPILER in Path(name).name:  # code alone: no page of it is ever written
            begin, end = (int(a, 16) for a in addresses.split("-"))
            library.madvise(ctypes.c_void_p(begin), ctypes.c_size_t(end - begin), _MADV_DONTNEED)

"""Inputs are ordinary files: a named pipe would be waited for without end, and a device may never end."""

from __future__ import annotations

import errno
from pathlib import Path


def ordinary(path: Path) -> Path:
    """The path, where it may be opened without waiting. Raises OSError for pipes, sockets and devices.

    What is missing or a folder is left to whoever opens it.
    """
    if path.exists() and not path.is_file() and not path.is_dir():
        raise OSError(errno.EINVAL, "a pipe or device, not an ordinary file", str(path))
    return path

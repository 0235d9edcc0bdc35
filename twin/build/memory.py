"""How much memory may be used: what the computer has free, within the limit of a container."""

from __future__ import annotations

import os
from pathlib import Path


def available_memory() -> float:
    """Bytes that can be allocated without swapping; infinity where the system does not tell."""
    return min(_system(), _container())


def _system() -> float:
    try:
        for line in Path("/proc/meminfo").read_text().splitlines():  # free pages alone leave out what caches hold
            if line.startswith("MemAvailable:"):
                return float(line.split()[1]) * 1024.0
    except OSError:
        pass
    try:
        return float(os.sysconf("SC_PAGE_SIZE")) * float(os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, OSError, ValueError):
        return float("inf")


def _container() -> float:
    """What a control group (version 2) leaves, where there is a limit."""
    group = Path("/sys/fs/cgroup")
    try:
        limit = (group / "memory.max").read_text().strip()
        return float("inf") if limit == "max" else float(limit) - float((group / "memory.current").read_text())
    except (OSError, ValueError):
        return float("inf")

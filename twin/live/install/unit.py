"""The systemd unit of a `twin live` command."""

from __future__ import annotations

import getpass
import sys
from collections.abc import Sequence
from importlib import resources
from pathlib import Path

MEMORY = {"c": "256M", "jax": "1G"}  # three times what each takes: beyond it something is wrong


def unit_of(arguments: Sequence[str], engine: str) -> str:
    """The unit that runs `twin live` with these arguments, in the folder and by the user of this process."""
    command = " ".join(_quoted(a) for a in (sys.executable, "-m", "twin.cli.main", "live", *arguments))
    text = (resources.files("twin.live.install") / "twin-live.service").read_text(encoding="utf-8")
    told = {"USER": getpass.getuser(), "FOLDER": str(Path.cwd()).replace("%", "%%"), "COMMAND": command,
            "MEMORY": MEMORY[engine]}  # fmt: skip
    for name, value in told.items():
        text = text.replace(f"@{name}@", value)
    return text


def _quoted(argument: str) -> str:
    """As systemd reads it (systemd.service(5), "Command lines"): specifiers and variables are none."""
    text = argument.replace("\\", "\\\\").replace('"', '\\"').replace("%", "%%").replace("$", "$$")
    return f'"{text}"' if not text or any(c in text for c in " \t'\";\\") else text

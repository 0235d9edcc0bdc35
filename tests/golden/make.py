"""Writes the golden values anew and says what has changed: `python -m tests.golden.make [values] [verdicts]`.

For results that are meant to change only; the commit says why they do. Verdicts take minutes.
"""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path

from tests.golden.compare import differences
from tests.golden.pinned import computed

FOLDER = Path(__file__).parent
MODULES = {"values": "tests.golden.compute", "verdicts": "tests.golden.verdicts"}


def main(*wanted: str) -> None:
    for name in wanted or MODULES:
        path = FOLDER / f"{name}.json"
        old = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
        with tempfile.TemporaryDirectory() as cache:
            now = computed(MODULES[name], Path(cache))
        lines = [f"{json.dumps(key)}: {json.dumps(value)}" for key, value in now.items()]
        path.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")
        changed = differences(old, now, 0.0)
        print(f"{path.name}: {len(now)} values, {len(changed)} changed", *changed[:200], sep="\n")


if __name__ == "__main__":
    main(*sys.argv[1:])

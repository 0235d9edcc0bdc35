"""The catalogue: what may be wrong with a simulation, entry by entry.

An entry says what the cause is in physics, what it adds to x' = A(theta) x + B(theta) u, y = C x, how it betrays
itself, and the smallest size worth naming; and it lists its hypotheses as batches over the elementary causes. Users add
entries of their own: a Python file with `FAMILIES = (Family(...), ...)`, given as `twin diagnose --catalogue FILE`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from twin.diagnose.faults.fault import Family
from twin.diagnose.faults.table import FAMILIES
from twin.errors import TwinError
from twin.nearest import did_you_mean

VERSION = "2"


def family(name: str, families: Sequence[Family] = FAMILIES, option: str = "--explain") -> Family:
    """The entry of a name that an option gives. Raises TwinError with the nearest one."""
    for entry in families:
        if entry.name == name:
            return entry
    remedy = did_you_mean(name, [f.name for f in families], "families")
    raise TwinError(f"'{name}' is not in the catalogue", option, remedy)


def with_own(path: Path) -> tuple[Family, ...]:
    """The catalogue with the entries of a user's file in front; an entry of an existing name takes its place.

    Raises TwinError for files that do not run or hold no FAMILIES.
    """
    scope: dict[str, object] = {"__name__": "own_catalogue", "__file__": str(path)}
    try:
        text = path.read_text("utf-8")
        exec(compile(text, str(path), "exec"), scope)
    except OSError as e:
        raise TwinError("cannot be read", str(path), "give a Python file that defines FAMILIES") from e
    except Exception as e:
        raise TwinError(
            f"does not run: {type(e).__name__}: {e}", str(path), "fix the file; see docs/diagnosis.md"
        ) from e
    own = scope.get("FAMILIES")
    if not isinstance(own, tuple) or not all(isinstance(f, Family) for f in own):
        raise TwinError("defines no tuple FAMILIES of Family", str(path), "see the example in docs/diagnosis.md")
    names = {f.name for f in own}
    return (*(replace(f, file=text) for f in own), *(f for f in FAMILIES if f.name not in names))


def explained(entry: Family) -> str:
    """An entry in words, for `--explain`."""
    rows = (
        ("what", entry.physics), ("adds", entry.operator), ("signature", entry.signature),
        ("worth naming", entry.smallest), ("sign", entry.sign), ("searched", entry.searched),
    )  # fmt: skip
    return "\n".join([f"{entry.number}. {entry.title} ({entry.name})", *(f"  {k:<13} {v}" for k, v in rows)])

"""The catalogue as a table of docs/diagnosis.md: python -m twin.diagnose.report.catalogue docs/diagnosis.md"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from twin.diagnose.faults.catalogue import FAMILIES, Family

BEGIN = "<!-- made from FAMILIES by `python -m twin.diagnose.report.catalogue`; do not edit -->"
END = "<!-- end of the catalogue -->"
_HEAD = ("#", "family", "what is wrong", "what it adds", "how it shows", "worth naming from", "sign", "searched")


def catalogue_table(families: Sequence[Family] = FAMILIES) -> str:
    """A row per entry."""
    rows = [_HEAD, ("---",) * len(_HEAD)]
    for f in families:
        name, what, adds = f"`{f.name}`", f"{f.title}. {f.physics}", f"`{f.operator}`"
        rows.append((str(f.number), name, what, adds, f.signature, f.smallest, f.sign, f.searched))
    return "\n".join("| " + " | ".join(_cell(c) for c in row) + " |" for row in rows) + "\n"


def _cell(text: str) -> str:
    """Bars would end a cell."""
    return text.replace("|", "\\|")


def renewed(page: str) -> str:
    """The page with the table of today between its marks. Raises ValueError for a page without marks."""
    before, begin, rest = page.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise ValueError("the page has no marks for the catalogue")
    return f"{before}{BEGIN}\n\n{catalogue_table()}\n{END}{after}"


if __name__ == "__main__":
    import sys

    path = Path(sys.argv[1])
    path.write_text(renewed(path.read_text("utf-8")), encoding="utf-8")

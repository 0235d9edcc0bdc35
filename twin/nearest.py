"""The name a user probably meant."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

_LISTED = 12


def nearest(name: str, known: Iterable[str]) -> str | None:
    """The known name most like `name`, without regard to case; None where nothing is like it."""
    by_fold = {k.casefold(): k for k in known}
    close = difflib.get_close_matches(name.casefold(), by_fold, n=1, cutoff=0.6)
    return by_fold[close[0]] if close else None


def did_you_mean(name: str, known: Iterable[str], what: str) -> str:
    """A remedy for an unknown name: "did you mean 'steel'? materials are: cast_iron, steel"."""
    known = list(known)
    close = nearest(name, known)
    listed = ", ".join(known[:_LISTED]) + (f" and {len(known) - _LISTED} more" if len(known) > _LISTED else "")
    return (f"did you mean '{close}'? " if close else "") + (
        f"{what} are: {listed}" if known else f"there are no {what}"
    )

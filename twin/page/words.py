"""What a page says: whether a result can be trusted, in one line, and what every flag means."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

CAUTION = (
    "The certificate compares the model with the full finite-element model, not with the machine itself: twin score "
    "does that, where measurements exist."
)
_FLAGS = (
    (r"signals\.(.+) (above|below) (.+)", "{0} was {1} {2}, the end of the range that the certificate covers"),
    (r"films\.(.+) (above|below) (.+)", "the film coefficient of {0} was {1} {2}, the end of the range that the "
     "certificate covers"),
    (r"position outside the pose grid.*", "an axis stood outside the grid of poses; the TCP error shown is that of the "
     "grid's border"),
    (r"gap in loads", "the log has no loads there; the last ones were held"),
)  # fmt: skip


def flag_words(name: str) -> str:
    """A sentence about the flag called `name`; the name itself where no more is known of it."""
    for pattern, words in _FLAGS:
        if found := re.fullmatch(pattern, name):
            text = words.format(*found.groups())
            return text[0].upper() + text[1:] + ": there the model's error is not known."
    return f"{name}: outside what was certified or published, so there the model's error is not known."


def trust(certificate: Mapping[str, Any], flagged: int, steps: int, flags: Sequence[str]) -> tuple[str, str]:
    """Can a finished result be trusted: "yes", "care" or "no", and one line of reasons."""
    if not certificate:
        return "no", "no: the artefact has no certificate, so nothing is known of its error"
    if not certificate.get("passed", False):
        return "no", "no: the certificate failed, the model is further from the full one than its limits allow"
    errors = f"{_size(certificate, 'temperature', 1.0):.3g} K"
    if _moves(certificate):
        errors += f" and {_size(certificate, 'displacement', 1e6):.2g} µm"
    if flagged:
        share = f"{flagged} of {steps} steps were outside what was certified"
        objects = list(dict.fromkeys(re.sub(r"^(signals|films)\.| (above|below) .*", "", flag) for flag in flags))
        named = ", ".join(objects[:4]) + (f" and {len(objects) - 4} more" if len(objects) > 4 else "")
        return "care", f"with care: {share} ({named}); in the others errors stay within {errors} in the certified case"
    return "yes", f"yes: inside what was certified at every step, errors within {errors} in the certified case"


def _size(certificate: Mapping[str, Any], quantity: str, factor: float) -> float:
    key = f"max_{quantity}_error_in_case"
    return factor * float(np.max(certificate.get(key, certificate.get(f"{quantity}_error", 0.0)), initial=0.0))


def _moves(certificate: Mapping[str, Any]) -> bool:
    return bool(np.any(certificate.get("displacement_range", 0.0)))

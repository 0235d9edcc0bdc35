"""The table of physical laws. A new law is one function, one row in loss_table.py or film_table.py, one test."""

from __future__ import annotations

from twin.physics.film_table import FILMS, JOINTS
from twin.physics.law import Argument, Law, Validity
from twin.physics.loss_table import LOSSES

__all__ = ["LAWS", "Argument", "Law", "Validity"]

LAWS: dict[str, Law] = {**LOSSES, **FILMS, **JOINTS}

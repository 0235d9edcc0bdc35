"""Verbs that need a TCP refuse models in which no temperature moves the tool."""

from __future__ import annotations

from typing import TYPE_CHECKING

from twin.errors import TwinError

if TYPE_CHECKING:
    from twin.rom.model import MachineModel


def refuse_still(model: MachineModel) -> None:
    """Raises TwinError for a model without a TCP that temperatures move."""
    if not model.moves:
        remedy = "describe its TCP and build again: [tcp.tool] and [tcp.work], of a lumped machine [tcp.expansion]"
        raise TwinError("no temperature moves the tool", model.name, remedy)

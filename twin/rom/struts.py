"""How the temperatures of six struts, their platform and their frame move the tool (`twin.rom.parallel`).

Every strut grows by a number of rows over its temperatures; the Jacobian at the pose makes a motion of the platform of
that. A strut's screw grows from its fixed bearing to the nut, as that of any lumped machine (`lumped_structure.Screw`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin.rom.parallel import Geometry


@dataclass(frozen=True)
class Growth:
    """Length per temperatures of some states of a body."""

    body: int
    states: np.ndarray  # (m,) of the body
    rates: np.ndarray  # (m,) m/K


@dataclass(frozen=True)
class Spread:
    """A platform or frame that expands with the mean temperature of some states of a body."""

    body: int
    states: np.ndarray  # (m,)
    mean: np.ndarray  # (m,) weights
    expansion: float  # 1/K


@dataclass(frozen=True)
class StrutPlatform:
    """Strut k belongs to axis k and to screw k of the structure."""

    geometry: Geometry
    sign: float  # 1: the platform carries the tool, -1: the work
    growth: tuple[tuple[Growth, ...], ...]  # per strut, besides its screw
    moving: Spread | None
    frame: Spread | None
    ground: np.ndarray  # (3,) m, where the frame holds the other side

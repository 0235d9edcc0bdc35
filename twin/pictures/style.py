"""The look shared by all pictures."""

from __future__ import annotations

from io import BytesIO
from typing import Any

from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

AXIS_COLOURS = {"x": "#d55e00", "y": "#009e73", "z": "#0072b2"}  # Okabe-Ito: distinguished by every eye
MARKED = ("#d55e00", "#0072b2", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c564b", "#5b4b9a")
MUTED = "#b8bcc2"
INK = "#22262b"
SHOWN_DPI = 80  # in notebooks
# pale where cold: the shape stays visible under the shading
TEMPERATURE_MAP = LinearSegmentedColormap.from_list(
    "heat", ["#e6ecf2", "#cfdbe2", "#fbe6a6", "#f8b04f", "#e4602e", "#a81e36", "#5c0f3a"]
)

DISPLACEMENT_MAP = LinearSegmentedColormap.from_list(  # for lines on white: never pale
    "displacement", ["#7f93a6", "#cf9f3f", "#dd5a2b", "#a81e36", "#5c0f3a"]
)

RC: dict[Any, Any] = {
    "font.size": 9.5,
    "axes.titlesize": 11,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.edgecolor": "#8a9099",
    "axes.labelcolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e6e8eb",
    "grid.linewidth": 0.7,
    "xtick.color": INK,
    "ytick.color": INK,
    "text.color": INK,
    "lines.linewidth": 1.6,
    "figure.dpi": 140,
}


class ShownFigure(Figure):
    """A figure that a notebook shows as the value of a cell, without pyplot."""

    def _repr_png_(self) -> bytes:
        png = BytesIO()
        self.savefig(png, format="png", dpi=SHOWN_DPI)
        return png.getvalue()


def figure(width: float, height: float) -> Figure:
    """A figure of width x height [inches] that needs no global state. Call inside `matplotlib.rc_context(RC)`."""
    return ShownFigure(figsize=(width, height), layout="constrained")

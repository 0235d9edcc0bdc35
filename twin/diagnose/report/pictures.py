"""What the pictures of a diagnosis share: a title, a sentence that says how to read them, their way into a page."""

from __future__ import annotations

import base64
import io
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from html import escape
from typing import Any

import matplotlib
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from twin.pictures.style import RC, figure

# Distinguished by every eye (Okabe-Ito), and by lightness in print
DELIVERED, RECALIBRATED, EXTENDED = "#8a9099", "#0072b2", "#d55e00"
RESIDUAL_MAP = LinearSegmentedColormap.from_list(
    "residual", ["#08306b", "#0072b2", "#f4f4f2", "#d55e00", "#6b1d04"]
).with_extremes(bad="#b8bcc2")
LOAD_MAP = LinearSegmentedColormap.from_list("load", ["#eceef0", "#3d4249"]).with_extremes(bad="#b8bcc2")
# Names hold what people type: no formulas in them
PAGE_RC: dict[Any, Any] = RC | {"text.parse_math": False, "legend.frameon": False, "axes.axisbelow": True}
DPI = 120


@dataclass(frozen=True)
class Picture:
    title: str
    caption: str  # one sentence: how to read it
    figure: Figure

    def html(self) -> str:
        """The picture within the page; the page turns its ink and paper around in the dark."""
        image = io.BytesIO()
        with matplotlib.rc_context(PAGE_RC), warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Glyph .* missing")  # names may hold any script
            self.figure.savefig(image, format="png", dpi=DPI, transparent=True, metadata={"Software": None})
        coded, caption = base64.b64encode(image.getvalue()).decode("ascii"), escape(self.caption)
        head = f'<h3>{escape(self.title)}</h3>\n<img alt="{escape(self.title)}" src="data:image/png;base64,{coded}">'
        return f"<figure>{head}\n<figcaption>{caption}</figcaption></figure>"


@contextmanager
def drawing(width: float, height: float, grid: bool = True) -> Iterator[Figure]:
    """A figure [inches], to be drawn on within the page's style."""
    with matplotlib.rc_context(PAGE_RC | {"axes.grid": grid}):
        yield figure(width, height)


def short(name: str, length: int = 28) -> str:
    """`name` cut in its middle: both ends tell names apart."""
    name = " ".join(name.split())
    if len(name) <= length:
        return name
    return f"{name[: length // 2]}…{name[-(length - length // 2 - 1) :]}"

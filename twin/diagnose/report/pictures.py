"""What the pictures of a diagnosis share: a title, a sentence that says how to read them, their way into a page."""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from twin.pictures.style import INK, MUTED, RC, figure

# The stages of a diagnosis, distinguished by every eye (Okabe-Ito), and by lightness in print.
DELIVERED, RECALIBRATED, EXTENDED = "#8a9099", "#0072b2", "#d55e00"
STAGES = (("as delivered", DELIVERED), ("recalibrated", RECALIBRATED), ("extended", EXTENDED))
RESIDUAL_MAP = LinearSegmentedColormap.from_list(
    "residual", ["#08306b", "#0072b2", "#f4f4f2", "#d55e00", "#6b1d04"]
).with_extremes(bad="#b8bcc2")
LOAD_MAP = LinearSegmentedColormap.from_list("load", ["#eceef0", "#3d4249"]).with_extremes(bad="#b8bcc2")
# Names hold what people type: no formulas in them. Text stays text: it can be found, copied, and takes the page's ink.
PAGE_RC: dict[Any, Any] = RC | {
    "text.parse_math": False,
    "svg.fonttype": "none",
    "svg.hashsalt": "twin",  # equal input, equal bytes
    "legend.frameon": False,
    "axes.axisbelow": True,
}
_PAGE_COLOURS = {INK: "--ink", RC["grid.color"]: "--grid", DELIVERED: "--grey", RECALIBRATED: "--blue",
                 EXTENDED: "--orange", MUTED: "--faint"}  # fmt: skip


_BETWEEN = re.compile(r"(?<=>)\s*\n\s*(?=<)")  # blanks between tags: text has none around it
_LONG = re.compile(r"-?\d+\.\d{3,}")


@dataclass(frozen=True)
class Picture:
    title: str
    caption: str  # one sentence: how to read it
    figure: Figure


@contextmanager
def drawing(height: float, grid: bool = True) -> Iterator[Figure]:
    """A figure as wide as the page and of a height [inches], to be drawn on within the page's style."""
    with matplotlib.rc_context(PAGE_RC | {"axes.grid": grid}):
        yield figure(11.0, height)


def without(count: int, what: str) -> str:
    """The end of a caption: how many of what are left out."""
    return f" ({count} {what} are left out)." if count else "."


def inline_svg(drawn: Figure, name: str) -> str:
    """The figure as an <svg> for a page: ids of its own, colours of the page (light or dark), nothing from outside."""
    text = io.StringIO()
    with matplotlib.rc_context(PAGE_RC), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing")  # the reader's browser has its own fonts
        drawn.savefig(text, format="svg", transparent=True, metadata={"Date": None, "Creator": None})
    svg = text.getvalue()
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>|<style[^>]*>.*?</style>|<!--.*?-->", "", svg, flags=re.DOTALL)
    head, body = svg.split(">", 1)
    size = re.search(r'viewBox="[^"]*"', head)
    head = f'<svg class="plot" role="img" aria-labelledby="{name}_caption" {size[0] if size else ""}'
    used = set(
        re.findall(r'(?:url\(#|href="#)([^)"]+)', body)
    )  # equal images get equal ids: only what is used keeps one
    body = re.sub(r' id="([^"]*)"', lambda m: m[0] if m[1] in used else "", body)
    body = re.sub(r'( id="|url\(#|href="#)', lambda m: f"{m[1]}{name}_", body)
    for colour, variable in _PAGE_COLOURS.items():
        body = body.replace(f": {colour}", f": var({variable})")
    body = re.sub(r"font: ([\d.]+px) [^;\"]*", r"font-size: \1", body)
    body = re.sub(r"font-family: [^;\"]*;? ?", "", body)  # the page's
    body = re.sub(r' (d|x|y)="([^"]*)"', lambda m: f' {m[1]}="{_LONG.sub(_short, m[2])}"', body)
    body = re.sub(r'(<g clip-path="[^"]*")>((?:\s*<use [^>]*/>)+)', _of_group, body)
    return f"{head}>{re.sub(_BETWEEN, '', body)}"


def _of_group(found: re.Match[str]) -> str:
    """Dots of one look: it stands once, before them, instead of at each."""
    styles = set(re.findall(r' style="[^"]*"', found[2]))
    if len(styles) != 1:
        return found[0]
    (style,) = styles
    return f"{found[1]}{style}>{found[2].replace(style, '')}"


def _short(number: re.Match[str]) -> str:
    """To a hundredth of a point: what matplotlib writes more is half of a page's bytes."""
    return f"{float(number[0]):.2f}".rstrip("0").rstrip(".")


def short(name: str, length: int = 28) -> str:
    """`name` cut in its middle: both ends tell names apart."""
    name = " ".join(name.split())
    if len(name) <= length:
        return name
    return f"{name[: length // 2]}…{name[-(length - length // 2 - 1) :]}"


def rms(values: np.ndarray, axis: int = 0) -> np.ndarray:
    """Root mean square along an axis of what is finite; NaN where nothing is."""
    values = np.asarray(values, dtype=float)
    there = np.isfinite(values)
    count = there.sum(axis=axis)
    total = np.where(there, values, 0.0) ** 2
    return np.where(count > 0, np.sqrt(total.sum(axis=axis) / np.maximum(count, 1)), np.nan)


def mean(values: np.ndarray, axis: int = 0) -> np.ndarray:
    """Mean along an axis of what is finite; NaN where nothing is."""
    there = np.isfinite(values)
    count = there.sum(axis=axis)
    return np.where(count > 0, np.where(there, values, 0.0).sum(axis=axis) / np.maximum(count, 1), np.nan)


def colour_range(arrays: Iterable[np.ndarray]) -> float:
    """A symmetric colour range that the few largest values may exceed."""
    values = np.concatenate([np.abs(np.asarray(a, dtype=float)).ravel() for a in arrays])
    values = values[np.isfinite(values)]
    return max(float(np.percentile(values, 99.0)), 1e-9) if values.size else 1.0


def write_values(axes: Axes, values: np.ndarray, largest: float, form: str, size: float = 7.5) -> None:
    """The numbers of a small heat map into its cells, white where the cell is dark."""
    for (i, k), value in np.ndenumerate(values):
        if np.isfinite(value):
            colour = "#ffffff" if abs(value) > 0.6 * largest else "#000000"
            text = format(value, form)
            text = text.replace("-", "").replace("+", "") if not float(text) else text  # no -0.00
            axes.text(k, i, text, ha="center", va="center", fontsize=size, color=colour)

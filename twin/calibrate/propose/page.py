"""The page of a proposed network: what the columns were taken for, what follows what, and how well it predicts."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from html import escape
from pathlib import Path

import numpy as np

from twin.atomic import atomic_path
from twin.calibrate.members.find import Found
from twin.calibrate.members.responses import duration
from twin.calibrate.propose.columns import Column
from twin.calibrate.propose.judge import AXES, Figure, Follows, Predicted

_STYLE = """body { font: 15px/1.5 system-ui, sans-serif; max-width: 1000px; margin: 2rem auto; padding: 0 1rem; }
table { border-collapse: collapse; margin: .6rem 0 1.2rem; font-size: .9rem; } td, th { text-align: left;
padding: .25rem .9rem .25rem 0; border-bottom: 1px solid #ddd; vertical-align: top; } .n { text-align: right; }
img { width: 100%; } figcaption { color: #666; }"""
_MEASURED, _NETWORK, _RIDGE = "#22262b", "#0072b2", "#b8bcc2"


def write_page(
    path: Path, name: str, columns: Sequence[Column], told: Sequence[str], found: Found, follows: Sequence[Follows],
    made: Sequence[Predicted], rows: Sequence[Figure],
) -> None:  # fmt: skip
    """index.html, which needs nothing beside it. Raises TwinError if it cannot be written."""
    parts = [f"<h1>{escape(name)}</h1>", f"<p>{escape(sentence(found, rows))}</p>"]
    if rows:
        parts += ["<h2>How well it predicts</h2>", _table(*figure_rows(rows))]
        parts += [_picture(made)]
    parts += ["<h2>What the tool follows</h2>", _table(*driver_rows(found))]
    parts += ["<h2>What the temperatures follow</h2>", _table(*follow_rows(follows))]
    parts += ["<h2>What the columns were taken for</h2>", _table(*column_rows(columns))]
    if told:
        parts += ["<h2>Not used</h2>", "<ul>", *(f"<li>{escape(t)}</li>" for t in told), "</ul>"]
    body = "\n".join(parts)
    page = (
        f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{escape(name)}</title>'
        f"<style>{_STYLE}</style></head><body>{body}</body></html>\n"
    )
    with atomic_path(path) as temporary:
        temporary.write_text(page, encoding="utf-8")


def sentence(found: Found, rows: Sequence[Figure]) -> str:
    """What one has to know."""
    e = found.selected.explained
    n = len({m.candidate.driver.column for m in found.members})
    text = f"{len(found.members)} nodes that follow {n} logged columns; expansions within {1e6 * e.scale:.2g} um/K "
    noise = ", ".join(f"{AXES[a]} {1e6 * s:.2g} um" for a, s in zip(found.axes, e.noise, strict=True))
    return text + f"(one sigma), what is left counts as noise of {noise}. " + " ".join(_verdict(f) for f in rows)


def _verdict(f: Figure) -> str:
    d = f.difference
    sure = (
        "" if d.low is None or d.high is None else f" (difference {1e6 * d.low:+.1f} to {1e6 * d.high:+.1f} um, 95 %)"
    )
    return f"{f.axis} of runs {f.part}: {1e6 * f.network:.1f} um rms, ridge regression {1e6 * f.ridge:.1f}{sure}."


def figure_rows(rows: Sequence[Figure]) -> tuple[list[str], list[list[str]]]:
    """Header and cells, as of the functions below."""
    header = ["runs", "axis", "nothing [um rms]", "ridge regression", "network", "network less ridge, 95 %"]
    cells = []
    for f in rows:
        d = f.difference
        interval = "too few rows" if d.low is None or d.high is None else f"{1e6 * d.low:+.2f} .. {1e6 * d.high:+.2f}"
        cells.append([f.part, f.axis, *(f"{1e6 * v:.2f}" for v in (f.zero, f.ridge, f.network)), interval])
    return header, cells


def driver_rows(found: Found) -> tuple[list[str], list[list[str]]]:
    header = [
        "column",
        "moves " + ", ".join(AXES[a] for a in found.axes) + " [um rms]",
        "asked for by the data (ln evidence)",
    ]
    header.append("residual of stretches left out, with those above [um rms]")
    cells = []
    for j in found.selected.joined:
        moves, left = (", ".join(f"{1e6 * v:.2g}" for v in values) for values in (j.moves, j.held_out))
        cells.append([j.name, moves, f"{j.gain:.1f}" + ("" if j.sure else ", may be chance"), left])
    return header, cells


def follow_rows(follows: Sequence[Follows]) -> tuple[list[str], list[list[str]]]:
    header = ["temperature", "follows", "within", "share explained"]
    return header, [[f.column, f.by.driver.words, duration(f.by.lag), f"{f.share:.1%}"] for f in follows]


def column_rows(columns: Sequence[Column]) -> tuple[list[str], list[list[str]]]:
    return ["column", "unit", "taken for", "why"], [[c.name, c.unit, c.role, c.how] for c in columns]


def _table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    head = "".join(f"<th>{escape(h)}</th>" for h in header)
    lines = ["".join(f"<td>{escape(c)}</td>" for c in row) for row in rows]
    return f"<table><tr>{head}</tr>" + "".join(f"<tr>{line}</tr>" for line in lines) + "</table>"


def _picture(made: Sequence[Predicted]) -> str:
    import matplotlib
    from matplotlib.figure import Figure as Canvas

    from twin.pictures.style import RC

    runs = list(dict.fromkeys((p.run, p.part) for p in made))
    axes = list(dict.fromkeys(p.axis for p in made))
    with matplotlib.rc_context(RC):
        figure = Canvas(figsize=(10.0, 1.7 * len(runs)), layout="constrained")
        grid = figure.subplots(len(runs), len(axes), squeeze=False, sharex=True)
        for p in made:
            ax = grid[runs.index((p.run, p.part)), axes.index(p.axis)]
            hours = (p.time - p.time[0]) / 3600.0
            ax.plot(hours, 1e6 * p.ridge, color=_RIDGE, lw=1.0, label="ridge regression")
            ax.plot(hours, 1e6 * p.measured, color=_MEASURED, lw=1.0, label="measured")
            ax.plot(hours, 1e6 * p.network, color=_NETWORK, lw=1.2, label="network")
            ax.set_title(f"{p.run}, {p.part}: {p.axis} [um]", fontsize=8)
        grid[0, 0].legend(fontsize=7)
        for ax in grid[-1]:
            ax.set_xlabel("h")
        data = io.BytesIO()
        figure.savefig(data, format="png", dpi=110)
    coded = base64.b64encode(data.getvalue()).decode("ascii")
    caption = "Every run as predicted by a fit that did not see it."
    image = f'<img alt="measured and predicted" src="data:image/png;base64,{coded}">'
    return f"<figure>{image}<figcaption>{caption}</figcaption></figure>"


def text_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """The same for a terminal."""
    every = [list(header), *map(list, rows)]
    widths = np.max([[len(c) for c in row] for row in every], axis=0)
    return "\n".join("  " + "  ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)).rstrip() for row in every)

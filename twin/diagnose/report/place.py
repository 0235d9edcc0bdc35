"""The picture of the place: the machine with the surface or node marked, the sensors that told it, and what is left."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb

from twin.diagnose.report.pictures import DELIVERED, EXTENDED, RECALIBRATED, Picture, drawing, rms, short
from twin.diagnose.report.text import place_words
from twin.diagnose.result.diagnosis import Diagnosis
from twin.diagnose.result.place import Network, Scene, Shell
from twin.diagnose.result.spot import Of, Spot
from twin.pictures.marked import marked_view
from twin.pictures.network import layout
from twin.pictures.style import INK, MUTED
from twin.pictures.surface import SurfaceMesh

WIDTH = 620  # pixels of the machine: as wide as a column of the page shows
CHANNELS = 9  # beside the machine
NAMED = 4  # sensors with a name in the machine
LEAST, MOST = 18.0, 420.0  # points^2 of a marker of no share and of all of it
LINE = 22.0  # pixels of a line of names
BESIDE = 0.17  # of the machine's width, for names at either side
METRE = 1e6  # um
COMPONENTS = ("dx", "dy", "dz")


def place_picture(d: Diagnosis) -> Picture | None:
    """None where nothing has a place."""
    if d.scene is None:
        return None
    shares = dict(d.support.shares) if d.support else {}
    rows = _channels(d, shares)
    with drawing(5.2, grid=False) as fig:
        left, right = fig.subplots(1, 2, gridspec_kw={"width_ratios": [1.75, 1.0]})
        left.set_axis_off()
        if isinstance(d.scene.machine, Shell):
            behind = _machine(left, d.scene, d.scene.machine, shares)
        else:
            behind = ""
            _network(left, d.scene, d.scene.machine, shares)
        _bars(right, rows)
    where = place_words(d.scene.place)
    return Picture(
        f"Where: {where}",
        f"Orange is the place{behind}; a dot is a sensor, the larger the more of the evidence it carries. At the right "
        "are these shares, and what is left of each channel (root mean square) without the causes and with them.",
        fig,
    )


def _channels(d: Diagnosis, shares: dict[str, float]) -> list[tuple[str, float, str]]:
    """The strongest channels: name, share, what is left before and after."""
    told = []
    for name, share in list(shares.items())[:CHANNELS]:
        before, after = _left(d, name)
        unit, factor = ("µm", METRE) if name in COMPONENTS else ("K", 1.0)
        words = f"{factor * before:.2g} → {factor * after:.2g} {unit}" if np.isfinite(before + after) else ""
        told.append((f"TCP {name}" if unit == "µm" else name, share, words))
    return told


def _left(d: Diagnosis, channel: str) -> tuple[float, float]:
    """rms of a channel over all diagnosed runs, recalibrated and extended."""
    before, after = [np.zeros(0)], [np.zeros(0)]
    for s in (s for s in d.series if not s.sealed):
        if channel in s.sensors:
            k = s.sensors.index(channel)
            before.append(s.recalibrated[:, k])
            after.append(s.extended[:, k])
        elif channel in COMPONENTS:
            k = COMPONENTS.index(channel)
            before.append(s.tcp_recalibrated[:, k])
            after.append(s.tcp_extended[:, k])
    return float(rms(np.concatenate(before))), float(rms(np.concatenate(after)))


def _size(share: float) -> float:
    return LEAST + (MOST - LEAST) * share


def _machine(axes: Axes, scene: Scene, shell: Shell, shares: dict[str, float]) -> str:
    """Draws the machine; returns words on what hides the place."""
    marked = np.isin(shell.surface, [k for k, n in enumerate(shell.names) if n in scene.marked])
    mesh = SurfaceMesh(shell.points, shell.triangles, shell.part)
    view = marked_view(mesh, marked, to_rgb(EXTENDED), scene.vertical, WIDTH)
    axes.imshow(view.pixels, interpolation="antialiased")
    spot = Spot.read(scene.place)
    at_fault = (spot.name, spot.partner) if spot.of is Of.SENSOR else ()
    known = [(n, p) for n, p in scene.sensors.items() if not isinstance(p, str)]
    where = view.at(np.array([p for _, p in known]).reshape(-1, 3)) if known else np.zeros((0, 2))
    ranked = list(shares)[:NAMED]
    labels = []
    for (name, _), (x, y) in sorted(zip(known, where, strict=True), key=lambda s: -shares.get(s[0][0], 0.0)):
        wrong = name in at_fault
        axes.scatter(x, y, s=_size(shares.get(name, 0.0)), color=EXTENDED if wrong else RECALIBRATED,
                     alpha=0.8, edgecolor="white", linewidth=0.8, zorder=3)  # fmt: skip
        if name in ranked or wrong:
            labels.append((name, float(x), float(y)))
    _labelled(axes, labels, view.pixels.shape[1])
    return ", seen through the parts before it" if marked.any() and view.seen < 0.5 else ""


def _labelled(axes: Axes, labels: list[tuple[str, float, float]], width: float) -> None:
    """Names beside the machine on the side of their dots, from the top down: on it they would hide what is shown."""
    for right in (False, True):
        free = -np.inf
        for name, x, y in sorted(labels, key=lambda label: label[2]):
            if (x > 0.5 * width) != right:
                continue
            free = max(free + LINE, y)
            axes.annotate(
                short(name), (x, y), xytext=((1.01 if right else -0.01) * width, free), textcoords="data", fontsize=8.5,
                va="center", ha="left" if right else "right", zorder=4,
                arrowprops={"arrowstyle": "-", "lw": 0.6, "color": DELIVERED},
            )  # fmt: skip
    axes.set_xlim(-BESIDE * width, (1.0 + BESIDE) * width)


def _network(axes: Axes, scene: Scene, network: Network, shares: dict[str, float]) -> None:
    number = {n: k for k, n in enumerate(network.nodes)}
    links = [(number[a], number[b]) for a, b, _ in network.links]
    where = layout(len(network.nodes), links)
    for (a, b), (_, _, moves) in zip(links, network.links, strict=True):
        axes.plot(*where[[a, b]].T, color=DELIVERED, lw=1.2, ls=":" if moves else "-", zorder=1)
    on: dict[str, list[str]] = {}
    for sensor, node in scene.sensors.items():
        on.setdefault(str(node), []).append(sensor)
    for name, (x, y) in zip(network.nodes, where, strict=True):
        here = name in scene.marked
        axes.scatter(x, y, s=620, marker="s" if name in network.bars else "o", color=EXTENDED if here else "#eceef0",
                     edgecolor=EXTENDED if here else DELIVERED, linewidth=1.4, zorder=2)  # fmt: skip
        axes.annotate(short(name), (x, y), xytext=(0, -21), textcoords="offset points", ha="center", va="top",
                      fontsize=8.5, color=INK, fontweight="bold" if here else "normal", zorder=4)  # fmt: skip
        for k, sensor in enumerate(on.get(name, [])):
            wrong = scene.place in (f"sensors.{sensor}",)
            axes.scatter(x, y, s=_size(shares.get(sensor, 0.0)) * (1.0 if not k else 0.6), zorder=3 + k, alpha=0.9,
                         color=EXTENDED if wrong else RECALIBRATED, edgecolor="white", linewidth=0.8)  # fmt: skip
    axes.set_aspect("equal")
    axes.margins(0.12)


def _bars(axes: Axes, rows: list[tuple[str, float, str]]) -> None:
    """Shares of the strongest channels."""
    if not rows:
        axes.set_axis_off()
        return
    y = np.arange(len(rows))
    axes.barh(y, [100.0 * share for _, share, _ in rows], color=RECALIBRATED, height=0.6, alpha=0.85)
    for k, (_, share, words) in enumerate(rows):
        axes.text(100.0 * share + 1.0, k, words, va="center", fontsize=8.5, color=INK)
    axes.set_yticks(y, [short(name, 22) for name, _, _ in rows], fontsize=8.5)
    axes.set_ylim(max(len(rows), 4) - 0.4, -0.6)
    axes.set_xlim(0.0, 1.65 * max(100.0 * rows[0][1], 10.0))
    axes.set_xticks([t for t in (0, 20, 40, 60, 80, 100) if t <= axes.get_xlim()[1]])
    axes.set_xlabel("share of the evidence in %")
    axes.tick_params(axis="y", color=MUTED)

"""The place of a cause: the machine with the surface or node marked, the sensors that told it, and what is left."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb

from twin.diagnose.model.study import COMPONENTS
from twin.diagnose.report.pictures import DELIVERED, EXTENDED, RECALIBRATED, Picture, drawing, short
from twin.diagnose.report.tables import table
from twin.diagnose.report.text import place_words
from twin.diagnose.result.diagnosis import Diagnosis
from twin.diagnose.result.numbers import quantity, rms
from twin.diagnose.result.place import Network, Scene, Shell
from twin.diagnose.result.spot import Of, Spot
from twin.pictures.marked import marked_view
from twin.pictures.network import layout
from twin.pictures.style import INK
from twin.pictures.surface import SurfaceMesh

WIDTH = 620  # pixels of the machine: as wide as its column of the page
CHANNELS = 9  # in the table; their dots bear its numbers
LEAST, NUMBERED, MOST = 18.0, 110.0, 420.0  # points^2 of a marker: no share, room for a number, all of the evidence


def place_html(d: Diagnosis) -> str:
    """Picture and table beside each other; empty where nothing has a place."""
    if d.scene is None:
        return ""
    return f'<div class="place">{place_picture(d, d.scene).html()}\n{channels_told(d)}</div>'


def place_picture(d: Diagnosis, scene: Scene) -> Picture:
    with drawing(6.4, 4.2, grid=False) as fig:
        axes = fig.subplots()
        axes.set_axis_off()
        if isinstance(scene.machine, Shell):
            behind, where = _machine(axes, scene, scene.machine)
        else:
            behind, where = "", _network(axes, scene.machine, scene)
        _dots(axes, d, scene, where)
    return Picture(
        f"Where: {place_words(scene.place)}",
        f"Orange is the place{behind}; a dot is a sensor, the larger the larger its share of the statistic, with "
        "its number in the table.",
        fig,
    )


def channels_told(d: Diagnosis) -> str:
    """The channels with the largest shares of the statistic, and their rms over all diagnosed runs without and with the
    causes; empty where no channel's share is known."""
    rows = []
    for k, (name, share) in enumerate(d.support.shares[:CHANNELS] if d.support else ()):
        before, after = [np.zeros(0)], [np.zeros(0)]
        for s in (s for s in d.series if not s.sealed):
            of_tcp = name in COMPONENTS and name not in s.sensors
            if of_tcp or name in s.sensors:
                column = COMPONENTS.index(name) if of_tcp else s.sensors.index(name)
                before.append((s.tcp_recalibrated if of_tcp else s.recalibrated)[:, column])
                after.append((s.tcp_extended if of_tcp else s.extended)[:, column])
        left = [quantity(float(rms(np.concatenate(v))), "m" if name in COMPONENTS else "K") for v in (before, after)]
        rows.append([str(k + 1), f"TCP {name}" if name in COMPONENTS else name, f"{100 * share:.0f} %", *left])
    return table(["", "channel", "share", "residual without causes", "with causes"], rows, (0, 2, 3, 4))


def _dots(axes: Axes, d: Diagnosis, scene: Scene, where: dict[str, tuple[float, float]]) -> None:
    """Sensors at their places, those with small shares and what is at fault on top."""
    shares = dict(d.support.shares) if d.support else {}
    number = {name: k + 1 for k, name in enumerate(list(shares)[:CHANNELS])}
    spot = Spot.read(scene.place)
    at_fault = (spot.name, spot.partner) if spot.of is Of.SENSOR else ()
    for z, name in enumerate(sorted(where, key=lambda n: (n in at_fault, -shares.get(n, 0.0)))):
        size = max(LEAST + (MOST - LEAST) * shares.get(name, 0.0), NUMBERED if name in number else LEAST)
        axes.scatter(*where[name], s=size, color=EXTENDED if name in at_fault else RECALIBRATED, alpha=0.85,
                     edgecolor="white", linewidth=0.8, zorder=3 + z)  # fmt: skip
        axes.annotate(str(number.get(name, "")), where[name], ha="center", va="center", color="white", fontsize=8,
                      zorder=3 + z)  # fmt: skip


def _machine(axes: Axes, scene: Scene, shell: Shell) -> tuple[str, dict[str, tuple[float, float]]]:
    """Draws the machine; returns words on what hides the place, and where its sensors are."""
    marked = np.isin(shell.surface, [k for k, n in enumerate(shell.names) if n in scene.marked])
    mesh = SurfaceMesh(shell.points, shell.triangles, shell.part)
    view = marked_view(mesh, marked, to_rgb(EXTENDED), scene.vertical, WIDTH)
    axes.imshow(view.pixels, interpolation="antialiased")
    hidden = ", seen through the parts before it" if marked.any() and view.seen < 0.5 else ""
    points = {n: view.at(np.array(p))[0] for n, p in scene.sensors.items() if not isinstance(p, str)}
    return hidden, {n: (float(x), float(y)) for n, (x, y) in points.items()}


def _network(axes: Axes, network: Network, scene: Scene) -> dict[str, tuple[float, float]]:
    """Draws nodes (bars as squares) and links (of moving contacts dotted); returns where the sensors are, side by side
    on a node."""
    number = {n: k for k, n in enumerate(network.nodes)}
    links = [(number[a], number[b]) for a, b, _ in network.links]
    where = layout(len(network.nodes), links)
    for (a, b), (_, _, moves) in zip(links, network.links, strict=True):
        axes.plot(*where[[a, b]].T, color=DELIVERED, lw=1.2, ls=":" if moves else "-", zorder=1)
    for name, (x, y) in zip(network.nodes, where, strict=True):
        here = name in scene.marked
        axes.scatter(x, y, s=620, marker="s" if name in network.bars else "o", color=EXTENDED if here else "#eceef0",
                     edgecolor=EXTENDED if here else DELIVERED, linewidth=1.4, zorder=2)  # fmt: skip
        axes.annotate(short(name), (x, y), xytext=(0, -21), textcoords="offset points", ha="center", va="top",
                      fontsize=8.5, color=INK, fontweight="bold" if here else "normal", zorder=2)  # fmt: skip
    axes.set_aspect("equal")
    axes.margins(0.12)
    placed: dict[str, tuple[float, float]] = {}
    for k, name in enumerate(network.nodes):
        own = [s for s, node in scene.sensors.items() if node == name]
        for i, sensor in enumerate(own):
            placed[sensor] = (float(where[k, 0]) + 0.09 * (i - (len(own) - 1) / 2), float(where[k, 1]))
    return placed

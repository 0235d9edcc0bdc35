"""The machine's surface coloured by temperature at several times."""

from __future__ import annotations

from dataclasses import dataclass

import matplotlib
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Colormap, Normalize
from matplotlib.figure import Figure

from twin.pictures.raster import Camera, Raster, frame, normals, outline, rasterise, shading
from twin.pictures.style import RC, TEMPERATURE_MAP, figure

_OVERSAMPLING = 2  # pixels per picture pixel and direction: smooth edges


@dataclass(frozen=True)
class SurfaceMesh:
    """The outer surface of all bodies."""

    points: np.ndarray  # (n, 3) m
    triangles: np.ndarray  # (m, 3) indices into points
    group: np.ndarray  # (m,) int, the body or part of each triangle: outlines are drawn between groups


def surface_figure(
    meshes: list[SurfaceMesh],
    temperatures: list[np.ndarray],
    titles: list[str],
    camera: Camera = Camera(),
    title: str = "",
    width: int = 900,
) -> Figure:
    """One panel per (mesh, vertex temperatures (n,) degC, title), one colour scale for all.

    The same mesh object may serve several panels and is then rasterised once; a machine that has moved brings another.
    `width` is the width of a panel in pixels.
    """
    low = min(float(t.min()) for t in temperatures)
    high = max(float(t.max()) for t in temperatures)
    norm = Normalize(low, max(high, low + 0.1))  # below 0.1 K there is nothing to show
    corners = frame(np.vstack([mesh.points for mesh in meshes]), camera)  # one scale for all: motion shows as motion
    panels = []
    views: dict[int, _View] = {}
    for mesh, temperature in zip(meshes, temperatures, strict=True):
        if id(mesh) not in views:
            views[id(mesh)] = _View.of(mesh, camera, width * _OVERSAMPLING, corners)
        panels.append(views[id(mesh)].paint(temperature, norm, TEMPERATURE_MAP))

    with matplotlib.rc_context(RC):
        columns = min(2, len(panels))
        rows = -(-len(panels) // columns)
        aspect = max(p.shape[0] / p.shape[1] for p in panels)
        fig = figure(5.2 * columns + 0.9, 5.2 * aspect * rows + 0.9)
        grid = fig.subplots(rows, columns, squeeze=False)
        for axes in grid.flat:
            axes.set_axis_off()
        for axes, panel, text, temperature in zip(grid.flat, panels, titles, temperatures, strict=False):
            axes.imshow(panel, interpolation="antialiased")
            axes.set_title(text)
            axes.text(
                0.0, 0.985, f"{temperature.min():.1f} to {temperature.max():.1f} °C", transform=axes.transAxes,
                va="top", fontsize=8.5, color="#6a7078",
            )  # fmt: skip
        bar = fig.colorbar(ScalarMappable(norm, TEMPERATURE_MAP), ax=grid, shrink=0.75, aspect=32, pad=0.02)
        bar.set_label("surface temperature in °C")
        bar.outline.set_visible(False)
        if title:
            fig.suptitle(title, x=0.01, ha="left", fontsize=13, fontweight="bold")
    return fig


@dataclass(frozen=True)
class _View:
    """What does not depend on the temperatures."""

    mesh: SurfaceMesh
    raster: Raster
    light: np.ndarray
    edge: np.ndarray

    @classmethod
    def of(cls, mesh: SurfaceMesh, camera: Camera, width: int, corners: np.ndarray) -> _View:
        raster = rasterise(mesh.points, mesh.triangles, camera, width, corners)
        n = normals(mesh.points, mesh.triangles)
        return cls(mesh, raster, shading(raster, n, camera), outline(raster, n, mesh.group, camera))

    def paint(self, temperature: np.ndarray, norm: Normalize, colours: Colormap) -> np.ndarray:
        """(height, width, 3) in 0 .. 1, at the picture's own resolution."""
        field = self.raster.interpolate(self.mesh.triangles, temperature)
        picture = colours(norm(np.nan_to_num(field)))[..., :3] * self.light[..., None]
        picture[self.edge] *= 0.35
        picture[np.isnan(field)] = 1.0
        h, w = (s - s % _OVERSAMPLING for s in field.shape)
        blocks = picture[:h, :w].reshape(h // _OVERSAMPLING, _OVERSAMPLING, w // _OVERSAMPLING, _OVERSAMPLING, 3)
        return blocks.mean(axis=(1, 3))

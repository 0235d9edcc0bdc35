"""Draw coloured triangles with hidden surfaces removed: a z-buffer in numpy.

matplotlib's Poly3DCollection sorts whole polygons by depth: it is slow for 50,000 triangles and wrong where they
overlap in a cycle, as the parts of a machine do. Here each pixel knows its front triangle, so that one pass serves
any number of colourings of the same geometry.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_CHUNK = 4_000_000  # pixels of triangles at a time: bounds the memory to about 200 MB
_EDGE = 1e-9  # pixels by which a triangle is larger than it is: rounding leaves no cracks


@dataclass(frozen=True)
class Camera:
    """Orthographic view. azimuth, elevation [deg] of the viewer's place, `up` what points up."""

    azimuth: float = -55.0
    elevation: float = 24.0
    up: int = 2

    @classmethod
    def from_front(cls, up: int) -> Camera:
        """From the operator's place, to the right and above: ISO 841 has +x to the right, and -y or +z in front."""
        return cls(azimuth=-55.0 if up == 2 else 50.0, up=up)

    def axes(self) -> np.ndarray:
        """Rows right, up, towards the viewer (3, 3), orthonormal."""
        azimuth, elevation = np.deg2rad([self.azimuth, self.elevation])
        planar = [np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation)]
        viewer, vertical = np.zeros(3), np.zeros(3)
        a, b = [(1, 2), (2, 0), (0, 1)][self.up]
        viewer[a], viewer[b], viewer[self.up] = planar[0], planar[1], np.sin(elevation)
        vertical[self.up] = 1.0
        right = np.cross(vertical, viewer)
        right /= np.linalg.norm(right)
        return np.array([right, np.cross(viewer, right), viewer])


@dataclass(frozen=True)
class Raster:
    """What stands in front at each pixel of a (height, width) picture; row 0 is the top."""

    triangle: np.ndarray  # (height, width) int, index of the front triangle, -1 for the background
    weight: np.ndarray  # (height, width, 3) barycentric coordinates in it
    depth: np.ndarray  # (height, width) distance towards the viewer, -inf for the background
    pixel: float  # size of a pixel in model units

    @property
    def covered(self) -> np.ndarray:
        return self.triangle >= 0

    def interpolate(self, triangles: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Vertex values (n_vertices,) at the pixels: (height, width), NaN in the background."""
        picture = np.full(self.triangle.shape, np.nan)
        t = self.triangle[self.covered]
        picture[self.covered] = np.einsum("pk,pk->p", values[triangles[t]], self.weight[self.covered])
        return picture


def frame(points: np.ndarray, camera: Camera, margin: float = 0.02) -> np.ndarray:
    """Lower left and upper right corner (2, 2) of the view of points (n, 3), right and up in model units."""
    view = points @ camera.axes()[:2].T
    low, high = view.min(axis=0), view.max(axis=0)
    border = margin * (high - low).max()
    return np.array([low - border, high + border])


def rasterise(
    points: np.ndarray, triangles: np.ndarray, camera: Camera, width: int, corners: np.ndarray | None = None
) -> Raster:
    """The view of triangles (m, 3) over points (n, 3), `width` pixels wide; the height follows from `corners` (2, 2).

    corners: what `frame` gives, of these points by default; of more than these for pictures to be compared.
    """
    view = points @ camera.axes().T
    low, high = frame(points, camera) if corners is None else corners
    pixel = float((high[0] - low[0]) / width)
    height = int(np.ceil((high[1] - low[1]) / pixel))
    x = (view[:, 0] - low[0]) / pixel - 0.5
    y = (high[1] - view[:, 1]) / pixel - 0.5
    corner = np.stack([x, y, view[:, 2]], axis=1)[triangles]  # (m, 3 corners, 3)

    front = np.full(height * width, -1)
    depth = np.full(height * width, -np.inf)
    rows = _rows(corner, width, height)
    ends = np.cumsum(rows.count)
    for chunk in np.split(np.arange(len(rows.t)), np.searchsorted(ends, np.arange(_CHUNK, rows.count.sum(), _CHUNK))):
        n = rows.count[chunk]
        row = np.repeat(chunk, n)
        px = rows.first[row] + np.arange(len(row)) - np.repeat(np.cumsum(n) - n, n)
        at = rows.y[row] * width + px
        z = rows.z[row] + rows.dz[row] * px
        np.maximum.at(depth, at, z)
        nearest = z == depth[at]
        front[at[nearest]] = rows.t[row[nearest]]
    covered = np.flatnonzero(front >= 0)
    weight = np.zeros((height * width, 3))
    weight[covered] = _barycentric(corner, front[covered], covered % width, covered // width)
    shape = (height, width)
    return Raster(front.reshape(shape), weight.reshape(*shape, 3), depth.reshape(shape), pixel)


@dataclass(frozen=True)
class _Rows:
    """The pixels of triangles, row by row of the picture; each array (r,)."""

    t: np.ndarray  # triangle
    y: np.ndarray
    first: np.ndarray  # pixel from the left
    count: np.ndarray
    z: np.ndarray  # depth at the picture's left border, and its change per pixel
    dz: np.ndarray


def _rows(corner: np.ndarray, width: int, height: int) -> _Rows:
    """Which pixel centres triangles (m, 3 corners, 3) cover; on their edges both triangles have them: no cracks."""
    u, v = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    twice_area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    low = np.clip(np.ceil(corner[:, :, 1].min(axis=1) - _EDGE).astype(int), 0, None)
    high = np.minimum(np.floor(corner[:, :, 1].max(axis=1) + _EDGE).astype(int), height - 1)
    n = np.where(twice_area == 0.0, 0, np.maximum(high - low + 1, 0))  # none of what is seen edge-on
    t = np.repeat(np.arange(len(corner)), n)
    y = low[t] + np.arange(len(t)) - np.repeat(np.cumsum(n) - n, n)
    left, right = np.full(len(t), np.inf), np.full(len(t), -np.inf)
    for k in range(3):
        (ax, ay), (bx, by) = corner[t, k, :2].T, corner[t, (k + 1) % 3, :2].T
        # one that lies along the row ends where the two others do
        crossed = (np.minimum(ay, by) - _EDGE <= y) & (y <= np.maximum(ay, by) + _EDGE) & (ay != by)
        share = np.clip(np.divide(y - ay, by - ay, where=crossed, out=np.zeros(len(t))), 0.0, 1.0)
        x = ax + share * (bx - ax)
        left, right = np.where(crossed, np.minimum(left, x), left), np.where(crossed, np.maximum(right, x), right)
    first = np.clip(np.ceil(np.clip(left, -1.0, width) - _EDGE).astype(int), 0, None)
    last = np.minimum(np.floor(np.clip(right, -1.0, width) + _EDGE).astype(int), width - 1)
    some = last >= first
    t, y, first, last = t[some], y[some], first[some], last[some]
    dx = (u[t, 2] * v[t, 1] - v[t, 2] * u[t, 1]) / twice_area[t]
    dy = (v[t, 2] * u[t, 0] - u[t, 2] * v[t, 0]) / twice_area[t]
    z = corner[t, 0, 2] - dx * corner[t, 0, 0] + dy * (y - corner[t, 0, 1])
    return _Rows(t, y, first, last - first + 1, z, dx)


def _barycentric(corner: np.ndarray, t: np.ndarray, px: np.ndarray, py: np.ndarray) -> np.ndarray:
    """Barycentric coordinates (p, 3) of pixel centres in triangles t."""
    a, b, c = corner[t, 0], corner[t, 1], corner[t, 2]
    twice_area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (c[:, 0] - a[:, 0]) * (b[:, 1] - a[:, 1])
    u = ((b[:, 0] - px) * (c[:, 1] - py) - (c[:, 0] - px) * (b[:, 1] - py)) / twice_area
    v = ((c[:, 0] - px) * (a[:, 1] - py) - (a[:, 0] - px) * (c[:, 1] - py)) / twice_area
    return np.stack([u, v, 1.0 - u - v], axis=1)


def normals(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Unit normals (m, 3) of triangles; zero for degenerate ones."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    n = np.cross(b - a, c - a)
    return n / np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-300)


def shading(raster: Raster, triangle_normals: np.ndarray, camera: Camera) -> np.ndarray:
    """Brightness (height, width) in 0.7 .. 1 under a lamp above the viewer's left shoulder; 1 in the background."""
    lamp = np.array([-0.45, 0.65, 0.62]) @ camera.axes()
    light = np.ones(raster.triangle.shape)
    n = triangle_normals[raster.triangle[raster.covered]]
    facing = np.sign(n @ camera.axes()[2])[:, None]  # winding of the mesh does not matter
    light[raster.covered] = 0.7 + 0.3 * np.clip((n * facing) @ (lamp / np.linalg.norm(lamp)), 0.0, 1.0)
    return light


def outline(raster: Raster, triangle_normals: np.ndarray, group: np.ndarray, camera: Camera) -> np.ndarray:
    """Pixels (height, width) bool where neighbours differ in group (m,), in plane or by a jump in depth."""
    t = raster.triangle
    edge = np.zeros(t.shape, dtype=bool)
    towards = np.abs(triangle_normals @ camera.axes()[2])
    slope = np.sqrt(1.0 - np.minimum(towards, 1.0) ** 2) / np.maximum(towards, 1e-6)  # depth per pixel in the triangle
    right, left = (slice(None), slice(1, None)), (slice(None), slice(None, -1))
    for a, b in ((right, left), ((slice(1, None),), (slice(None, -1),))):
        ta, tb = t[a], t[b]
        both = (ta >= 0) & (tb >= 0)
        bend = np.abs(np.einsum("...k,...k->...", triangle_normals[ta], triangle_normals[tb])) < 0.85
        step = np.abs(np.subtract(raster.depth[a], raster.depth[b], where=both, out=np.zeros(ta.shape)))
        jump = step > raster.pixel * (12.0 + 2.0 * np.maximum(slope[ta], slope[tb]))
        edge[a] |= ((ta >= 0) != (tb >= 0)) | (both & ((group[ta] != group[tb]) | bend | jump))
    return edge

"""Draw coloured triangles with hidden surfaces removed: a z-buffer in numpy.

matplotlib's Poly3DCollection sorts whole polygons by depth: it is slow for 50,000 triangles and wrong where they
overlap in a cycle, as the parts of a machine do. Here each pixel knows its front triangle, so that one pass serves
any number of colourings of the same geometry.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_CHUNK = 4_000_000  # candidate pixels at a time: bounds the memory to about 400 MB


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

    first = np.clip(np.ceil(corner[:, :, :2].min(axis=1)).astype(int), 0, None)
    last = np.minimum(np.floor(corner[:, :, :2].max(axis=1)).astype(int), [width - 1, height - 1])
    extent = np.maximum(last - first + 1, 0)
    count = extent[:, 0] * extent[:, 1]

    front = np.full(height * width, -1)
    weight = np.zeros((height * width, 3))
    depth = np.full(height * width, -np.inf)
    some = np.flatnonzero(count)
    for chunk in np.split(some, np.searchsorted(np.cumsum(count[some]), np.arange(_CHUNK, count.sum(), _CHUNK))):
        if len(chunk) == 0:
            continue
        t = np.repeat(chunk, count[chunk])
        k = np.arange(len(t)) - np.repeat(np.cumsum(count[chunk]) - count[chunk], count[chunk])
        px = first[t, 0] + k % extent[t, 0]
        py = first[t, 1] + k // extent[t, 0]
        bary, inside = _barycentric(corner, t, px, py)
        t, bary, at = t[inside], bary[inside], (py * width + px)[inside]
        z = np.einsum("pk,pk->p", corner[t, :, 2], bary)
        nearer = z > depth[at]
        t, bary, at, z = t[nearer], bary[nearer], at[nearer], z[nearer]
        order = np.argsort(z, kind="stable")  # of several candidates for a pixel the last one written stays
        t, bary, at, z = t[order], bary[order], at[order], z[order]
        front[at], weight[at], depth[at] = t, bary, z
    shape = (height, width)
    return Raster(front.reshape(shape), weight.reshape(*shape, 3), depth.reshape(shape), pixel)


def _barycentric(corner: np.ndarray, t: np.ndarray, px: np.ndarray, py: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Barycentric coordinates (p, 3) of pixel centres in triangles t, and which pixels lie inside."""
    a, b, c = corner[t, 0], corner[t, 1], corner[t, 2]
    twice_area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (c[:, 0] - a[:, 0]) * (b[:, 1] - a[:, 1])
    safe = np.where(twice_area == 0.0, 1.0, twice_area)  # seen edge-on: no pixel
    u = ((b[:, 0] - px) * (c[:, 1] - py) - (c[:, 0] - px) * (b[:, 1] - py)) / safe
    v = ((c[:, 0] - px) * (a[:, 1] - py) - (a[:, 0] - px) * (c[:, 1] - py)) / safe
    bary = np.stack([u, v, 1.0 - u - v], axis=1)
    inside = (twice_area != 0.0) & (bary >= -1e-9).all(axis=1)  # shared edges leave no cracks
    return bary, inside


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

"""The machine's surface in grey with some of its faces marked: where something is, seen from where it shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.pictures.raster import Camera, frame, normals, outline, rasterise, shading
from twin.pictures.surface import SurfaceMesh

AZIMUTHS = (
    -55.0,
    35.0,
    125.0,
    -145.0,
)  # deg from where a machine is looked at: its four upper corners, the usual first
ELEVATIONS = (24.0, -24.0)  # deg; from below only what is not seen from above
COARSE = 160  # pixels of a picture that only counts what is seen
PREFERRED = 0.7  # of the most that any camera sees: what the usual view must show to be taken
OVERSAMPLING = 2  # pixels per picture pixel and direction: smooth edges
PAPER, HIDDEN = 0.93, 0.45  # brightness of what is not marked; strength of a mark behind other parts


@dataclass(frozen=True)
class MarkedView:
    """A picture, and where points of space are in it."""

    pixels: np.ndarray  # (height, width, 4) 0 .. 1, transparent where nothing is
    seen: float  # share of the marked pixels that nothing hides
    camera: Camera
    corners: np.ndarray  # (2, 2) of the view, right and up in m

    def at(self, points: np.ndarray) -> np.ndarray:
        """(n, 2) pixels right and down of points (n, 3) [m]."""
        view = np.atleast_2d(points) @ self.camera.axes()[:2].T
        low, high = self.corners
        scale = self.pixels.shape[1] / (high[0] - low[0])
        return np.stack([(view[:, 0] - low[0]) * scale, (high[1] - view[:, 1]) * scale], axis=1)


def marked_view(mesh: SurfaceMesh, marked: np.ndarray, colour: Sequence[float], up: int, width: int) -> MarkedView:
    """The view in which the marked triangles (m,) bool show best; colour: red, green, blue, 0 .. 1.

    A marked face behind others shines through them: a joint lies between parts, and is in no view.
    """
    camera = best_camera(mesh, marked, up)
    corners = frame(mesh.points, camera, 0.06)
    raster = rasterise(mesh.points, mesh.triangles, camera, width * OVERSAMPLING, corners)
    n = normals(mesh.points, mesh.triangles)
    picture = np.ones((*raster.triangle.shape, 4))
    picture[..., :3] = PAPER * shading(raster, n, camera)[..., None]
    alone = _covered(mesh, marked, camera, width * OVERSAMPLING, corners)
    front = raster.covered & marked[np.maximum(raster.triangle, 0)]
    light = 0.5 + 0.5 * shading(raster, n, camera)[front][:, None]  # half the shadow: orange in shadow is brown
    picture[front, :3] = np.asarray(colour) * light
    behind = alone & ~front
    picture[behind, :3] = (1.0 - HIDDEN) * picture[behind, :3] + HIDDEN * np.asarray(colour)
    picture[outline(raster, n, mesh.group, camera), :3] *= 0.55
    picture[..., 3] = np.where(raster.covered | alone, 1.0, 0.0)
    seen = float(front.sum() / alone.sum()) if alone.any() else 0.0
    return MarkedView(_smoothed(picture), seen, camera, corners)


def best_camera(mesh: SurfaceMesh, marked: np.ndarray, up: int) -> Camera:
    """The usual view if it shows the marked triangles about as well as any, else the one that shows most of them."""
    usual = Camera.from_front(up)
    cameras = [usual]
    for elevation in ELEVATIONS:
        cameras += [Camera(azimuth, elevation, up) for azimuth in AZIMUTHS]
    counts = []
    for camera in cameras:
        raster = rasterise(mesh.points, mesh.triangles, camera, COARSE)
        counts.append(int((raster.covered & marked[np.maximum(raster.triangle, 0)]).sum()) * raster.pixel**2)
    most = max(counts)
    return usual if counts[0] >= PREFERRED * most else cameras[int(np.argmax(counts))]


def _covered(mesh: SurfaceMesh, marked: np.ndarray, camera: Camera, width: int, corners: np.ndarray) -> np.ndarray:
    """Pixels (height, width) bool that the marked triangles would cover if nothing were before them."""
    return np.asarray(rasterise(mesh.points, mesh.triangles[marked], camera, width, corners).covered)


def _smoothed(picture: np.ndarray) -> np.ndarray:
    h, w = (s - s % OVERSAMPLING for s in picture.shape[:2])
    blocks = picture[:h, :w].reshape(h // OVERSAMPLING, OVERSAMPLING, w // OVERSAMPLING, OVERSAMPLING, 4)
    alpha = blocks[..., 3:]
    colour = (blocks[..., :3] * alpha).sum(axis=(1, 3)) / np.maximum(alpha.sum(axis=(1, 3)), 1e-9)
    return np.concatenate([colour, alpha.mean(axis=(1, 3))], axis=-1)

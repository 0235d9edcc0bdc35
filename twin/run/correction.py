"""The correction of a machine at one time: polynomials of the TCP error, and the axis offsets that cancel it.

Paper 001, 1.09 to 1.11: the TCP error at the poses is compressed to a few coefficients, which the control evaluates in
every interpolation cycle; minus the error, transformed to the axes, is added to the nominal positions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import Literal

import numpy as np

from twin.errors import TwinError
from twin.rom.load_model import AxisWiring
from twin.rom.model import MachineModel
from twin.rom.poses import pose_weights
from twin.rom.tcp import by_body, is_exact, tcp_at, tilt_at
from twin.run.correction_axes import offset_matrix, uncorrectable
from twin.run.correction_polynomial import (
    Polynomial,
    design_matrix,
    fit_full,
    fit_product,
    fit_without_constant,
    normalised_axes,
)

Form = Literal["full", "product"]
ALONG_ONE_AXIS = 4  # degree along a single screw, eq (16.2); parabolas over a workspace, eq (16.1)
OVER_WORKSPACE = 2


@dataclass(frozen=True)
class PoseErrors:
    """TCP errors at the poses of a grid at one time."""

    axes: tuple[str, ...]
    grid: tuple[np.ndarray, ...]  # m, positions per axis
    poses: np.ndarray  # (n_poses, n_axes) m, C order over the grid
    tcp: np.ndarray  # (n_poses, 3) m
    model: MachineModel | None = None  # that they are of, with
    state: np.ndarray | None = None  # (N,) its state at that time, where both are known
    angles: tuple[float, ...] = ()  # rad of the rotary axes that turn (`MachineModel.turning`); none: all at zero

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the errors: along x, y, z, or of each strut's length."""
        return ("dx", "dy", "dz") if self.tcp.shape[1] == 3 else self.axes

    def at(self, position: np.ndarray) -> np.ndarray:
        """TCP error (m, 3) [m] at positions (m, n_axes) [m], as `twin run` computes it (`twin.rom.tcp`).

        Interpolated between the poses where the model is not given or has no structure.
        """
        if self.model is not None and self.state is not None and is_exact(self.model):
            return tcp_at(self.model, by_body(self.model, self.state), self.with_angles(position))
        weights, _ = pose_weights(self.grid, position)
        return np.asarray(weights @ self.tcp)

    @property
    def tilt(self) -> np.ndarray | None:
        """(n_poses, 3) [rad] of the tool against the work at the poses; None where the model does not tell it."""
        if self.model is None or self.state is None:
            return None
        return tilt_at(self.model, by_body(self.model, self.state), self.with_angles(self.poses))

    def with_angles(self, position: np.ndarray) -> np.ndarray:
        """Positions (m, n_axes) [m] with the angles [rad] behind them."""
        return np.column_stack([position, np.tile(self.angles, (len(position), 1))]) if self.angles else position

    def turned(self, angles: tuple[float, ...]) -> PoseErrors:
        """The errors with rotary axes at other angles [rad]. Raises ValueError unless model and state are known."""
        there = replace(self, angles=angles)
        if self.model is None or self.state is None or not is_exact(self.model):
            raise ValueError("neither a structure nor a state to compute errors of turned axes by")
        return replace(there, tcp=there.at(self.poses))

    def between(self) -> np.ndarray:
        """Positions (m, n_axes) [m] in the middle of every cell of the grid; single positions stay."""
        middles = [(g[1:] + g[:-1]) / 2 if len(g) > 1 else g for g in self.grid]
        return np.array(list(product(*middles)))


@dataclass(frozen=True)
class Correction:
    """What the control needs: offset = offset_per_error @ polynomial(position), to be added to the position."""

    polynomial: Polynomial  # (dx, dy, dz) m over the axes
    jacobian: np.ndarray  # (3, n_axes) 1: tool minus work per axis motion
    form: Form
    factors: tuple[tuple[np.ndarray, ...], ...] = ()  # product form: [component][axis]

    @cached_property
    def offset_per_error(self) -> np.ndarray:
        """(n_axes, 3)."""
        return offset_matrix(self.jacobian)

    @cached_property
    def _offsets(self) -> Polynomial:
        """The axis offsets themselves as polynomials: linear in the error, so of the same degrees."""
        coefficients = np.tensordot(self.offset_per_error, self.polynomial.coefficients, axes=1)
        return Polynomial(self.polynomial.axes, coefficients)

    def offset(self, position: Sequence[float]) -> np.ndarray:
        """What to add to the nominal position of each axis (n_axes,) [m] at one position [m]: made for the cycle."""
        return self._offsets.at(position)

    def offsets(self, position: np.ndarray) -> np.ndarray:
        """The same for positions (m, n_axes) [m] -> (m, n_axes) [m]."""
        return self._offsets(position)


@dataclass(frozen=True)
class Quality:
    """What a correction leaves, per machine component [m]; (3,) each, or (6,) of struts."""

    before: np.ndarray  # largest error at the poses without correction
    residual: np.ndarray  # largest misfit of the polynomial at the poses
    residual_rms: np.ndarray
    between: np.ndarray  # largest misfit midway between the poses, against what `twin run` computes there
    uncorrectable: np.ndarray  # largest error at the poses in directions that no axis moves in
    after: np.ndarray  # largest error at the poses with the offsets applied
    after_between: np.ndarray  # the same midway between the poses
    condition: float  # of the design matrix: how much rounding may grow in the coefficients
    product_form: (
        np.ndarray
    )  # largest misfit of the product form, eq (16.1) as printed, at the poses, whatever the form
    components: tuple[str, ...] = ("dx", "dy", "dz")  # what each is of
    tilt: np.ndarray | None = None  # rad, largest tilt of the tool against the work: linear axes leave all of it


def default_degrees(errors: PoseErrors) -> tuple[int, ...]:
    """Parabolas over a workspace, the fourth degree along a single axis, less where there are fewer positions."""
    wanted = ALONG_ONE_AXIS if sum(len(g) > 1 for g in errors.grid) == 1 else OVER_WORKSPACE
    return tuple(min(wanted, len(g) - 1) for g in errors.grid)


def fit_correction(
    errors: PoseErrors,
    jacobian: np.ndarray,
    degrees: Sequence[int] | None = None,
    form: Form = "full",
    zero_at: float | None = None,
) -> Correction:
    """Fit the polynomials to the errors at the poses.

    jacobian (3, n_axes) of `axis_jacobian`. degrees: per axis, `default_degrees` if None. zero_at [m]: position along
    the only axis where the error is held at zero (eq 16.2 has no constant); by default a constant is fitted.
    Raises TwinError where the degrees are too high for the poses, or `zero_at` does not fit the axes or the form.
    """
    axes = normalised_axes(errors.axes, errors.poses, degrees or default_degrees(errors))
    if zero_at is not None:
        if len(axes) != 1 or form != "full":
            remedy = "leave --zero-at out" + ("" if form == "full" else ", or write --form full")
            raise TwinError("a polynomial that is zero at a bearing goes along one axis", "--zero-at", remedy)
        if axes[0].degree < 1:
            raise TwinError("degree 0 leaves nothing but the constant", "--degree", "write --degree 4, or less")
        return Correction(fit_without_constant(axes[0], zero_at, errors.poses, errors.tcp), jacobian, form)
    if form == "full":
        return Correction(fit_full(axes, errors.poses, errors.tcp), jacobian, form)
    product_form = fit_product(axes, errors.poses, errors.tcp)
    return Correction(product_form.expanded(), jacobian, form, product_form.factors)


def check_zero(zero_at: float, names: Sequence[str], axes: Sequence[AxisWiring]) -> None:
    """Raises TwinError where `zero_at` [m] lies further than a stroke from the stroke of the only axis.

    A fixed bearing sits beyond the stroke, but not far; a unit slip does.
    names: axes of the poses; several are for `fit_correction` to refuse. axes: those of the machine.
    """
    for axis in axes:
        length = axis.high - axis.low
        if list(names) != [axis.name] or axis.low - length <= zero_at <= axis.high + length:
            continue
        stroke = f"{1e3 * axis.low:g} to {1e3 * axis.high:g} mm"
        what = f"{1e3 * zero_at:g} mm is far outside the stroke of axis '{axis.name}', {stroke}"
        raise TwinError(what, "--zero-at", "write the position of the fixed bearing along the axis, with its unit")


def corrected_error(correction: Correction, errors: PoseErrors, position: np.ndarray) -> np.ndarray:
    """TCP error (m, 3) [m] that stays at nominal positions (m, n_axes) [m] when the offsets are added to them.

    The machine then stands elsewhere and has the error of that place: w(p + a) + J a. That is zero to first order where
    the polynomial meets w(p), and second order in the rest.
    """
    offset = correction.offsets(position)
    return errors.at(position + offset) + offset @ correction.jacobian.T


def quality(correction: Correction, errors: PoseErrors) -> Quality:
    """What the correction leaves at the poses and between them."""
    misfit = errors.tcp - correction.polynomial(errors.poses)
    middles = errors.between()

    def largest(values: np.ndarray) -> np.ndarray:
        return np.abs(values).max(axis=0)

    axes = correction.polynomial.axes
    printed = fit_product(axes, errors.poses, errors.tcp).expanded()
    tilt = errors.tilt
    return Quality(
        before=largest(errors.tcp),
        residual=largest(misfit),
        residual_rms=np.sqrt((misfit**2).mean(axis=0)),
        between=largest(errors.at(middles) - correction.polynomial(middles)),
        uncorrectable=largest(uncorrectable(correction.jacobian, errors.tcp)),
        after=largest(corrected_error(correction, errors, errors.poses)),
        after_between=largest(corrected_error(correction, errors, middles)),
        condition=float(np.linalg.cond(design_matrix(axes, errors.poses))),
        product_form=largest(errors.tcp - printed(errors.poses)),
        components=errors.components,
        tilt=None if tilt is None else largest(tilt),
    )

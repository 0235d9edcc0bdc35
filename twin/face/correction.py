"""Polynomials of the TCP error for the control."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from twin.errors import TwinError
from twin.face.inputs import Quantity, positive, quantity

if TYPE_CHECKING:
    from twin.face.model import Model
    from twin.run.correction import Correction, Quality
    from twin.run.correction_rotary import RotaryCorrection


@dataclass(frozen=True)
class Corrected:
    """A correction that was written, and what it leaves."""

    correction: Correction
    quality: Quality
    axes: tuple[str, ...]
    time: float  # s since the start of the run
    rotary: RotaryCorrection | None = None


@dataclass(frozen=True)
class RotaryOptions:
    """What rotary axes do in a correction."""

    rotary: bool = False  # offsets of theirs besides, which take up tilt about them
    angles: str | None = None  # of those that turn tool or work, "b=30 deg,c=90 deg"; by default zero


def correct(
    model: Model | str | Path,
    result: str | Path,
    output: str | Path,
    time: Quantity | None = None,
    degree: str | None = None,
    form: Literal["full", "product"] = "full",
    zero_at: Quantity | None = None,
    options: RotaryOptions = RotaryOptions(),
) -> Corrected:
    """Compress the TCP error that `twin.run` wrote to the folder `result`, at one time, for the control.

    time: since the start of the run, by default its end. degree: of the polynomial, "2", or "x=4,y=2". form: all
    products of powers, or one factor per axis. zero_at: position of the only axis where the error is held at zero.
    options: what rotary axes do, whose descriptions must have a `point`.
    Raises TwinError for models without a TCP, results of another model, times outside the run, and an output that is no
    correction.
    """
    from twin.atomic import check_file
    from twin.face.model import read
    from twin.face.still import refuse_still
    from twin.run.correction import check_zero, default_degrees, fit_correction, quality
    from twin.run.correction_axes import axis_jacobian
    from twin.run.correction_file import read_pose_errors, write_correction
    from twin.run.correction_rotary import fit_rotary
    from twin.run.correction_struts import in_struts

    wanted = None if time is None else positive("time", time, "s", zero=True)
    zero = None if zero_at is None else quantity("zero_at", zero_at, "m")
    check_file(Path(output))
    _check_output(Path(output))
    loaded = read(model).artefact
    refuse_still(loaded.model)
    errors, at = read_pose_errors(Path(result), loaded.digest, wanted)
    errors = in_struts(replace(errors, model=loaded.model))
    if options.angles is not None:
        errors = errors.turned(_angles(options.angles, loaded.model.turning))
    if zero is not None:
        check_zero(zero, errors.axes, loaded.model.load_model.axes)
    degrees = _degrees(degree, errors.axes, default_degrees(errors))
    correction = fit_correction(errors, axis_jacobian(loaded, errors.axes), degrees, form, zero)
    found = quality(correction, errors)
    facts: dict[str, object] = {
        "machine": loaded.model.name,
        "artefact": loaded.digest,
        "result": str(result),
        "time_s": at,
    }
    if errors.angles:
        facts["angles_rad"] = dict(zip(loaded.model.turning, errors.angles, strict=True))
    turned = fit_rotary(loaded, errors) if options.rotary else None
    write_correction(Path(output), correction, found, facts, turned)
    return Corrected(correction, found, errors.axes, at, turned)


def _check_output(path: Path) -> None:
    """Raises TwinError where `path` is a file that is no correction of this program: it is not for us to replace."""
    from twin.run.correction_file import read_correction

    if not path.exists():
        return
    try:
        read_correction(path)
    except TwinError as e:
        what = "exists and is not a correction of this version, so it is not replaced"
        raise TwinError(what, str(path), "choose another file with -o") from e


def _angles(text: str, turning: tuple[str, ...]) -> tuple[float, ...]:
    """Angles [rad] of the axes `turning` from 'b=30 deg,c=90 deg'. Raises TwinError for other axes and no angles."""
    from twin.nearest import did_you_mean
    from twin.units import to_si

    found = dict.fromkeys(turning, 0.0)
    for item in text.split(","):
        axis, _, value = (part.strip() for part in item.partition("="))
        if axis not in found:
            remedy = did_you_mean(axis, turning, "axes that turn") if turning else "see `point` of a rotary axis"
            raise TwinError(f"no rotary axis '{axis}' turns tool or work", "--angles", remedy)
        try:
            found[axis] = to_si(value, "rad")
        except ValueError as e:
            raise TwinError(f"'{item.strip()}' is no angle: {e}", "--angles", f"write --angles '{axis}=30 deg'") from e
    return tuple(found.values())


def _degrees(text: str | None, axes: tuple[str, ...], default: tuple[int, ...]) -> tuple[int, ...]:
    """Degrees per axis from '2' or 'x=4,y=2'. Raises TwinError for unknown axes and what is no whole number."""
    from twin.nearest import did_you_mean

    if text is None:
        return default
    degrees = dict(zip(axes, default, strict=True))
    for item in text.split(","):
        axis, equals, number = item.strip().rpartition("=")
        value = int(number) if number.strip().isdecimal() and len(number.strip()) < 9 else -1
        if value < 0:
            raise TwinError(f"'{item.strip()}' is no degree", "--degree", "write --degree 2, or --degree x=4,y=2")
        if equals and axis.strip() not in degrees:
            remedy = did_you_mean(axis.strip(), axes, "axes of the poses")
            raise TwinError(f"no axis '{axis.strip()}'", "--degree", remedy)
        degrees |= {axis.strip(): value} if equals else dict.fromkeys(axes, value)
    return tuple(degrees[a] for a in axes)

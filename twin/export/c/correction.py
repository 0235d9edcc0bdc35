"""What a control adds to its axes, as C arrays: how polynomials follow from the TCP displacement at the poses."""

from __future__ import annotations

import numpy as np

from twin.errors import ModelError
from twin.export.c.text import Arrays
from twin.rom.artefact import Artefact
from twin.run.correction import PoseErrors, default_degrees
from twin.run.correction_axes import axis_jacobian, offset_matrix
from twin.run.correction_polynomial import design_matrix, normalised_axes
from twin.run.correction_struts import on_struts


def put_correction(out: Arrays, artefact: Artefact) -> dict[str, int]:
    """Arrays of the correction as `twin correction` fits it by default. Returns how many terms a polynomial has.

    None where no axis can correct anything: no poses along axes, or axes that move neither side of the TCP.
    """
    model = artefact.model
    if on_struts(model):  # what struts correct are errors of their lengths, of which the poses alone do not tell
        return {"TERMS": 0}
    try:
        per_error = offset_matrix(axis_jacobian(artefact, model.pose_axes))
    except ModelError:
        return {"TERMS": 0}
    poses = np.asarray(model.poses)
    errors = PoseErrors(model.pose_axes, model.pose_grid, poses, np.zeros((len(poses), 3)))
    axes = normalised_axes(model.pose_axes, poses, default_degrees(errors))
    matrix = design_matrix(axes, poses)
    out.weights("polynomial_fit", np.linalg.pinv(matrix))
    out.reals("offset_per_error", per_error)
    out.reals("polynomial_centre", [a.centre for a in axes])
    out.reals("polynomial_half_range", [a.half_range for a in axes])
    out.integers("polynomial_degree", [a.degree for a in axes])
    return {"TERMS": matrix.shape[1]}

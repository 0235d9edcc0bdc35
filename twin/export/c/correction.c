/* --- What the control adds to its axes (docs/exports.md, tables of a control): polynomials over the workspace. ------ */

#if TWIN_TERMS > 0
void twin_correction(const twin_machine *m, twin_real *coefficient)
{
    real w[3 * TWIN_POSES], column[TWIN_POSES];
    twin_poses(m, w);
    for (int i = 0; i < TWIN_POSE_AXES * TWIN_TERMS; i++)
        coefficient[i] = 0;
    for (int k = 0; k < 3; k++) {
        for (int p = 0; p < TWIN_POSES; p++)
            column[p] = w[3 * p + k];
        for (int t = 0; t < TWIN_TERMS; t++) {
            const real of_error = product(TWIN_POSES, polynomial_fit + (size_t)t * TWIN_POSES, column);
            for (int a = 0; a < TWIN_POSE_AXES; a++)
                coefficient[a * TWIN_TERMS + t] += offset_per_error[3 * a + k] * of_error;
        }
    }
}

void twin_offsets(const twin_real *coefficient, const twin_real *position, twin_real *offset)
{
    real term[TWIN_TERMS];
    int n = 1;
    term[0] = 1;
    for (int a = 0; a < TWIN_POSE_AXES; a++) { /* the last axis fastest */
        const int own = polynomial_degree[a] + 1;
        const real s = FMIN(FMAX((position[pose_axis[a]] - polynomial_centre[a]) / polynomial_half_range[a], -1), 1);
        for (int i = n - 1; i >= 0; i--) {
            real power = term[i];
            for (int k = 0; k < own; k++, power *= s)
                term[i * own + k] = power;
        }
        n *= own;
    }
    for (int a = 0; a < TWIN_AXES; a++)
        offset[a] = 0;
    for (int a = 0; a < TWIN_POSE_AXES; a++)
        offset[pose_axis[a]] = dot(TWIN_TERMS, coefficient + a * TWIN_TERMS, term);
}
#endif

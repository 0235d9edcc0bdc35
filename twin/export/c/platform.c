#if TWIN_STRUTS /* six struts that carry a platform */
/* --- From strut positions to the pose, and how strut lengths move the tool. In double: lengths close to 1e-12 m. ---- */

typedef struct {
    double shift[3], turn[9];           /* of the platform, as seen from the zero pose */
    double length[6], n[18], lever[18]; /* of the struts: directions, and their joints as seen from the tool centre point */
} platform_pose;

static void place_struts(platform_pose *p)
{
    for (int k = 0; k < 6; k++) {
        double square = 0;
        for (int i = 0; i < 3; i++) {
            const real *joint = platform_joint + 3 * k;
            const double lever = p->turn[3 * i] * joint[0] + p->turn[3 * i + 1] * joint[1] + p->turn[3 * i + 2] * joint[2];
            p->lever[3 * k + i] = lever;
            p->n[3 * k + i] = p->shift[i] + lever - platform_base[3 * k + i];
            square += p->n[3 * k + i] * p->n[3 * k + i];
        }
        p->length[k] = sqrt(square);
        for (int i = 0; i < 3; i++)
            p->n[3 * k + i] /= p->length[k];
    }
}

/* L: change of the lengths per motion of the platform at its tool centre point, by rows or transposed. */
static void strut_lines(const platform_pose *p, int transposed, double *L)
{
    const int across = transposed ? 6 : 1, down = transposed ? 1 : 6;
    for (int k = 0; k < 6; k++)
        for (int i = 0; i < 3; i++) {
            const double *n = p->n + 3 * k, *b = p->lever + 3 * k;
            const int j = (i + 1) % 3, l = (i + 2) % 3;
            L[k * down + i * across] = n[i];
            L[k * down + (i + 3) * across] = b[j] * n[l] - b[l] * n[j];
        }
}

/* x = A^-1 x of six unknowns; 0 where A is singular. A is lost. */
static int solve_six(double *A, double *x)
{
    for (int k = 0; k < 6; k++) {
        int best = k;
        for (int i = k + 1; i < 6; i++)
            if (fabs(A[6 * i + k]) > fabs(A[6 * best + k]))
                best = i;
        if (!(fabs(A[6 * best + k]) > 0))
            return 0;
        for (int j = 0; best != k && j < 7; j++) {
            double *a = j < 6 ? A + 6 * k + j : x + k, *b = j < 6 ? A + 6 * best + j : x + best;
            const double t = *a;
            *a = *b;
            *b = t;
        }
        for (int i = k + 1; i < 6; i++) {
            const double f = A[6 * i + k] / A[6 * k + k];
            for (int j = k; j < 6; j++)
                A[6 * i + j] -= f * A[6 * k + j];
            x[i] -= f * x[k];
        }
    }
    for (int i = 5; i >= 0; i--) {
        for (int j = i + 1; j < 6; j++)
            x[i] -= A[6 * i + j] * x[j];
        x[i] /= A[6 * i + i];
    }
    return 1;
}

/* The pose after a small motion (v, w) of the platform: Rodrigues' formula. */
static platform_pose moved_by(const platform_pose *p, const double *motion)
{
    platform_pose q = *p;
    const double *w = motion + 3, angle = sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
    const double s = angle > 0 ? sin(angle) / angle : 1, c = angle > 0 ? (1 - cos(angle)) / (angle * angle) : 0;
    for (int i = 0; i < 3; i++)
        q.shift[i] += motion[i];
    for (int column = 0; column < 3; column++) {
        const double r[3] = {p->turn[column], p->turn[3 + column], p->turn[6 + column]};
        const double along = w[0] * r[0] + w[1] * r[1] + w[2] * r[2];
        for (int i = 0; i < 3; i++) {
            const int j = (i + 1) % 3, l = (i + 2) % 3;
            q.turn[3 * i + column] = r[i] * (1 - c * angle * angle) + s * (w[j] * r[l] - w[l] * r[j]) + c * along * w[i];
        }
    }
    place_struts(&q);
    return q;
}

static double shortage(const double *wanted, const platform_pose *p, double *by, double *largest)
{
    double square = 0;
    *largest = 0;
    for (int k = 0; k < 6; k++) {
        by[k] = wanted[k] - p->length[k];
        square += by[k] * by[k];
        *largest = fmax(*largest, fabs(by[k]));
    }
    return sqrt(square);
}

/* The pose at strut positions, by Newton's method with steps that are halved until lengths come closer; 0: none found. */
static int pose_at(const real *at, platform_pose *p)
{
    const platform_pose zero = {{0, 0, 0}, {1, 0, 0, 0, 1, 0, 0, 0, 1}, {0}, {0}, {0}};
    double wanted[6], by[6], L[36], largest;
    *p = zero;
    place_struts(p);
    for (int k = 0; k < 6; k++)
        wanted[k] = p->length[k] + at[k];
    double before = shortage(wanted, p, by, &largest);
    for (int step = 0; step < 50; step++) {
        platform_pose tried;
        if (largest <= 1e-12)
            return 1;
        strut_lines(p, 0, L);
        if (!solve_six(L, by))
            return 0;
        for (int halved = 0; halved < 30; halved++) {
            double left[6];
            tried = moved_by(p, by);
            if (shortage(wanted, &tried, left, &largest) < before || before <= 1e-12)
                break;
            for (int i = 0; i < 6; i++)
                by[i] /= 2;
        }
        *p = tried;
        before = shortage(wanted, p, by, &largest);
    }
    return largest <= 1e-12;
}

/* (3, 6): displacement of the tool against the work per length of each strut; 0 where the platform is singular. */
static int tool_per_strut(const platform_pose *p, double *jacobian)
{
    double L[36];
    for (int c = 0; c < 3; c++) {
        double *row = jacobian + 6 * c;
        for (int k = 0; k < 6; k++)
            row[k] = k == c ? platform_sign[0] : 0;
        strut_lines(p, 1, L);
        if (!solve_six(L, row))
            return 0;
    }
    return 1;
}
#endif

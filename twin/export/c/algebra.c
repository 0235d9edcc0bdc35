/* --- Linear algebra: small, dense, by rows. ---------------------------------------------------------------------- */

#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && defined(__gnu_linux__) && !defined(TWIN_PLAIN)
#define QUICK __attribute__((target_clones("avx512f", "avx2", "default"))) /* the processor's own, chosen at start */
#define INSIDE __attribute__((always_inline)) /* compiled once for each of them */
#else
#define QUICK
#define INSIDE
#endif

INSIDE static inline real dot(int n, const real *a, const real *b)
{
    real s[16] = {0}, t = 0;
    int i = 0;
    for (; i + 16 <= n; i += 16)
        for (int j = 0; j < 16; j++)
            s[j] += a[i + j] * b[i + j];
    for (; i < n; i++)
        t += a[i] * b[i];
    for (int j = 0; j < 16; j++)
        t += s[j];
    return t;
}

INSIDE static inline void add(int n, real factor, const real *a, real *y)
{
    for (int i = 0; i < n; i++)
        y[i] += factor * a[i];
}

/* y += A x of a symmetric matrix stored by the rows of its lower triangle, or of a full one. */
QUICK static void multiply(int n, const real *A, const real *x, real *y)
{
#if TWIN_SYMMETRIC
    for (int i = 0; i < n; A += ++i) {
        y[i] += dot(i, A, x) + A[i] * x[i];
        add(i, x[i], A, y);
    }
#else
    for (int i = 0; i < n; i++, A += n)
        y[i] += dot(n, A, x);
#endif
}

QUICK static void add_scaled(int n, real factor, const real *a, real *y)
{
    add(n, factor, a, y);
}

QUICK static real product(int n, const real *a, const real *b)
{
    return dot(n, a, b);
}

#if TWIN_SYMMETRIC || TWIN_STRUCTURE == 1
/* A = L L^T in place, by the rows of the lower triangle; pivot: 1 / L_ii. 0 where A is not positive definite. */
QUICK static int cholesky(int n, real *A, real *pivot)
{
    real *row = A;
    for (int i = 0; i < n; row += ++i) {
        const real *above = A;
        for (int j = 0; j < i; above += ++j)
            row[j] = (row[j] - dot(j, row, above)) * pivot[j];
        const real rest = row[i] - dot(i, row, row);
        if (!(rest > 0))
            return 0;
        row[i] = SQRT(rest);
        pivot[i] = 1 / row[i];
    }
    return 1;
}

/* x = L^-1 x. */
QUICK static void lower(int n, const real *L, const real *pivot, real *x)
{
    for (int i = 0; i < n; L += ++i)
        x[i] = (x[i] - dot(i, L, x)) * pivot[i];
}

/* x = L^-T x. */
QUICK static void upper(int n, const real *L, const real *pivot, real *x)
{
    const real *row = L + (size_t)n * (n + 1) / 2;
    for (int i = n - 1; i >= 0; i--) {
        row -= i + 1;
        x[i] *= pivot[i];
        add(i, -x[i], row, x);
    }
}

#endif

#if !TWIN_SYMMETRIC || TWIN_PAIRS > 0
/* P A = L U in place of a full matrix, L with a unit diagonal; swapped[i]: the row that row i changed places with. */
QUICK static int lu(int n, real *A, int *swapped)
{
    for (int k = 0; k < n; k++) {
        int p = k;
        for (int i = k + 1; i < n; i++)
            if (FABS(A[(size_t)i * n + k]) > FABS(A[(size_t)p * n + k]))
                p = i;
        swapped[k] = p;
        if (!(FABS(A[(size_t)p * n + k]) > 0))
            return 0;
        for (int j = 0; p != k && j < n; j++) {
            const real t = A[(size_t)k * n + j];
            A[(size_t)k * n + j] = A[(size_t)p * n + j];
            A[(size_t)p * n + j] = t;
        }
        for (int i = k + 1; i < n; i++) {
            const real f = A[(size_t)i * n + k] /= A[(size_t)k * n + k];
            if (f != 0)
                add(n - k - 1, -f, A + (size_t)k * n + k + 1, A + (size_t)i * n + k + 1);
        }
    }
    return 1;
}

static void lu_forward(int n, const real *A, const int *swapped, real *x)
{
    for (int i = 0; i < n; i++) {
        const real t = x[i];
        x[i] = x[swapped[i]];
        x[swapped[i]] = t;
    }
    for (int i = 1; i < n; i++)
        x[i] -= product(i, A + (size_t)i * n, x);
}

static void lu_backward(int n, const real *A, real *x)
{
    for (int i = n - 1; i >= 0; i--)
        x[i] = (x[i] - product(n - i - 1, A + (size_t)i * n + i + 1, x + i + 1)) / A[(size_t)i * n + i];
}

#endif

/* --- The two halves of a body's solve: D = left half times right half. ------------------------------------------- */

static int factorise(int b, real *A, real *pivot, int *swapped)
{
#if TWIN_SYMMETRIC
    (void)swapped;
    return cholesky(size[b], A, pivot);
#else
    (void)pivot;
    return lu(size[b], A, swapped);
#endif
}

static void first_half(const twin_machine *m, int b, real *x)
{
#if TWIN_SYMMETRIC
    lower(size[b], m->factor + factor_first[b], m->pivot + first[b], x);
#else
    lu_forward(size[b], m->factor + factor_first[b], m->swapped + first[b], x);
#endif
}

static void second_half(const twin_machine *m, int b, real *x)
{
#if TWIN_SYMMETRIC
    upper(size[b], m->factor + factor_first[b], m->pivot + first[b], x);
#else
    lu_backward(size[b], m->factor + factor_first[b], x);
#endif
}

#if !TWIN_SYMMETRIC && TWIN_PAIRS > 0
/* x = (right half)^-T x. */
static void second_half_transposed(const twin_machine *m, int b, real *x)
{
    const int n = size[b];
    const real *A = m->factor + factor_first[b];
    for (int i = 0; i < n; i++) {
        x[i] /= A[(size_t)i * n + i];
        add_scaled(n - i - 1, -x[i], A + (size_t)i * n + i + 1, x + i + 1);
    }
}
#endif

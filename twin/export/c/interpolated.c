/* Linear between the points of a table, held beyond its ends. */
static inline real interpolated(const real *x, const real *y, int n, real at)
{
    int i = 1;
    if (!(at > x[0]))
        return at == at ? y[0] : at;
    if (at >= x[n - 1])
        return y[n - 1];
    while (x[i] <= at)
        i++;
    return y[i - 1] + (at - x[i - 1]) / (x[i] - x[i - 1]) * (y[i] - y[i - 1]);
}

/* --- One step of the machine: a second-order method of six stages with one factor. ------------------------------- */

static const real stage_weight[6] = TWIN_STAGE_WEIGHTS, stage_ahead[6] = TWIN_STAGE_AHEAD;

#define FOLLOW R(0.2) /* share by which coefficients may leave those in the factor */

typedef struct {
    real mean[TWIN_DRIVEN], conductance[TWIN_MOST(TWIN_PAIRS)], port_heat[TWIN_MOST(TWIN_PORTS)];
    real theta[TWIN_MOST(TWIN_THETA)], rise[TWIN_MOST(TWIN_FILMS)], lift[TWIN_MOST(TWIN_FILMS)];
    real surface[TWIN_MOST(TWIN_FILMS)], radiated[TWIN_MOST(TWIN_FILMS)];
    real film_table[TWIN_MOST(TWIN_FOLLOWING_FILMS)]; /* h read for this step */
    real winding[TWIN_MOST(TWIN_FOLLOWING_LOSSES)];
} loads;

/* Gamma by its entries, and the heat of contacts; 1 where Gamma is not that of the step before. */
static int contacts_of(twin_machine *m, loads *d)
{
    real diagonal[TWIN_MOST(TWIN_PORTS)] = {0}, neighbour[TWIN_MOST(TWIN_PORTS)] = {0};
    real facing[TWIN_MOST(TWIN_FACING)];
    memset(d->port_heat, 0, sizeof d->port_heat);
    for (int k = 0; k < TWIN_PAIRS; k++) {
        const int n = pair_count[k], at = pair_facing[k], port = pair_port[k], a = pair_axis[k];
        const real g = d->conductance[k];
        const real *q = m->under + pair_under[k];
        if (m->low[a] == m->high[a]) { /* at rest in all of the step */
            real power[TWIN_MOST(TWIN_SOURCES)];
            for (int c = 0; c < pair_sources[k]; c++)
                power[c] = d->mean[POWER + pair_source[pair_source_first[k] + c]] / pair_divisor[k];
            memset(m->weight + at, 0, sizeof(real) * (size_t)n);
            memset(m->square + at, 0, sizeof(real) * (size_t)n);
            memset(m->beside + at, 0, sizeof(real) * (size_t)n);
            memset(m->under + pair_under[k], 0, sizeof(real) * (size_t)(n * pair_sources[k]));
            dwell(m, k, way_of(k, m->low[a]), 1, power);
        } else {
            const real part = (real)(1 / m->total);
            for (int i = 0; i < n; i++) {
                m->weight[at + i] *= part;
                m->square[at + i] *= part;
                m->beside[at + i] *= part;
            }
            for (int i = 0; i < n * pair_sources[k]; i++)
                m->under[pair_under[k] + i] *= part;
        }
        for (int i = 0; i < n; i++) {
            diagonal[port + i] += g * m->square[at + i];
            neighbour[port + i] += i < n - 1 ? g * m->beside[at + i] : 0;
            facing[at + i] = g * m->weight[at + i];
        }
        diagonal[pair_pad[k]] += g;
        for (int c = 0; c < pair_sources[k]; c++) {
            const int s = pair_source[pair_source_first[k] + c];
            for (int i = 0; i < n; i++)
                d->port_heat[port + i] += rail_share[s] * q[c * n + i];
            d->port_heat[pair_pad[k]] += (1 - rail_share[s]) * (d->mean[POWER + s] / pair_divisor[k]);
        }
    }
    int changed = 0;
    for (int i = 0; i < TWIN_PORTS; i++)
        changed |= diagonal[i] != m->diagonal[i] || neighbour[i] != m->neighbour[i];
    for (int i = 0; i < TWIN_FACING; i++)
        changed |= facing[i] != m->facing[i];
    if (changed) {
        memcpy(m->diagonal, diagonal, sizeof diagonal);
        memcpy(m->neighbour, neighbour, sizeof neighbour);
        memcpy(m->facing, facing, sizeof facing);
    }
    return changed;
}

static real read_between(real low, real high, real place, int i)
{
    return low + (place - i) * (high - low);
}

/* A film's coefficient where it follows its surface: from the table, or where the loads held all the step at once. */
static real followed_film(const twin_machine *m, const loads *d, int k, real place, int *outside)
{
    const int i = place < 64 ? (int)place : 63, f = following_film[k], exact = place == i;
    if (m->tabulated && !film_alone[k]) {
        const real part = (real)(1 / m->total);
        *outside = m->film_outside[k][(int)place] | m->film_outside[k][place > (int)place ? (int)place + 1 : (int)place];
        return read_between(m->film_base[k][i] + m->film_sum[k][i] * part,
                            m->film_base[k][i + 1] + m->film_sum[k][i + 1] * part, place, i);
    }
    const int e = film_environment[f];
    const real air = film_alone[k] ? d->mean[AIR + e] : m->pending_air[e];
    const real below = air + difference_of(i), above = air + difference_of(i + 1);
    *outside = (place < 64 && !film_law_holds(k, m->pending, below, air)) ||
               (!exact && !film_law_holds(k, m->pending, above, air));
    return read_between(m->film_gain[f] * film_law(k, m->pending, below, air),
                        m->film_gain[f] * film_law(k, m->pending, above, air), place, i);
}

static real followed_loss(const twin_machine *m, int k, real place)
{
    const int i = place < 120 ? (int)place : 119;
    if (m->tabulated) {
        const real part = (real)(1 / m->total);
        return read_between(m->loss_base[k][i] + m->loss_sum[k][i] * part,
                            m->loss_base[k][i + 1] + m->loss_sum[k][i + 1] * part, place, i);
    }
    const real gain = m->source_gain[following_loss[k]];
    return read_between(gain * loss_law(k, m->pending, temperature_of(i)),
                        gain * loss_law(k, m->pending, temperature_of(i + 1)), place, i);
}

/* The air [degC] at the mean height of a film's surfaces, where the axes stand in the mean. */
static real air_at(const loads *d, int f)
{
    real height = film_mean_height[f];
    for (int a = 0; a < TWIN_CLIMBING; a++)
        height += film_climb[a * TWIN_FILMS + f] * d->mean[PLACE + a];
    return d->mean[AIR + film_environment[f]] + film_gradient[f] * (height - film_height[f]);
}

/* Films, their radiation, and what they make of the environments; flags of films and of laws that follow. */
static void films_of(twin_machine *m, loads *d)
{
    for (int f = 0; f < TWIN_FILMS; f++) {
        d->surface[f] = REFERENCE;
        for (int b = 0; b < TWIN_BODIES; b++)
            if (film_row[f][b] >= 0)
                d->surface[f] += product(size[b], film_rows + film_row[f][b], m->z + first[b]) / film_area[f];
        d->theta[f] = d->mean[FILM + f];
    }
    for (int k = 0; k < TWIN_FOLLOWING_FILMS; k++) {
        const int f = following_film[k];
        const real air = air_at(d, f);
        int outside = 0;
        d->theta[f] = followed_film(m, d, k, difference_place(d->surface[f] - air), &outside);
        const real apart = FABS(d->surface[f] - air);
        if (flag_film_law[k] >= 0)
            m->raised[flag_film_law[k]] = (outside && apart > R(0.05)) || apart > 100;
    }
    for (int f = 0; f < TWIN_FILMS; f++) {
        const real at = d->mean[AIR + film_environment[f]], around = d->mean[AIR + film_radiant[f]];
        const real s = d->surface[f] + R(273.15), t = around + R(273.15);
        const real air = air_at(d, f);
        const real radiation = film_emissivity[f] * R(5.670374419e-8) * (s * s + t * t) * (s + t);
        const real at_zero = at - film_gradient[f] * film_height[f], convection = d->theta[f];
        const real total = convection + radiation;
        const real outer = at_zero + radiation / (total > 0 ? total : 1) * (around - at_zero);
        d->theta[f] = total;
        d->rise[f] = outer - REFERENCE;
        d->lift[f] = convection * film_gradient[f];
        d->radiated[f] = radiation * (around - d->surface[f]);
        const int exchanges = FABS(d->surface[f] - air) > R(0.05) ||
                              (film_emissivity[f] > 0 && FABS(d->surface[f] - around) > R(0.05));
        m->raised[flag_film + 2 * f] = exchanges && total < film_low[f] - R(1e-9) * film_high[f];
        m->raised[flag_film + 2 * f + 1] = total > film_high[f] + R(1e-9) * film_high[f];
    }
    for (int j = 0; j < TWIN_JOINTS; j++)
        d->theta[TWIN_FILMS + j] = joint_conductance[j] * (1 + (joint_switched[j] - 1) * d->mean[JOINT + j]);
}

static int add_conduction(twin_machine *m, int b, const real *theta, const real *less, real *S)
{
    const int entries = TWIN_SYMMETRIC ? size[b] * (size[b] + 1) / 2 : size[b] * size[b];
    int any = 0;
    (void)m;
    for (int i = 0; i < term_count[b]; i++) {
        const int k = term[term_first[b] + i];
        const real more = theta[k] - less[k];
        if (more != 0) {
            add_scaled(entries, more, A_of_terms + term_matrix[term_first[b] + i], S);
            any = 1;
        }
    }
    return any;
}

#if TWIN_PORTS > 0
/* P Gamma P^T of one body: tridiagonal on rails, diagonal on pads. Rows of P_in and P_out are ports. */
QUICK static void add_contacts(twin_machine *m, int b, real *S)
{
    const int n = size[b];
    int used[TWIN_MOST(TWIN_PORTS)], count = 0;
    for (int i = 0; i < port_count[b]; i++)
        if (m->diagonal[port[port_first[b] + i]] != 0)
            used[count++] = i;
    real *T = m->work, *Q = m->work + (size_t)n * (size_t)(count ? count : 1);
    for (int c = 0; c < count; c++) {
        const int i = used[c], at = port[port_first[b] + i];
        const real *p = P_in + port_row[b] + (size_t)i * n, *q = P_out + port_row[b] + (size_t)i * n;
        const real before = i > 0 ? m->neighbour[at - 1] : 0, after = i + 1 < port_count[b] ? m->neighbour[at] : 0;
        for (int r = 0; r < n; r++) {
            real t = m->diagonal[at] * p[r];
            if (before != 0)
                t += before * p[r - n];
            if (after != 0)
                t += after * p[r + n];
            T[(size_t)r * count + c] = t;
            Q[(size_t)r * count + c] = q[r];
        }
    }
    for (int r = 0; r < n && count; r++)
        for (int c = 0, last = TWIN_SYMMETRIC ? r + 1 : n; c < last; c++)
            *S++ += dot(count, T + (size_t)r * count, Q + (size_t)c * count);
}

#endif

#if TWIN_PAIRS > 0
/* What couples the bodies is of rank one per pair and direction: S = D - sum a c^T + b d^T (Woodbury). */
static int add_couplings(twin_machine *m)
{
    enum { K = 2 * TWIN_PAIRS };
    for (int k = 0; k < TWIN_PAIRS; k++) {
        const int r = pair_rail_body[k], p = pair_pad_body[k], n = size[r];
        real *a = m->left[2 * k], *b = m->left[2 * k + 1], *c = m->right[2 * k], *d = m->right[2 * k + 1];
        const size_t rail = port_row[r] + (size_t)pair_rail_local[k] * n;
        const size_t pad = port_row[p] + (size_t)pair_pad_local[k] * size[p];
        memset(a, 0, sizeof m->left[0]);
        memset(d, 0, sizeof m->left[0]);
        for (int i = 0; i < pair_count[k]; i++)
            if (m->facing[pair_facing[k] + i] != 0) {
                add_scaled(n, m->facing[pair_facing[k] + i], P_in + rail + (size_t)i * n, a);
                add_scaled(n, m->facing[pair_facing[k] + i], P_out + rail + (size_t)i * n, d);
            }
        memcpy(b, P_in + pad, sizeof(real) * (size_t)size[p]);
        memcpy(c, P_out + pad, sizeof(real) * (size_t)size[p]);
        first_half(m, r, a);
        first_half(m, p, b);
#if TWIN_SYMMETRIC
        memcpy(c, b, sizeof m->left[0]);
        memcpy(d, a, sizeof m->left[0]);
#else
        second_half_transposed(m, p, c);
        second_half_transposed(m, r, d);
#endif
    }
    for (int i = 0; i < K; i++)
        for (int j = 0; j < K; j++) {
            const int of_right = i % 2 ? pair_rail_body[i / 2] : pair_pad_body[i / 2];
            const int of_left = j % 2 ? pair_pad_body[j / 2] : pair_rail_body[j / 2];
            m->small[i * K + j] = (i == j) - (of_right == of_left ? product(size[of_left], m->right[i], m->left[j]) : 0);
        }
    return lu(K, m->small, m->small_swapped);
}
#endif

/* The factor of S = r + A0 + sum theta_k A_k + P Gamma P^T. */
static int new_factor(twin_machine *m, const real *theta, real rate)
{
    for (int b = 0; b < TWIN_BODIES; b++) {
        const int n = size[b];
        real *S = m->factor + factor_first[b];
        memcpy(S, A0 + factor_first[b], sizeof(real) * (size_t)(TWIN_SYMMETRIC ? n * (n + 1) / 2 : n * n));
        add_conduction(m, b, theta, nominal, S);
        for (int i = 0; i < n; i++)
            S[TWIN_SYMMETRIC ? i * (i + 1) / 2 + i : i * n + i] += rate;
#if TWIN_PORTS > 0
        add_contacts(m, b, S);
#endif
        if (!factorise(b, S, m->pivot + first[b], m->swapped + first[b]))
            return 0;
    }
    memcpy(m->held, theta, sizeof m->held);
#if TWIN_PAIRS > 0
    return add_couplings(m);
#else
    return 1;
#endif
}

/* x = S^-1 x by the factor. */
static void solve(const twin_machine *m, real *x)
{
    for (int b = 0; b < TWIN_BODIES; b++)
        first_half(m, b, x + first[b]);
#if TWIN_PAIRS > 0
    enum { K = 2 * TWIN_PAIRS };
    real t[K];
    for (int i = 0; i < K; i++) {
        const int b = i % 2 ? pair_rail_body[i / 2] : pair_pad_body[i / 2];
        t[i] = product(size[b], m->right[i], x + first[b]);
    }
    lu_forward(K, m->small, m->small_swapped, t);
    lu_backward(K, m->small, t);
    for (int i = 0; i < K; i++) {
        const int b = i % 2 ? pair_pad_body[i / 2] : pair_rail_body[i / 2];
        add_scaled(size[b], t[i], m->left[i], x + first[b]);
    }
#endif
    for (int b = 0; b < TWIN_BODIES; b++)
        second_half(m, b, x + first[b]);
}

/* y += the sources' columns of one source by a power. */
static void add_source(int s, real power, real *y)
{
    for (int b = 0; b < TWIN_BODIES; b++)
        if (source_column[s][b] >= 0)
            add_scaled(size[b], power, B_columns + source_column[s][b], y + first[b]);
}

static real winding_of(int k, const real *z)
{
    real T = REFERENCE;
    for (int b = 0; b < TWIN_BODIES; b++)
        if (source_row[k][b] >= 0)
            T += product(size[b], source_rows + source_row[k][b], z + first[b]);
    return T;
}

static void forcing_of(const twin_machine *m, const loads *d, real *y)
{
    (void)m;
    memset(y, 0, sizeof(real) * TWIN_STATES);
    for (int f = 0; f < TWIN_FILMS; f++)
        for (int b = 0; b < TWIN_BODIES; b++) {
            if (film_row[f][b] >= 0)
                add_scaled(size[b], d->theta[f] * d->rise[f], M_columns + film_row[f][b], y + first[b]);
            if (film_row[f][b] >= 0 && d->lift[f] != 0)
                for (int a = 0; a <= TWIN_CLIMBING; a++)
                    add_scaled(size[b], d->lift[f] * (a ? d->mean[PLACE + a - 1] : 1),
                               H_columns + a * film_entries + film_row[f][b], y + first[b]);
        }
    for (int s = 0; s < TWIN_SOURCES; s++)
        if (!follows[s] && d->mean[POWER + s] != 0)
            add_source(s, d->mean[POWER + s], y);
    for (int b = 0; b < TWIN_BODIES; b++)
        for (int i = 0; i < port_count[b]; i++)
            if (d->port_heat[port[port_first[b] + i]] != 0)
                add_scaled(size[b], d->port_heat[port[port_first[b] + i]], P_in + port_row[b] + (size_t)i * size[b],
                           y + first[b]);
}

/* How far the heat balance of a step is off, as a share of what it exchanges. */
static real balance_of(const twin_machine *m, const loads *d, const real *start, const real *own, const real *seen,
                       real power)
{
    real stored = 0, net = power, gross = FABS(power);
    for (int i = 0; i < TWIN_STATES; i++)
        stored += energy[i] * (m->z[i] - start[i]);
    for (int f = 0; f < TWIN_FILMS; f++) {
        real now = 0, before = 0;
        for (int b = 0; b < TWIN_BODIES; b++)
            if (film_row[f][b] >= 0) {
                now += product(size[b], film_rows + film_row[f][b], own + first[b]);
                before += product(size[b], film_rows + film_row[f][b], seen + first[b]);
            }
        real moment = film_moment[f];
        for (int a = 0; a < TWIN_CLIMBING; a++)
            moment += film_moment[(1 + a) * TWIN_FILMS + f] * d->mean[PLACE + a];
        const real heat = d->theta[f] * film_total_area[f] * d->rise[f] + moment * d->lift[f] -
                          (m->held[f] * now + (d->theta[f] - m->held[f]) * before) / TWIN_SUBSTEPS;
        const real radiated = film_area[f] * d->radiated[f];
        net += heat;
        gross += FABS(heat - radiated) + FABS(radiated);
    }
    return FABS(stored - (real)m->step * net) / FMAX((real)m->step * gross, R(1e-6) * HEAT_CAPACITY);
}

static int advance(twin_machine *m, loads *d, int changed)
{
    const real rate = (real)(TWIN_SUBSTEPS / m->step / TWIN_GAMMA);
    int anew = changed || m->steps % 64 == 0, far = 0, any = 0;
    for (int k = 0; k < TWIN_THETA; k++)
        anew |= FABS(d->theta[k] - m->held[k]) > FOLLOW * m->held[k];
    if (anew && !new_factor(m, d->theta, rate))
        return TWIN_SINGULAR;
    for (int k = 0; k < TWIN_THETA; k++) {
        far |= FABS(d->theta[k] - m->held[k]) > FOLLOW / 2 * m->held[k];
        any |= d->theta[k] != m->held[k];
    }

    real *rest = m->work, *forcing = m->work + TWIN_FACTOR, *next = forcing + TWIN_STATES, *after = next + TWIN_STATES;
    real *right = after + TWIN_STATES, *y = right + TWIN_STATES, *earlier = y + TWIN_STATES;
    real *start = earlier + TWIN_STATES, *own = start + TWIN_STATES, *seen = own + TWIN_STATES;
    const size_t bytes = sizeof(real) * TWIN_STATES;
    real power = 0;
    if (any) {
        memset(rest, 0, sizeof(real) * TWIN_FACTOR);
        for (int b = 0; b < TWIN_BODIES; b++)
            add_conduction(m, b, d->theta, m->held, rest + factor_first[b]);
    }
    forcing_of(m, d, forcing);
    for (int s = 0; s < TWIN_SOURCES; s++)
        power += follows[s] ? 0 : d->mean[POWER + s];
    memcpy(start, m->z, bytes);
    memset(own, 0, bytes);
    memset(seen, 0, bytes);
    for (int step = 0; step < TWIN_SUBSTEPS; step++) {
        memcpy(y, m->z, bytes);
        memcpy(earlier, m->z, bytes);
        memcpy(after, m->z, bytes);
        for (int i = 0; i < 6; i++) {
            for (int j = 0; j < TWIN_STATES; j++) {
                right[j] = rate * y[j] + forcing[j];
                next[j] = y[j] + stage_ahead[i] * (y[j] - earlier[j]);
            }
            for (int k = 0; k < TWIN_FOLLOWING_LOSSES; k++) {
                const real q = followed_loss(m, k, temperature_place(winding_of(k, next)));
                add_source(following_loss[k], q, right);
                power += stage_weight[i] * q / TWIN_SUBSTEPS;
            }
            const real *near = y;
            for (int pass = 0; pass < (any && far ? 2 : 1); pass++) {
                real *x = pass ? earlier : next; /* what is earlier has been read */
                const real *state = near;
                memcpy(x, right, bytes);
                for (int b = 0; any && b < TWIN_BODIES; b++) {
                    real *minus = m->work + TWIN_FACTOR + 9 * TWIN_STATES;
                    memset(minus, 0, sizeof(real) * (size_t)size[b]);
                    multiply(size[b], rest + factor_first[b], state + first[b], minus);
                    add(size[b], -1, minus, x + first[b]);
                }
                solve(m, x);
                if (pass == 0 && any && far)
                    near = x;
                else {
                    for (int j = 0; j < TWIN_STATES; j++) {
                        after[j] += stage_weight[i] / TWIN_GAMMA * (x[j] - y[j]);
                        own[j] += stage_weight[i] * x[j];
                        seen[j] += stage_weight[i] * near[j];
                    }
                    memcpy(right, x, bytes);
                }
            }
            memcpy(earlier, y, bytes);
            memcpy(y, right, bytes);
        }
        memcpy(m->z, after, bytes);
    }
    m->balance_error = balance_of(m, d, start, own, seen, power);
    return 0;
}

static void observe(twin_machine *m, const real *mean)
{
    for (int s = 0; s < TWIN_STRUCTURAL; s++)
        m->sensor[s] = REFERENCE + product(size[sensor_body[s]], C_rows + sensor_row[s], m->z + first[sensor_body[s]]);
    for (int s = TWIN_STRUCTURAL; s < TWIN_SENSORS; s++) {
        const int e = sensor_body[s];
        if (mean)
            m->sensor[s] = mean[AIR + e] - environment_offset[e] - mean[SHIFT + e];
    }
}

static int plausible(const twin_machine *m)
{
    for (int i = 0; i < TWIN_STATES; i++)
        if (!(FABS(m->z[i]) < INFINITY))
            return TWIN_NOT_FINITE;
    for (int b = 0; b < TWIN_BODIES; b++) {
        const real heat = product(size[b], energy + first[b], m->z + first[b]);
        if (FABS(heat) > 1000 * product(size[b], energy + first[b], one + first[b]))
            return TWIN_NOT_FINITE;
    }
    for (int s = 0; s < TWIN_STRUCTURAL; s++)
        if (FABS(m->sensor[s] - REFERENCE) > 1000)
            return TWIN_NOT_FINITE;
    return m->balance_error > BALANCE ? TWIN_UNBALANCED : 0;
}

static int outside_grid(const real *at)
{
    int outside = 0;
    for (int a = 0; a < TWIN_POSE_AXES; a++)
        outside |= at[pose_axis[a]] < grid_low[a] - grid_margin[a] || at[pose_axis[a]] > grid_high[a] + grid_margin[a];
    return outside;
}

/* The step under way is complete: its means drive the machine. */
static int complete(twin_machine *m, const real *at)
{
    loads d;
    const real part = (real)(1 / m->total);
    if (m->tabulated)
        tabulate(m);
    for (int i = 0; i < TWIN_DRIVEN; i++)
        d.mean[i] = m->base[i] + m->sum[i] * part;
    for (int k = 0; k < TWIN_PAIRS; k++)
        d.conductance[k] = pair_conductance[k] * (1 + (pair_switched[k] - 1) * d.mean[PAIR + k]);
    const int changed = contacts_of(m, &d);
    films_of(m, &d);
    for (int k = 0; k < TWIN_FOLLOWING_LOSSES; k++) {
        d.winding[k] = winding_of(k, m->z);
        const real place = temperature_place(d.winding[k]);
        if (flag_loss_law[k] >= 0) {
            const int i = (int)place, j = place > i ? i + 1 : i;
            const int outside = m->tabulated ? m->loss_outside[k][i] | m->loss_outside[k][j]
                                             : !loss_law_holds(k, m->pending, temperature_of(i)) ||
                                                   !loss_law_holds(k, m->pending, temperature_of(j));
            m->raised[flag_loss_law[k]] = outside || d.winding[k] < -50 || d.winding[k] > 250;
        }
    }
    const int status = advance(m, &d, changed);
    if (status < 0)
        return status;
    m->steps++;
    m->intervals = 0;
    const int outside = outside_grid(at);
    m->raised[flag_grid] = (unsigned char)(outside | m->outside_before);
    m->outside_before = (unsigned char)outside;
    m->raised[flag_step] = m->step / TWIN_SUBSTEPS < 0.999 * TWIN_SHORTEST;
    m->raised[flag_step + 1] = m->step > 1.001 * TWIN_STEP;
    memcpy(m->flag, m->raised, sizeof m->flag);
    memset(m->raised, 0, sizeof m->raised);
    memcpy(m->position, at, sizeof m->position);
    observe(m, d.mean);
    return plausible(m);
}

void twin_start(twin_machine *m, double temperature, double step)
{
    memset(m, 0, sizeof *m);
    m->step = step;
    memcpy(m->source_gain, source_gain, sizeof source_gain);
    memcpy(m->film_gain, film_gain, sizeof film_gain);
    for (int i = 0; i < TWIN_STATES; i++)
        m->z[i] = ((real)temperature - REFERENCE) * one[i];
    for (int s = 0; s < TWIN_SENSORS; s++)
        m->sensor[s] = (real)temperature;
    observe(m, NULL);
    memcpy(m->position, axis_default, sizeof m->position);
}

int twin_feed(twin_machine *m, double until, const twin_real *signals, const twin_real *position_at_end)
{
    real v[TWIN_MOST(TWIN_SIGNALS)], from[TWIN_MOST(TWIN_AXES)] = {0}, to[TWIN_MOST(TWIN_AXES)] = {0};
    real end[TWIN_MOST(TWIN_AXES)] = {0};
    const double begin = m->fed, small = 1e-9 * m->step;
    const long before = m->steps;
    if (!(until > begin - small))
        return TWIN_BACKWARDS;
    for (int i = 0; i < TWIN_SIGNALS; i++) {
        const real raw = signals[i];
        if (raw == raw)
            v[i] = signal_peak[i] ? signal_factor[i] * raw / SQRT(R(2.0)) : signal_factor[i] * raw;
        else if (m->known[i])
            v[i] = m->last[i];
        else if (signal_default[i] == signal_default[i])
            v[i] = signal_default[i];
        else if (signal_needed[i])
            return TWIN_NO_VALUE;
        else
            v[i] = 0;
        m->raised[flag_missing + i] |= raw != raw;
        m->known[i] |= raw == raw;
        m->last[i] = v[i];
    }
    for (int a = 0; a < TWIN_AXES; a++) {
        const int s = twin_axis_signal[a];
        const real there = position_at_end ? position_at_end[a] : NAN;
        from[a] = v[s];
        end[a] = there == there ? (signal_peak[s] ? signal_factor[s] * there / SQRT(R(2.0)) : signal_factor[s] * there)
                                : v[s];
    }
    if (m->steps == 0 && m->intervals == 0) {
        memcpy(m->position, from, sizeof m->position);
        m->outside_before = (unsigned char)outside_grid(from);
    }
    while (m->fed < until) {
        const double edge = (double)(m->steps + 1) * m->step, until_here = until > edge - small ? edge : until;
        const real part = (real)(until > begin ? (until_here - begin) / (until - begin) : 1);
        for (int a = 0; a < TWIN_AXES; a++)
            to[a] = part >= 1 ? end[a] : v[twin_axis_signal[a]] + part * (end[a] - v[twin_axis_signal[a]]);
        accumulate(m, until_here - m->fed, v, from, to);
        memcpy(from, to, sizeof from);
        m->fed = until_here;
        if (until_here == edge) {
            const int status = complete(m, to);
            if (status < 0)
                return status;
            if (until - m->fed < small)
                break;
        }
    }
    return (int)(m->steps - before);
}

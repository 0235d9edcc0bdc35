/* --- Displacement of the tool centre point. ---------------------------------------------------------------------- */

void twin_poses(const twin_machine *m, twin_real *displacement)
{
    for (int i = 0; i < 3 * TWIN_POSES; i++)
        displacement[i] = product(TWIN_STATES, G_rows + (size_t)i * TWIN_STATES, m->z);
}

#if TWIN_STRUCTURE == 1 /* meshed: springs between elastic ports */

/* The rigid motion of a patch: 6 columns of the displacement at a point along a direction. */
static void motion_at(const real *centroid, const real *point, const real *along, real *columns)
{
    const real x = point[0] - centroid[0], y = point[1] - centroid[1], z = point[2] - centroid[2];
    for (int i = 0; i < 3; i++)
        columns[i] = along[i];
    columns[3] = y * along[2] - z * along[1];
    columns[4] = z * along[0] - x * along[2];
    columns[5] = x * along[1] - y * along[0];
}

static void shift_of(int body, const real *at, real *shift)
{
    for (int i = 0; i < 3; i++) {
        shift[i] = 0;
        for (int a = 0; a < TWIN_POSE_AXES; a++)
            shift[i] += shifts[(body * TWIN_POSE_AXES + a) * 3 + i] * at[a];
    }
}

typedef struct {
    int column[TWIN_WIDEST], count;
    real value[TWIN_WIDEST];
} sparse;

static void put(sparse *row, int column, real value)
{
    row->column[row->count] = column;
    row->value[row->count++] = value;
}

/* Sum of a F b over the ports that two rows touch; F is block diagonal. */
static real through(const sparse *a, const sparse *b)
{
    real sum = 0;
    for (int i = 0; i < a->count; i++)
        for (int j = 0; j < b->count; j++) {
            const int body = port_body[a->column[i]];
            if (body == port_body[b->column[j]]) {
                const int n = ports_of[body];
                sum += a->value[i] * b->value[j] *
                       F[flexibility_first[body] + (size_t)(a->column[i] - port_offset[body]) * (size_t)n +
                         (size_t)(b->column[j] - port_offset[body])];
            }
        }
    return sum;
}

static void gap_rows(const real *at, sparse *J)
{
    for (int s = 0; s < TWIN_SPRINGS; s++)
        J[s].count = 0;
    for (int g = 0; g < TWIN_GUIDES; g++) {
        real pad[3], rail[3], point[3] = {0, 0, 0}, s = 0;
        shift_of(guide_pad_body[g], at, pad);
        shift_of(guide_rail_body[g], at, rail);
        for (int i = 0; i < 3; i++) {
            pad[i] -= rail[i];
            s += (guide_centroid[3 * g + i] + pad[i]) * guide_along[3 * g + i];
        }
        const real *x = guide_station + guide_station_first[g];
        int left = 0;
        while (left < guide_stations[g] - 2 && x[left + 1] <= s)
            left++;
        const real right = FMIN(FMAX((s - x[left]) / (x[left + 1] - x[left]), 0), 1);
        for (int side = 0; side < 2; side++)
            for (int i = 0; i < 3; i++)
                point[i] += (side ? right : 1 - right) * guide_segment[3 * (guide_station_first[g] + left + side) + i];
        for (int i = 0; i < 3; i++)
            point[i] -= pad[i];
        for (int d = 0; d < guide_springs[g]; d++) {
            const int spring = guide_first[g] + d;
            const real *along = spring_direction + 3 * spring;
            real six[6];
            for (int side = 0; side < 2; side++)
                for (int i = 0; i < 3; i++)
                    put(&J[spring], guide_rail[g] + 3 * (left + side) + i, -(side ? right : 1 - right) * along[i]);
            motion_at(guide_centroid + 3 * g, point, along, six);
            for (int i = 0; i < 6; i++)
                put(&J[spring], guide_pad[g] + i, six[i]);
        }
    }
    for (int g = 0; g < TWIN_GROUNDS; g++)
        for (int d = 0; d < ground_springs[g]; d++)
            for (int i = 0; i < 3; i++)
                put(&J[ground_first[g] + d], ground_column[g] + i, spring_direction[3 * (ground_first[g] + d) + i]);
}

static real facing_scale(int e, const real *at, real *offset)
{
    real scale[3], s = 0;
    shift_of(encoder_reader_body[e], at, offset);
    shift_of(encoder_strip_body[e], at, scale);
    for (int i = 0; i < 3; i++) {
        offset[i] -= scale[i];
        s += (encoder_reader_centroid[3 * e + i] + offset[i]) * encoder_along[3 * e + i];
    }
    return s;
}

/* Displacement of the tool minus the work side per port displacement, what linear scales read included. */
static void tool_rows(const real *at, sparse *t)
{
    for (int k = 0; k < 3; k++) {
        const real unit[3] = {k == 0, k == 1, k == 2};
        t[k].count = 0;
        for (int side = 0; side < 2; side++) {
            real tool[3], own[3], point[3], six[6];
            shift_of(tool_body[0], at, tool);
            shift_of(tool_body[side], at, own);
            for (int i = 0; i < 3; i++)
                point[i] = tool_point[i] + tool[i] - own[i];
            motion_at(tool_centroid + 3 * side, point, unit, six);
            for (int i = 0; i < 6; i++)
                put(&t[k], tool_column[side] + i, side ? -six[i] : six[i]);
        }
    }
    for (int e = 0; e < TWIN_ENCODERS; e++) {
        real offset[3], mark[3], six[6];
        const real s = facing_scale(e, at, offset), *along = encoder_along + 3 * e;
        for (int i = 0; i < 3; i++)
            mark[i] = encoder_fixing_point[3 * e + i] + (s - encoder_fixed_at[e]) * along[i] - offset[i];
        motion_at(encoder_reader_centroid + 3 * e, mark, along, six);
        for (int k = 0; k < 3; k++) {
            for (int i = 0; i < 6; i++)
                put(&t[k], encoder_reader[e] + i, encoder_lever[3 * e + k] * six[i]);
            put(&t[k], encoder_fixing[e], -encoder_lever[3 * e + k]);
        }
    }
}

/* Row of the integral of the temperature under a scale from where it is fixed to the reader, times its lever. */
static void scale_rows(const real *at, real *Z)
{
    for (int e = 0; e < TWIN_ENCODERS; e++) {
        real offset[3];
        const real from = encoder_fixed_at[e], to = facing_scale(e, at, offset);
        const real low = FMIN(from, to), high = FMAX(from, to);
        const int slices = strip_slices[e], nodes = strip_nodes[e];
        for (int i = 0; i < slices; i++) {
            const real *border = strip_border + strip_border_first[e];
            const real a = i == 0 ? low : FMIN(FMAX(border[i], low), high);
            const real b = i == slices - 1 ? high : FMIN(FMAX(border[i + 1], low), high);
            const real length = b - a, about = length * ((a + b) / 2 - strip_centre[strip_border_first[e] + i]);
            for (int n = 0; n < nodes; n++) {
                const size_t entry = (size_t)strip_entry_first[e] + (size_t)(i * nodes + n);
                const real row = (to >= from ? 1 : -1) * (length * strip_mean[entry] + about * strip_slope[entry]);
                for (int k = 0; k < 3; k++)
                    Z[k * TWIN_INPUTS + strip_input[strip_input_first[e] + n]] -=
                        encoder_lever[3 * e + k] * encoder_expansion[e] * row;
            }
        }
    }
}

static void added_scales(const real *at, real *Z)
{
    for (int e = 0; e < TWIN_SCALES; e++)
        for (int i = 0; i < scale_states[e]; i++)
            for (int k = 0; k < 3; k++)
                Z[k * TWIN_INPUTS + scale_input[scale_first[e] + i]] +=
                    -scale_expansion[e] * (at[scale_axis[e]] - scale_fixed_at[e]) * scale_along[3 * e + k] *
                    scale_mean[scale_first[e] + i];
}

/* TCP rows over the elastic inputs: one dense system of the size of the springs (`docs/artefact.md`, structure). */
static int rows_of(twin_machine *m, const real *at, real *Z)
{
    enum { S = TWIN_SPRINGS, A = 6 * TWIN_BODIES };
    sparse J[TWIN_MOST(S)], t[3];
    real *K = m->work, *pivot = K + S * (S + 1) / 2, *B = pivot + S, *f = B + S * A, *stiff = f + 3 * S;
    real *turn = stiff + A * (A + 1) / 2, *a = turn + A;
    gap_rows(at, J);
    tool_rows(at, t);
    for (int i = 0; i < S; i++) {
        for (int j = 0; j <= i; j++)
            K[i * (i + 1) / 2 + j] = through(&J[i], &J[j]) + (i == j ? 1 / stiffness[i] : 0);
        for (int k = 0; k < 3; k++)
            f[k * S + i] = -through(&J[i], &t[k]);
        for (int c = 0; c < A; c++)
            B[c * S + i] = 0;
        for (int j = 0; j < J[i].count; j++)
            for (int c = 0; c < 6; c++)
                B[(6 * port_body[J[i].column[j]] + c) * S + i] += J[i].value[j] * motion[6 * J[i].column[j] + c];
    }
    if (S > 0 && !cholesky(S, K, pivot))
        return 0;
    for (int c = 0; c < A; c++)
        lower(S, K, pivot, B + c * S);
    for (int c = 0; c < A; c++)
        for (int k = 0; k <= c; k++)
            stiff[c * (c + 1) / 2 + k] = product(S, B + c * S, B + k * S);
    if (!cholesky(A, stiff, turn))
        return 0;
    memset(Z, 0, sizeof(real) * 3 * TWIN_INPUTS);
    for (int k = 0; k < 3; k++) {
        real *g = f + k * S;
        lower(S, K, pivot, g);
        for (int c = 0; c < A; c++)
            a[c] = -product(S, B + c * S, g);
        for (int j = 0; j < t[k].count; j++)
            for (int c = 0; c < 6; c++)
                a[6 * port_body[t[k].column[j]] + c] -= t[k].value[j] * motion[6 * t[k].column[j] + c];
        lower(A, stiff, turn, a);
        upper(A, stiff, turn, a);
        for (int c = 0; c < A; c++)
            add_scaled(S, a[c], B + c * S, g);
        upper(S, K, pivot, g);
        for (int j = 0; j < t[k].count; j++)
            Z[k * TWIN_INPUTS + port_input[t[k].column[j]]] += t[k].value[j];
        for (int i = 0; i < S; i++)
            for (int j = 0; j < J[i].count; j++)
                Z[k * TWIN_INPUTS + port_input[J[i].column[j]]] += g[i] * J[i].value[j];
    }
    scale_rows(at, Z);
    added_scales(at, Z);
    return 1;
}
#endif

#if TWIN_STRUCTURE == 2 /* lumped: constant rows, screws that grow to their nuts, struts, scales */

/* What a screw adds to Z by its growth from start to end, `factor` times along a direction. */
static void add_growth(int s, real start, real end, real factor, const real *direction, real *Z)
{
    const real *border = screw_border + screw_border_first[s];
    for (int i = 0; i < screw_borders[s] - 1; i++) {
        const real low = FMIN(FMAX(start, border[i]), border[i + 1]);
        const real high = FMIN(FMAX(end, border[i]), border[i + 1]), length = high - low;
        const real right = length * ((low + high) / 2 - border[i]) / (border[i + 1] - border[i]);
        for (int k = 0; k < 3; k++) {
            const real growth = factor * screw_expansion[s] * direction[k];
            Z[k * TWIN_INPUTS + screw_input[s] + i] += growth * (length - right);
            Z[k * TWIN_INPUTS + screw_input[s] + i + 1] += growth * right;
        }
    }
}

static int rows_of(twin_machine *m, const real *at, real *Z)
{
    (void)m;
    (void)at;
    memcpy(Z, constant_rows, sizeof(real) * 3 * TWIN_INPUTS);
#if TWIN_STRUTS
    platform_pose pose;
    double jacobian[18];
    if (!pose_at(at, &pose) || !tool_per_strut(&pose, jacobian))
        return 0;
    for (int c = 0; c < 3; c++) {
        real *row = Z + c * TWIN_INPUTS;
        double moving = 0, frame = 0;
        for (int k = 0; k < 6; k++)
            for (int i = 0; i < 3; i++) {
                const double along = jacobian[6 * c + k] * pose.n[3 * k + i];
                moving -= along * pose.lever[3 * k + i];
                frame += along * (platform_base[3 * k + i] - platform_ground[i]);
            }
        for (int e = 0; e < TWIN_GROWTHS; e++)
            row[growth_input[e]] += (real)(jacobian[6 * c + growth_strut[e]] * growth_rate[e]);
        for (int e = 0; e < TWIN_MOVING; e++)
            row[moving_input[e]] += (real)(moving * moving_spread[e]);
        for (int e = 0; e < TWIN_FRAME; e++)
            row[frame_input[e]] += (real)(frame * frame_spread[e]);
    }
#endif
    for (int s = 0; s < TWIN_SCREWS; s++) {
        const real *border = screw_border + screw_border_first[s], end = border[screw_borders[s] - 1];
        const real nut = FMIN(FMAX(screw_nut[s] + screw_per_position[s] * at[screw_axis[s]], border[0]), end);
#if TWIN_STRUTS
        real direction[3];
        for (int c = 0; c < 3; c++)
            direction[c] = (real)(strut_along[s] * jacobian[6 * c + s]);
#else
        const real *direction = screw_direction + 3 * s;
#endif
        if (screw_held_at_both[s]) {
            add_growth(s, border[0], nut, 1, direction, Z);
            add_growth(s, border[0], end, -(nut - border[0]) / (end - border[0]), direction, Z);
        } else if (screw_from_end[s])
            add_growth(s, nut, end, -1, direction, Z);
        else
            add_growth(s, border[0], nut, 1, direction, Z);
    }
    for (int e = 0; e < TWIN_SCALES; e++)
        for (int i = 0; i < scale_states[e]; i++)
            for (int k = 0; k < 3; k++)
                Z[k * TWIN_INPUTS + scale_input[scale_first[e] + i]] +=
                    -scale_expansion[e] * (at[scale_axis[e]] - scale_fixed_at[e]) * scale_along[3 * e + k] *
                    scale_mean[scale_first[e] + i];
    return 1;
}
#endif

#if TWIN_STRUCTURE == 0 /* none: interpolated between the poses */

/* Lagrange polynomials over a window of nodes, all of them up to seven, else the four nearest. */
static void axis_weights(int a, real s, real *weight)
{
    const real *x = grid + grid_first[a];
    const int n = grid_count[a], width = n <= 7 ? n : 4;
    int cell = 0;
    while (cell < n - 2 && x[cell + 1] <= s)
        cell++;
    int begin = cell - (width - 2) / 2;
    begin = begin < 0 ? 0 : (begin > n - width ? n - width : begin);
    for (int i = 0; i < n; i++)
        weight[i] = 0;
    for (int i = begin; i < begin + width; i++) {
        weight[i] = 1;
        for (int j = begin; j < begin + width; j++)
            if (j != i)
                weight[i] *= (s - x[j]) / (x[i] - x[j]);
    }
}
#endif

int twin_tcp(twin_machine *m, twin_real displacement[3])
{
    real at[TWIN_MOST(TWIN_POSE_AXES)];
    for (int k = 0; k < 3; k++)
        displacement[k] = 0;
    for (int a = 0; a < TWIN_POSE_AXES; a++)
        at[a] = FMIN(FMAX(m->position[pose_axis[a]], grid_low[a]), grid_high[a]);
#if TWIN_STRUCTURE
    int there = m->has_rows;
    for (int a = 0; a < TWIN_POSE_AXES; a++)
        there &= m->rows_at[a] == at[a];
    if (!there) {
        m->has_rows = 0;
        if (!rows_of(m, at, m->rows))
            return TWIN_SINGULAR;
        for (int a = 0; a < TWIN_POSE_AXES; a++)
            m->rows_at[a] = at[a];
        m->has_rows = 1;
    }
    for (int b = 0; b < TWIN_BODIES; b++)
        for (int i = 0; i < input_count[b]; i++) {
            const real h = product(size[b], W_rows + input_row[b] + (size_t)i * (size_t)size[b], m->z + first[b]);
            for (int k = 0; k < 3; k++)
                displacement[k] += m->rows[k * TWIN_INPUTS + input_first[b] + i] * h;
        }
#elif TWIN_POSES > 0
    real weight[TWIN_MOST(TWIN_POSE_AXES)][TWIN_MOST(TWIN_GRID)];
    for (int a = 0; a < TWIN_POSE_AXES; a++)
        axis_weights(a, at[a], weight[a]);
    for (int p = 0; p < TWIN_POSES; p++) {
        real w = 1;
        int rest = p;
        for (int a = TWIN_POSE_AXES - 1; a >= 0; a--) {
            w *= weight[a][rest % grid_count[a]];
            rest /= grid_count[a];
        }
        for (int k = 0; w != 0 && k < 3; k++)
            displacement[k] += w * product(TWIN_STATES, G_rows + (size_t)(3 * p + k) * TWIN_STATES, m->z);
    }
#endif
    return 0;
}

/* --- What the log drives the machine with: means over a step, tables of laws that follow a temperature. ----------- */

enum { POWER = 0, FILM = TWIN_SOURCES, AIR = FILM + TWIN_FILMS, SHIFT = AIR + TWIN_ENVIRONMENTS,
       JOINT = SHIFT + TWIN_ENVIRONMENTS, PAIR = JOINT + TWIN_JOINTS, PLACE = PAIR + TWIN_PAIRS };

static real difference_of(int i)
{
    const real part = (real)(i - 32) / 32;
    return (i < 32 ? -1 : 1) * part * part * part * part * 100;
}

static real temperature_of(int i)
{
    return -50 + R(2.5) * i;
}

/* Place of a surface minus air [K] in a table of 65, held at its ends. */
static real difference_place(real difference)
{
    const real large = FMAX(FABS(difference), R(1e-6));
    const real place = 32 * (1 + difference / large * SQRT(SQRT(large / 100)));
    return FMIN(FMAX(place, 0), 64);
}

static real temperature_place(real temperature)
{
    return FMIN(FMAX((temperature + 50) / R(2.5), 0), 120);
}

static real clipped(real value)
{
    return FMIN(FMAX(value, 0), 1);
}

static int same_loads(const twin_machine *m, const real *v, const real *air)
{
    for (int i = 0; i < TWIN_SIGNALS; i++)
        if (is_followed[i] && v[i] != m->pending[i])
            return 0;
    for (int e = 0; e < TWIN_ENVIRONMENTS; e++)
        if (air[e] != m->pending_air[e])
            return 0;
    return 1;
}

/* A law's table is made anew only where what the law reads has changed: one power in a film costs as much as ten rows of
   a matrix. 1 where it must be. */
static int read_anew(int count, const int *signal, const real *v, real air, real *known, unsigned char *made)
{
    int anew = !*made || known[0] != air;
    for (int i = 0; i < count; i++)
        anew |= known[i + 1] != v[signal[i]];
    known[0] = air;
    for (int i = 0; i < count; i++)
        known[i + 1] = v[signal[i]];
    *made = 1;
    return anew;
}

/* The mean of a table over the step: its first one, and what later ones add to it. */
static void add_table(int first, int n, real gain, real time, const real *now, const unsigned char *off, real *base,
                      real *sum, unsigned char *outside)
{
    for (int i = 0; i < n; i++) {
        const real value = gain * now[i];
        if (first)
            base[i] = value;
        sum[i] = first ? 0 : sum[i] + (value - base[i]) * time;
        outside[i] = (unsigned char)((first ? 0 : outside[i]) | off[i]);
    }
}

/* The tables with the loads that are pending, for their time. */
static void tabulate(twin_machine *m)
{
    const int first = !m->tabulated;
    const real time = (real)m->pending_time, *v = m->pending;
    for (int k = 0; k < TWIN_FOLLOWING_FILMS; k++) {
        if (film_alone[k])
            continue;
        const int f = following_film[k];
        const real air = m->pending_air[film_environment[f]];
        if (read_anew(film_reads[k], film_signal[k], v, air, m->film_known[k], &m->film_made[k]))
            for (int i = 0; i < 65; i++) {
                m->film_now[k][i] = film_law(k, v, air + difference_of(i), air);
                m->film_off[k][i] = (unsigned char)!film_law_holds(k, v, air + difference_of(i), air);
            }
        add_table(first, 65, m->film_gain[f], time, m->film_now[k], m->film_off[k], m->film_base[k], m->film_sum[k],
                  m->film_outside[k]);
    }
    for (int k = 0; k < TWIN_FOLLOWING_LOSSES; k++) {
        if (read_anew(loss_reads[k], loss_signal[k], v, 0, m->loss_known[k], &m->loss_made[k]))
            for (int i = 0; i < 121; i++) {
                m->loss_now[k][i] = loss_law(k, v, temperature_of(i));
                m->loss_off[k][i] = (unsigned char)!loss_law_holds(k, v, temperature_of(i));
            }
        add_table(first, 121, m->source_gain[following_loss[k]], time, m->loss_now[k], m->loss_off[k], m->loss_base[k],
                  m->loss_sum[k], m->loss_outside[k]);
    }
    m->tabulated = 1;
}

/* Weights of the stations of a pair's rail at a coordinate: index of the left one, weight of the right one. */
static int facing_at(int k, real s, real *right)
{
    const real *x = station + pair_station[k];
    const int n = pair_count[k];
    int i = 0;
    if (pair_by_segment[k]) {
        while (i < n - 1 && (x[i] + x[i + 1]) / 2 < s)
            i++;
        *right = 0;
        return i;
    }
    while (i < n - 2 && x[i + 1] <= s)
        i++;
    *right = clipped((s - x[i]) / (x[i + 1] - x[i]));
    return i;
}

/* Add a pad at one coordinate for a time [s], with the heat [W] of its sources in contact_power. */
static void dwell(twin_machine *m, int k, real s, real time, const real *contact_power)
{
    real right;
    const int i = facing_at(k, s, &right), at = pair_facing[k] + i, n = pair_count[k];
    const real left = 1 - right;
    m->weight[at] += time * left;
    m->square[at] += time * left * left;
    for (int c = 0; c < pair_sources[k]; c++)
        m->under[pair_under[k] + c * n + i] += time * contact_power[c] * left;
    if (right > 0) {
        m->weight[at + 1] += time * right;
        m->square[at + 1] += time * right * right;
        m->beside[at] += time * left * right;
        for (int c = 0; c < pair_sources[k]; c++)
            m->under[pair_under[k] + c * n + i + 1] += time * contact_power[c] * right;
    }
}

/* A pad that moves straight from one coordinate to another; between two stations two points are exact (Gauss). */
static void sweep(twin_machine *m, int k, real from, real to, real time, const real *contact_power)
{
    const real *x = station + pair_station[k];
    const int n = pair_count[k], cuts = pair_by_segment[k] ? n - 1 : n;
    const real low = FMIN(from, to), high = FMAX(from, to);
    if (from == to) {
        dwell(m, k, from, time, contact_power);
        return;
    }
    real a = low;
    for (int c = 0; c <= cuts; c++) {
        const real border = c == cuts ? high : (pair_by_segment[k] ? (x[c] + x[c + 1]) / 2 : x[c]);
        const real b = FMIN(border, high);
        if (b <= a)
            continue;
        const real part = time * R(0.5) * (b - a) / (high - low), beside = R(0.28867513459481287) * (b - a);
        dwell(m, k, (a + b) / 2 - beside, part, contact_power);
        dwell(m, k, (a + b) / 2 + beside, part, contact_power);
        a = b;
    }
}

static real way_of(int k, real position)
{
    return pair_at[k] + pair_sign[k] * position;
}

static void raise_bounds(twin_machine *m, int flag, real value, real lowest, real highest, real margin)
{
    m->raised[flag] |= value < lowest - margin;
    m->raised[flag + 1] |= value > highest + margin;
}

/* One interval of the step under way: signals v that hold, axes that move from `from` to `to`. */
static void accumulate(twin_machine *m, double time, const real *v, const real *from, const real *to)
{
    real now[TWIN_DRIVEN];
    memset(now, 0, sizeof now);
    laws_of_log(m, v, now + POWER, now + FILM);
    for (int e = 0; e < TWIN_ENVIRONMENTS; e++) {
        const int s = environment_signal[e], w = environment_switch[e];
        now[SHIFT + e] = w < 0 ? 0 : environment_switched[e] * v[w];
        now[AIR + e] = (s < 0 ? environment_temperature[e] : v[s]) + environment_offset[e] + now[SHIFT + e];
    }
    for (int j = 0; j < TWIN_JOINTS; j++)
        now[JOINT + j] = joint_switch[j] < 0 ? 0 : clipped(v[joint_switch[j]]);
    for (int k = 0; k < TWIN_PAIRS; k++)
        now[PAIR + k] = pair_switch[k] < 0 ? 0 : clipped(v[pair_switch[k]]);
    for (int a = 0; a < TWIN_AXES; a++)
        now[PLACE + a] = (from[a] + to[a]) / 2;

    const int begins = m->intervals++ == 0;
    if (begins) {
        memcpy(m->base, now, sizeof now);
        memset(m->sum, 0, sizeof m->sum);
        memset(m->weight, 0, sizeof m->weight);
        memset(m->square, 0, sizeof m->square);
        memset(m->beside, 0, sizeof m->beside);
        memset(m->under, 0, sizeof m->under);
        m->total = 0;
        m->tabulated = 0;
    } else
        for (int i = 0; i < TWIN_DRIVEN; i++)
            m->sum[i] += (now[i] - m->base[i]) * (real)time;
    m->total += time;
    if (begins || !same_loads(m, v, now + AIR)) {
        if (!begins)
            tabulate(m);
        memcpy(m->pending, v, sizeof m->pending);
        memcpy(m->pending_air, now + AIR, sizeof m->pending_air);
        m->pending_time = 0;
    }
    m->pending_time += time;

    for (int a = 0; a < TWIN_AXES; a++) {
        const real lowest = FMIN(from[a], to[a]), highest = FMAX(from[a], to[a]);
        m->low[a] = begins ? lowest : FMIN(m->low[a], lowest);
        m->high[a] = begins ? highest : FMAX(m->high[a], highest);
        m->raised[flag_stroke + a] |= lowest < axis_low[a] - axis_margin[a] || highest > axis_high[a] + axis_margin[a];
    }
    for (int k = 0; k < TWIN_PAIRS; k++) {
        real contact_power[TWIN_MOST(TWIN_SOURCES)];
        const real s = way_of(k, from[pair_axis[k]]), e = way_of(k, to[pair_axis[k]]);
        const real *x = station + pair_station[k];
        for (int c = 0; c < pair_sources[k]; c++)
            contact_power[c] = now[POWER + pair_source[pair_source_first[k] + c]] / pair_divisor[k];
        sweep(m, k, s, e, (real)time, contact_power);
        m->raised[flag_rail + k] |= FMIN(s, e) < x[0] - pair_margin[k] ||
                                    FMAX(s, e) > x[pair_count[k] - 1] + pair_margin[k];
    }
    for (int a = 0; a < TWIN_TURNS; a++) /* TCP rows are those at zero; rad, twin.rom.turning.STRAIGHT */
        m->raised[flag_turn + a] |= FABS(v[turn_signal[a]]) > R(1e-6);
    for (int i = 0; i < TWIN_SIGNALS; i++)
        raise_bounds(m, flag_signal + 2 * i, v[i], signal_low[i], signal_high[i], signal_margin[i]);
    laws_hold(v, m->raised);
}

/* --- What the process beside the machine calls: rows of a log, whose values hold until the next one. -------------- */

typedef struct {
    double at;                               /* s, of the row that waits */
    int has;
    twin_real row[TWIN_MOST(TWIN_SIGNALS)];  /* SI, as logged; NAN: no value */
    twin_machine m;
} twin_live;

size_t twin_live_size(void) { return sizeof(twin_live); }
size_t twin_live_saved(void) { return offsetof(twin_live, m) + TWIN_SAVED; }

void twin_live_start(twin_live *l, double temperature, double step)
{
    memset(l, 0, sizeof *l);
    twin_start(&l->m, temperature, step);
}

/* Rows of TWIN_SIGNALS values at increasing times [s]. How many steps were completed, or an error below zero. */
int twin_live_feed(twin_live *l, int rows, const double *time, const twin_real *values)
{
    int steps = 0;
    for (int i = 0; i < rows; i++) {
        const twin_real *row = values + (size_t)i * TWIN_SIGNALS;
        if (l->has) {
            twin_real end[TWIN_MOST(TWIN_AXES)];
            for (int a = 0; a < TWIN_AXES; a++)
                end[a] = row[twin_axis_signal[a]];
            const int done = twin_feed(&l->m, time[i], l->row, end);
            if (done < 0)
                return done;
            steps += done;
        }
        memcpy(l->row, row, sizeof l->row);
        l->at = time[i];
        l->has = 1;
    }
    return steps;
}

long twin_live_steps(const twin_live *l) { return l->m.steps; }
double twin_live_balance(const twin_live *l) { return l->m.balance_error; }
const twin_real *twin_live_sensors(const twin_live *l) { return l->m.sensor; }
const twin_real *twin_live_states(const twin_live *l) { return l->m.z; }
int twin_live_state_count(void) { return TWIN_STATES; }
const unsigned char *twin_live_flags(const twin_live *l) { return l->m.flag; }
void twin_live_poses(const twin_live *l, twin_real *displacement) { twin_poses(&l->m, displacement); }

/* What offsets are made of, at all poses: TCP displacements, or by how much the struts of a platform are too long. */
void twin_live_errors(const twin_live *l, twin_real *error)
{
#if TWIN_STRUTS
    for (int i = 0; i < TWIN_STRUTS * TWIN_POSES; i++)
        error[i] = product(TWIN_STATES, strut_errors + (size_t)i * TWIN_STATES, l->m.z);
#else
    twin_poses(&l->m, error);
#endif
}

/* A state that was saved by the same program. */
void twin_live_restore(twin_live *l, const void *saved)
{
    memset(l, 0, sizeof *l);
    memcpy(l, saved, offsetof(twin_live, m) + TWIN_SAVED);
}

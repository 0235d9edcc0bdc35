/* One thermo-elastic machine as plain C99: temperatures and displacement of the tool centre point from logged signals.

   No heap, no files, no state outside twin_machine. A twin_machine is plain data: copy it to keep a state, write its
   first TWIN_SAVED bytes to store it (same program, same processor).

       static twin_machine m;
       twin_start(&m, 22.0, 60.0);                        degC of the whole machine, s per step
       for each row of the log: twin_feed(&m, time of the next row, values of this row, positions of the next row);
       m.sensor, twin_tcp(&m, w), twin_poses(&m, w)       after as many steps as are complete

   Signals hold from row to row, axes move straight. All values SI, temperatures degC. */

typedef struct {
    /* may be set after twin_start: factors of losses and of convection */
    twin_real source_gain[TWIN_MOST(TWIN_SOURCES)];
    twin_real film_gain[TWIN_MOST(TWIN_FILMS)];

    /* results of the last complete step */
    twin_real sensor[TWIN_MOST(TWIN_SENSORS)];    /* degC, in the order of twin_sensor_name */
    unsigned char flag[TWIN_MOST(TWIN_FLAGS)];    /* 1: outside what was certified, in the order of twin_flag_name */
    twin_real balance_error;                      /* of the step's heat balance, as a share of the throughput */
    twin_real position[TWIN_MOST(TWIN_AXES)];     /* m, at its end */
    long steps;                                   /* complete ones */

    /* the state */
    double step, fed;                             /* s */
    twin_real z[TWIN_STATES], held[TWIN_MOST(TWIN_THETA)];
    twin_real last[TWIN_MOST(TWIN_SIGNALS)];
    unsigned char known[TWIN_MOST(TWIN_SIGNALS)];
    unsigned char far_ahead, outside_before;

    /* the step under way: what is averaged over it */
    double total, pending_time;
    int intervals, tabulated;
    twin_real base[TWIN_DRIVEN], sum[TWIN_DRIVEN];
    twin_real pending[TWIN_MOST(TWIN_SIGNALS)], pending_air[TWIN_MOST(TWIN_ENVIRONMENTS)];
    twin_real film_base[TWIN_MOST(TWIN_FOLLOWING_FILMS)][65], film_sum[TWIN_MOST(TWIN_FOLLOWING_FILMS)][65];
    twin_real loss_base[TWIN_MOST(TWIN_FOLLOWING_LOSSES)][121], loss_sum[TWIN_MOST(TWIN_FOLLOWING_LOSSES)][121];
    twin_real film_now[TWIN_MOST(TWIN_FOLLOWING_FILMS)][65], loss_now[TWIN_MOST(TWIN_FOLLOWING_LOSSES)][121];
    twin_real film_known[TWIN_MOST(TWIN_FOLLOWING_FILMS)][TWIN_READS + 1];
    twin_real loss_known[TWIN_MOST(TWIN_FOLLOWING_LOSSES)][TWIN_READS + 1];
    unsigned char film_made[TWIN_MOST(TWIN_FOLLOWING_FILMS)], loss_made[TWIN_MOST(TWIN_FOLLOWING_LOSSES)];
    unsigned char film_off[TWIN_MOST(TWIN_FOLLOWING_FILMS)][65], loss_off[TWIN_MOST(TWIN_FOLLOWING_LOSSES)][121];
    unsigned char film_outside[TWIN_MOST(TWIN_FOLLOWING_FILMS)][65];
    unsigned char loss_outside[TWIN_MOST(TWIN_FOLLOWING_LOSSES)][121];
    unsigned char raised[TWIN_MOST(TWIN_FLAGS)];
    twin_real low[TWIN_MOST(TWIN_AXES)], high[TWIN_MOST(TWIN_AXES)], at[TWIN_MOST(TWIN_AXES)];
    twin_real weight[TWIN_MOST(TWIN_FACING)], square[TWIN_MOST(TWIN_FACING)], beside[TWIN_MOST(TWIN_FACING)];
    twin_real under[TWIN_MOST(TWIN_UNDER)];

    /* contacts and factor of the last step */
    twin_real diagonal[TWIN_MOST(TWIN_PORTS)], neighbour[TWIN_MOST(TWIN_PORTS)], facing[TWIN_MOST(TWIN_FACING)];
    twin_real factor[TWIN_FACTOR], pivot[TWIN_STATES];
    int swapped[TWIN_STATES];
    twin_real left[TWIN_MOST(2 * TWIN_PAIRS)][TWIN_LARGEST], right[TWIN_MOST(2 * TWIN_PAIRS)][TWIN_LARGEST];
    twin_real small[TWIN_MOST(4 * TWIN_PAIRS * TWIN_PAIRS)];
    int small_swapped[TWIN_MOST(2 * TWIN_PAIRS)];

    /* the TCP rows of one position */
    int has_rows;
    twin_real rows_at[TWIN_MOST(TWIN_POSE_AXES)], rows[3 * TWIN_MOST(TWIN_INPUTS)];

    /* room to work in, of no meaning between calls */
    twin_real work[TWIN_WORK];
} twin_machine;

#define TWIN_SAVED offsetof(twin_machine, work)

#define TWIN_NO_VALUE (-1)      /* a signal without default has had no value yet */
#define TWIN_BACKWARDS (-2)     /* time does not increase */
#define TWIN_NOT_FINITE (-3)    /* temperatures are not finite, or 1,000 K from the reference temperature */
#define TWIN_UNBALANCED (-4)    /* the heat balance is off by more than 1e-6 (single precision: 1e-2) */
#define TWIN_SINGULAR (-5)      /* a matrix cannot be factored: gains below zero? */

extern const char *const twin_signal_name[];  /* columns of loads.csv */
extern const char *const twin_signal_unit[];  /* SI */
extern const char *const twin_axis_name[];
extern const char *const twin_sensor_name[];
extern const char *const twin_flag_name[];
extern const char *const twin_source_name[];
extern const char *const twin_film_name[];
extern const int twin_axis_signal[];          /* which signal is an axis' position */

/* The whole machine at one temperature [degC]; steps of so many seconds (certified with TWIN_STEP). */
void twin_start(twin_machine *m, double temperature, double step);

/* Signals [SI, as logged; NAN: no value] that hold until a time [s since the start], while the axes move straight to
   position_at_end [m] (NULL: they rest). Returns how many steps were completed, or an error below zero. */
int twin_feed(twin_machine *m, double until, const twin_real *signals, const twin_real *position_at_end);

/* TCP displacement [m], tool minus work side, at the actual position; 0, or TWIN_SINGULAR. */
int twin_tcp(twin_machine *m, twin_real displacement[3]);

/* The same at all poses of the artefact: displacement[3 * pose + component]. */
void twin_poses(const twin_machine *m, twin_real *displacement);

#if TWIN_TERMS > 0
/* What cancels that displacement, added to the axes: once per step its coefficients[TWIN_POSE_AXES * TWIN_TERMS], */
void twin_correction(const twin_machine *m, twin_real *coefficient);

/* then in every cycle of the control: offset[m] of each axis at its nominal position[m], in the order of twin_axis_name;
   beyond the poses those of their border, 0 for axes that have none. */
void twin_offsets(const twin_real *coefficient, const twin_real *position, twin_real *offset);
#endif

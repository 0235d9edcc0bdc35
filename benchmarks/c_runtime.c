/* Processor time over a loads.csv: c_runtime loads.csv 22.0 writes a row per step: end of the step [s], seconds for the
   loads within it, seconds for its last load, the step, the TCP displacement at the actual position and at all poses, and
   1 where an axis moved; on stderr the seconds of a correction and the largest resident memory [kB]. Rows of the log are
   in memory before anything is timed. */

#define _POSIX_C_SOURCE 199309L
#define main example /* of the machine, whose reading of logs is used */
#include "reading.h"
#undef main

#include <time.h>

enum { ROWS = 100000, CYCLES = 1000000 };

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t); /* one thread: what others do does not count */
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static double seconds_of_a_correction(const twin_machine *m)
{
    static twin_real coefficient[TWIN_POSE_AXES * TWIN_TERMS];
    volatile twin_real sum = 0;
    twin_real at[TWIN_AXES] = {0}, offset[TWIN_AXES];
    twin_correction(m, coefficient);
    const double began = now();
    for (int i = 0; i < CYCLES; i++) {
        at[0] = (twin_real)(1e-7 * i);
        twin_offsets(coefficient, at, offset);
        sum = sum + offset[0];
    }
    return (now() - began) / CYCLES;
}

static long largest_memory(void)
{
    char line[256];
    long size = 0;
    FILE *file = fopen("/proc/self/status", "r");
    while (file && fgets(line, sizeof line, file))
        if (!strncmp(line, "VmHWM:", 6))
            size = atol(line + 6);
    if (file)
        fclose(file);
    return size;
}

int main(int count, char **argument)
{
    static twin_machine m;
    static char header[LONGEST];
    static double time[ROWS];
    static twin_real row[ROWS][TWIN_SIGNALS], all[3 * TWIN_POSES];
    int signal[COLUMNS], rows = 0;
    double factor[COLUMNS], loading = 0;
    FILE *file = count == 3 ? fopen(argument[1], "r") : NULL;
    if (!file || !fgets(header, LONGEST, file))
        return 2;
    const int columns = columns_of(header, signal, factor);
    while (rows < ROWS && read_row(file, columns, signal, factor, &time[rows], row[rows]))
        rows++;
    fclose(file);
    twin_start(&m, atof(argument[2]), TWIN_STEP);
    for (int r = 0, moved = 0; r + 1 < rows; r++) {
        twin_real end[TWIN_AXES], w[3];
        for (int a = 0; a < TWIN_AXES; a++) {
            end[a] = row[r + 1][twin_axis_signal[a]];
            moved |= end[a] != row[r][twin_axis_signal[a]];
        }
        const double began = now();
        const int done = twin_feed(&m, time[r + 1] - time[0], row[r], end);
        if (done < 0 || twin_tcp(&m, w) < 0)
            return 1;
        if (done)
            twin_poses(&m, all);
        if (done) {
            printf("%.9g,%.9g,%.9g,%d\n", time[r + 1], loading, now() - began, moved);
            loading = 0;
            moved = 0;
        } else
            loading += now() - began;
    }
    const double correction = seconds_of_a_correction(&m);
    fprintf(stderr, "%.9g %ld\n", correction, largest_memory());
    return 0;
}

/* Reads loads.csv of a run folder, writes temperatures and TCP displacements:

       cc -std=c99 -O2 -o twin_run twin_example.c twin_.c -lm
       ./twin_run loads.csv 22.0 > result.csv          22.0: temperature of the whole machine at the start [degC]
       ./twin_run loads.csv 22.0 60 poses > result.csv 60: s per step; poses: displacements at all poses too

   A row of results is of the end of a step; it ends with the number of flags raised in it. */

#include "twin_.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LONGEST = 65536, COLUMNS = 1024 };

static const struct {
    const char *unit;
    double factor;
} units[] = {TWIN_UNITS};

static double factor_of(const char *unit)
{
    for (size_t i = 0; i < sizeof units / sizeof *units; i++)
        if (!strcmp(units[i].unit, unit))
            return units[i].factor;
    fprintf(stderr, "error: loads: unit '%s' is not known\n", unit);
    exit(2);
}

static int columns_of(char *line, int *signal, double *factor)
{
    int n = 0;
    for (char *cell = strtok(line, ",\r\n"); cell; cell = strtok(NULL, ",\r\n"), n++) {
        char *unit = strstr(cell, " [");
        if (n == COLUMNS || !unit) {
            fprintf(stderr, "error: loads: column %d: a header is 'name [unit]'\n", n + 1);
            exit(2);
        }
        *unit = 0;
        unit += 2;
        unit[strcspn(unit, "]")] = 0;
        signal[n] = -1;
        for (int i = 0; i < TWIN_SIGNALS; i++)
            if (!strcmp(twin_signal_name[i], cell))
                signal[n] = i;
        factor[n] = n == 0 || signal[n] >= 0 ? factor_of(unit) : 1;
    }
    return n;
}

static int read_row(FILE *file, int columns, const int *signal, const double *factor, double *time, twin_real *values)
{
    static char line[LONGEST];
    char *at = line;
    if (!fgets(line, LONGEST, file) || line[strspn(line, " \r\n")] == 0)
        return 0;
    for (int i = 0; i < TWIN_SIGNALS; i++)
        values[i] = NAN;
    for (int n = 0; n < columns; n++) {
        char *end;
        const double value = strtod(at, &end);
        if (n == 0)
            *time = value * factor[0];
        else if (signal[n] >= 0 && end != at)
            values[signal[n]] = (twin_real)(value * factor[n]);
        at = end + strcspn(end, ",");
        at += *at == ',';
    }
    return 1;
}

static void fail(int status, double time)
{
    const char *const what[] = {"a signal has no value yet", "time does not increase", "temperatures beyond reason",
                                "the heat balance is off", "a matrix cannot be factored"};
    fprintf(stderr, "error: %s at %g s\n", what[-status - 1], time);
    exit(status == TWIN_NO_VALUE || status == TWIN_BACKWARDS ? 2 : 1);
}

static void write_row(twin_machine *m, int poses)
{
    static twin_real all[TWIN_MOST(3 * TWIN_POSES)];
    twin_real w[3];
    int flags = 0;
    if (twin_tcp(m, w) < 0)
        fail(TWIN_SINGULAR, (double)m->steps * m->step);
    printf("%.17g", (double)m->steps * m->step);
    for (int s = 0; s < TWIN_SENSORS; s++)
        printf(",%.17g", (double)m->sensor[s]);
    for (int k = 0; k < 3; k++)
        printf(",%.17g", (double)w[k]);
    twin_poses(m, all);
    for (int i = 0; poses && i < 3 * TWIN_POSES; i++)
        printf(",%.17g", (double)all[i]);
    for (int i = 0; i < TWIN_FLAGS; i++)
        flags += m->flag[i];
    printf(",%d\n", flags);
}

int main(int count, char **argument)
{
    static twin_machine machine;
    static char header[LONGEST];
    int signal[COLUMNS], columns;
    double factor[COLUMNS], time, next, origin;
    twin_real now[TWIN_MOST(TWIN_SIGNALS)], then[TWIN_MOST(TWIN_SIGNALS)], end[TWIN_MOST(TWIN_AXES)];
    FILE *file = count > 2 ? fopen(argument[1], "r") : NULL;
    const int poses = count > 4;
    if (!file || !fgets(header, LONGEST, file)) {
        fprintf(stderr, "usage: %s loads.csv initial_degC [step_s [poses]]\n", argument[0]);
        return 2;
    }
    twin_start(&machine, atof(argument[2]), count > 3 ? atof(argument[3]) : TWIN_STEP);
    columns = columns_of(header, signal, factor);
    printf("time [s]");
    for (int s = 0; s < TWIN_SENSORS; s++)
        printf(",%s [degC]", twin_sensor_name[s]);
    printf(",dx [m],dy [m],dz [m]");
    for (int i = 0; poses && i < TWIN_POSES; i++)
        printf(",dx_%d [m],dy_%d [m],dz_%d [m]", i, i, i);
    printf(",flags [1]\n");
    if (!read_row(file, columns, signal, factor, &origin, now))
        return 2;
    for (time = origin; read_row(file, columns, signal, factor, &next, then);
         time = next, memcpy(now, then, sizeof now)) {
        double until = next - origin;
        for (int a = 0; a < TWIN_AXES; a++)
            end[a] = then[twin_axis_signal[a]];
        for (int more = 1; more;) { /* a row may be longer than a step: each step is a row of results */
            const double edge = (double)(machine.steps + 1) * machine.step;
            const long before = machine.steps;
            twin_real there[TWIN_MOST(TWIN_AXES)];
            more = edge < until - 1e-9 * machine.step;
            for (int a = 0; a < TWIN_AXES; a++) {
                const twin_real from = now[twin_axis_signal[a]];
                const double part = (edge - machine.fed) / (until - machine.fed);
                there[a] = more ? from + (twin_real)part * (end[a] - from) : end[a];
            }
            const int status = twin_feed(&machine, more ? edge : until, now, there);
            if (status < 0)
                fail(status, until);
            for (int a = 0; more && a < TWIN_AXES; a++)
                now[twin_axis_signal[a]] = there[a];
            if (machine.steps > before)
                write_row(&machine, poses);
        }
    }
    if (machine.intervals || machine.steps == 0) { /* the last row holds to the end of its step */
        const int status = twin_feed(&machine, (double)(machine.steps + 1) * machine.step, now, NULL);
        if (status < 0)
            fail(status, time);
        write_row(&machine, poses);
    }
    fclose(file);
    return 0;
}

/* --- What both versions of FMI share: variables, steps, states. --------------------------------------------------- */

#include <stdio.h>
#include <stdlib.h>

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define EXPORT __attribute__((visibility("default")))
#else
#define EXPORT
#endif

#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-parameter" /* the standard gives the signatures */
#endif

enum { CREATED, INITIALISING, STEPPING, TERMINATED };

typedef struct {
    char digest[16];              /* of the model: states of another one are refused */
    double origin, time;          /* s: of the start, now */
    double temperature, step;     /* degC at the start, s */
    double signal[TWIN_MOST(TWIN_SIGNALS)], rate[TWIN_MOST(TWIN_AXES)];
    double source_gain[TWIN_MOST(TWIN_SOURCES)], film_gain[TWIN_MOST(TWIN_FILMS)];
    double tcp[3];
    int phase, has_tcp, has_poses;
    twin_machine machine;
} slave_state;

#define SAVED (offsetof(slave_state, machine) + TWIN_SAVED)

typedef struct {
    slave_state s;
    double pose[TWIN_MOST(3 * TWIN_POSES)];
    void *environment;
    void (*callback)(void); /* of the importer, of the version's type */
    char name[256];
    int logging;
} slave;

/* Value references, in this order. */
enum { AT_SIGNAL = 0, AT_RATE = AT_SIGNAL + TWIN_SIGNALS, AT_TEMPERATURE = AT_RATE + TWIN_AXES, AT_STEP,
       AT_SOURCE, AT_FILM = AT_SOURCE + TWIN_SOURCES, AT_SENSOR = AT_FILM + TWIN_FILMS,
       AT_TCP = AT_SENSOR + TWIN_SENSORS, AT_FLAGS = AT_TCP + 3, AT_TIME, AT_POSE,
       AT_END = AT_POSE + 3 * TWIN_POSES };

static void tell(const slave *f, int status, const char *message); /* each version's way to the importer's log */

static void say(const slave *f, int status, const char *message)
{
    if (f->callback && (f->logging || status > 1))
        tell(f, status, message);
}

static const char *const failure[] = {"a signal has no value yet", "time does not increase",
                                      "temperatures are not finite, or 1,000 K from the reference temperature",
                                      "the heat balance is off by more than 1e-6 of the throughput",
                                      "a matrix cannot be factored: gains below zero?"};

static void to_defaults(slave *f)
{
    memset(&f->s, 0, sizeof f->s);
    memcpy(f->s.digest, DIGEST, sizeof f->s.digest);
    memcpy(f->s.signal, signal_start, sizeof signal_start);
    f->s.temperature = TWIN_REFERENCE;
    f->s.step = TWIN_STEP;
    for (int i = 0; i < TWIN_SOURCES; i++)
        f->s.source_gain[i] = (double)source_gain[i];
    for (int i = 0; i < TWIN_FILMS; i++)
        f->s.film_gain[i] = (double)film_gain[i];
}

static void positions_of(const slave *f, twin_real *position)
{
    for (int a = 0; a < TWIN_AXES; a++) {
        const int s = twin_axis_signal[a];
        position[a] = (twin_real)f->s.signal[s] * signal_factor[s];
    }
}

static int begin(slave *f)
{
    if (!(f->s.step > 0 && f->s.step < INFINITY) || !(FABS(f->s.temperature) < 2000))
        return 0;
    twin_start(&f->s.machine, f->s.temperature, f->s.step);
    positions_of(f, f->s.machine.position);
    f->s.time = f->s.origin;
    f->s.has_tcp = f->s.has_poses = 0;
    return 1;
}

static int variable_is_input(unsigned at)
{
    return at < AT_SENSOR;
}

static int set_value(slave *f, unsigned at, double value)
{
    slave_state *s = &f->s;
    if (!variable_is_input(at))
        return 0;
    if (at < AT_RATE)
        s->signal[at] = value;
    else if (at < AT_TEMPERATURE)
        s->rate[at - AT_RATE] = value;
    else if (at == AT_TEMPERATURE || at == AT_STEP) {
        if (s->phase == STEPPING)
            return 0;
        *(at == AT_STEP ? &s->step : &s->temperature) = value;
    } else if (at < AT_FILM)
        s->source_gain[at - AT_SOURCE] = value;
    else
        s->film_gain[at - AT_FILM] = value;
    return 1;
}

static int get_value(slave *f, unsigned at, double *value)
{
    slave_state *s = &f->s;
    if (s->phase == INITIALISING && at >= AT_SENSOR && !begin(f)) /* outputs of a start that may still change */
        return 0;
    if (at >= AT_END)
        return 0;
    if (at < AT_RATE)
        *value = s->signal[at];
    else if (at < AT_TEMPERATURE)
        *value = s->rate[at - AT_RATE];
    else if (at == AT_TEMPERATURE)
        *value = s->temperature;
    else if (at == AT_STEP)
        *value = s->step;
    else if (at < AT_FILM)
        *value = s->source_gain[at - AT_SOURCE];
    else if (at < AT_SENSOR)
        *value = s->film_gain[at - AT_FILM];
    else if (at < AT_TCP)
        *value = (double)s->machine.sensor[at - AT_SENSOR];
    else if (at < AT_FLAGS) {
        if (!s->has_tcp) {
            twin_real w[3];
            if (twin_tcp(&s->machine, w) < 0)
                return 0;
            for (int k = 0; k < 3; k++)
                s->tcp[k] = (double)w[k];
            s->has_tcp = 1;
        }
        *value = s->tcp[at - AT_TCP];
    } else if (at == AT_FLAGS) {
        *value = 0;
        for (int i = 0; i < TWIN_FLAGS; i++)
            *value += s->machine.flag[i];
    } else if (at == AT_TIME)
        *value = s->time;
    else {
        if (!s->has_poses) {
            twin_real w[TWIN_MOST(3 * TWIN_POSES)];
            twin_poses(&s->machine, w);
            for (int i = 0; i < 3 * TWIN_POSES; i++)
                f->pose[i] = (double)w[i];
            s->has_poses = 1;
        }
        *value = f->pose[at - AT_POSE];
    }
    return 1;
}

/* One communication step: signals hold, axes move by their rates. Inner steps are those of the model. */
static int do_step(slave *f, double time, double size)
{
    slave_state *s = &f->s;
    twin_real v[TWIN_MOST(TWIN_SIGNALS)], end[TWIN_MOST(TWIN_AXES)];
    if (!(size >= 0) || FABS(time - s->time) > 1e-6 * (1 + FABS(time))) {
        say(f, 3, size >= 0 ? "the step does not begin where the last one ended" : "a step of negative length");
        return 0;
    }
    if (size == 0)
        return 1;
    for (int i = 0; i < TWIN_SIGNALS; i++)
        v[i] = (twin_real)s->signal[i];
    for (int a = 0; a < TWIN_AXES; a++)
        end[a] = v[twin_axis_signal[a]] + (twin_real)(s->rate[a] * size);
    for (int i = 0; i < TWIN_SOURCES; i++)
        s->machine.source_gain[i] = (twin_real)s->source_gain[i];
    for (int i = 0; i < TWIN_FILMS; i++)
        s->machine.film_gain[i] = (twin_real)s->film_gain[i];
    const int done = twin_feed(&s->machine, time + size - s->origin, v, end);
    if (done < 0) {
        say(f, 3, failure[-done - 1]);
        return 0;
    }
    if (done)
        s->has_tcp = s->has_poses = 0;
    s->time = time + size;
    return 1;
}

static void *copy_of(const slave *f)
{
    void *copy = malloc(SAVED);
    if (copy)
        memcpy(copy, &f->s, SAVED);
    return copy;
}

static void restore(slave *f, const void *from)
{
    memcpy(&f->s, from, SAVED);
    f->s.has_poses = 0;
}

static slave *create(const char *name, const char *token)
{
    slave *f;
    if (!token || strcmp(token, TOKEN))
        return NULL;
    f = calloc(1, sizeof *f);
    if (!f)
        return NULL;
    snprintf(f->name, sizeof f->name, "%s", name ? name : "");
    to_defaults(f);
    return f;
}

enum { OK = 0, FAILED = 3 }; /* statuses of both versions */

static int get_values(slave *f, const unsigned at[], size_t n, double value[])
{
    for (size_t i = 0; i < n; i++)
        if (!get_value(f, at[i], &value[i])) {
            say(f, FAILED, "no such variable, or no value");
            return FAILED;
        }
    return OK;
}

static int set_values(slave *f, const unsigned at[], size_t n, const double value[])
{
    for (size_t i = 0; i < n; i++)
        if (!set_value(f, at[i], value[i])) {
            say(f, FAILED, "no variable that can be set now");
            return FAILED;
        }
    return OK;
}

/* --- FMI 2.0 for co-simulation (fmi-standard.org, 2.0.4). --------------------------------------------------------- */

typedef void *fmi2Component, *fmi2ComponentEnvironment, *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer, fmi2Boolean;
typedef char fmi2Char, fmi2Byte;
typedef const fmi2Char *fmi2String;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;
typedef void (*fmi2Logger)(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...);
typedef struct {
    fmi2Logger logger;
    void *(*allocateMemory)(size_t, size_t);
    void (*freeMemory)(void *);
    void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
    fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;

static void tell(const slave *f, int status, const char *message)
{
    const fmi2Logger log = (fmi2Logger)f->callback;
    log(f->environment, f->name, (fmi2Status)status, status > 2 ? "logStatusError" : "logStatusWarning", "%s", message);
}

EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }

EXPORT const char *fmi2GetVersion(void) { return "2.0"; }

EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[])
{
    (void)n;
    (void)categories;
    ((slave *)c)->logging = on;
    return fmi2OK;
}

EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String token, fmi2String resources,
                                     const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging)
{
    slave *f = type == fmi2CoSimulation ? create(name, token) : NULL;
    (void)resources;
    (void)visible;
    if (!f) {
        if (functions && functions->logger)
            functions->logger(functions->componentEnvironment, name, fmi2Error, "logStatusError",
                              "not for co-simulation, another model, or no memory");
        return NULL;
    }
    f->logging = logging;
    if (functions) {
        f->environment = functions->componentEnvironment;
        f->callback = (void (*)(void))functions->logger;
    }
    return f;
}

EXPORT void fmi2FreeInstance(fmi2Component c) { free(c); }

EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance, fmi2Real start,
                                      fmi2Boolean has_stop, fmi2Real stop)
{
    slave *f = c;
    (void)has_tolerance;
    (void)tolerance;
    (void)has_stop;
    (void)stop;
    f->s.origin = f->s.time = start;
    return fmi2OK;
}

EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    ((slave *)c)->s.phase = INITIALISING;
    return fmi2OK;
}

EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    slave *f = c;
    if (!begin(f)) {
        say(f, 3, "T_initial or step is out of range");
        return fmi2Error;
    }
    f->s.phase = STEPPING;
    return fmi2OK;
}

EXPORT fmi2Status fmi2Terminate(fmi2Component c)
{
    ((slave *)c)->s.phase = TERMINATED;
    return fmi2OK;
}

EXPORT fmi2Status fmi2Reset(fmi2Component c)
{
    to_defaults(c);
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference at[], size_t n, fmi2Real value[])
{
    for (size_t i = 0; i < n; i++)
        if (!get_value(c, at[i], &value[i])) {
            say(c, 3, "no such variable, or no value");
            return fmi2Error;
        }
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference at[], size_t n, const fmi2Real value[])
{
    for (size_t i = 0; i < n; i++)
        if (!set_value(c, at[i], value[i])) {
            say(c, 3, "no variable that can be set now");
            return fmi2Error;
        }
    return fmi2OK;
}

#define NONE_OF(kind)                                                                                           \
    EXPORT fmi2Status fmi2Get##kind(fmi2Component c, const fmi2ValueReference at[], size_t n, fmi2##kind value[]) \
    {                                                                                                           \
        (void)c;                                                                                                \
        (void)at;                                                                                               \
        (void)value;                                                                                            \
        return n ? fmi2Error : fmi2OK;                                                                          \
    }                                                                                                           \
    EXPORT fmi2Status fmi2Set##kind(fmi2Component c, const fmi2ValueReference at[], size_t n,                    \
                                    const fmi2##kind value[])                                                   \
    {                                                                                                           \
        (void)c;                                                                                                \
        (void)at;                                                                                               \
        (void)value;                                                                                            \
        return n ? fmi2Error : fmi2OK;                                                                          \
    }

NONE_OF(Integer)
NONE_OF(Boolean)
NONE_OF(String)

EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    if (*state)
        memcpy(*state, &((slave *)c)->s, SAVED);
    else
        *state = copy_of(c);
    return *state ? fmi2OK : fmi2Error;
}

EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    restore(c, state);
    return fmi2OK;
}

EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    (void)c;
    free(*state);
    *state = NULL;
    return fmi2OK;
}

EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    (void)c;
    (void)state;
    *size = SAVED;
    return fmi2OK;
}

EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    (void)c;
    if (size < SAVED)
        return fmi2Error;
    memcpy(bytes, state, SAVED);
    return fmi2OK;
}

EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
    if (size != SAVED || memcmp(bytes, DIGEST, 16)) {
        say(c, 3, "a state of another model");
        return fmi2Error;
    }
    if (!*state)
        *state = malloc(SAVED);
    if (!*state)
        return fmi2Error;
    memcpy(*state, bytes, SAVED);
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t n,
                                               const fmi2ValueReference known[], size_t m, const fmi2Real by[],
                                               fmi2Real change[])
{
    (void)c;
    (void)unknown;
    (void)n;
    (void)known;
    (void)m;
    (void)by;
    (void)change;
    return fmi2Error;
}

EXPORT fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference at[], size_t n,
                                              const fmi2Integer order[], const fmi2Real value[])
{
    (void)c;
    (void)at;
    (void)order;
    (void)value;
    return n ? fmi2Error : fmi2OK;
}

EXPORT fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference at[], size_t n,
                                               const fmi2Integer order[], fmi2Real value[])
{
    (void)c;
    (void)at;
    (void)order;
    (void)value;
    return n ? fmi2Error : fmi2OK;
}

EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real size, fmi2Boolean no_return)
{
    (void)no_return;
    return do_step(c, time, size) ? fmi2OK : fmi2Error;
}

EXPORT fmi2Status fmi2CancelStep(fmi2Component c)
{
    (void)c;
    return fmi2Error; /* steps are never pending */
}

EXPORT fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value)
{
    (void)c;
    (void)kind;
    *value = fmi2OK;
    return fmi2Discard;
}

EXPORT fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
{
    *value = ((slave *)c)->s.time;
    return kind == fmi2LastSuccessfulTime ? fmi2OK : fmi2Discard;
}

EXPORT fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value)
{
    (void)c;
    (void)kind;
    *value = 0;
    return fmi2Discard;
}

EXPORT fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value)
{
    *value = ((slave *)c)->s.phase == TERMINATED;
    return kind == fmi2Terminated ? fmi2OK : fmi2Discard;
}

EXPORT fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value)
{
    (void)c;
    (void)kind;
    *value = "";
    return fmi2Discard;
}

/* --- FMI 3.0 for co-simulation (fmi-standard.org, 3.0.2). Every function is exported. ------------------------------ */

#include <stdbool.h>
#include <stdint.h>

typedef void *fmi3Instance, *fmi3InstanceEnvironment, *fmi3FMUState;
typedef uint32_t fmi3ValueReference;
typedef float fmi3Float32;
typedef double fmi3Float64;
typedef int8_t fmi3Int8;
typedef uint8_t fmi3UInt8;
typedef int16_t fmi3Int16;
typedef uint16_t fmi3UInt16;
typedef int32_t fmi3Int32;
typedef uint32_t fmi3UInt32;
typedef int64_t fmi3Int64;
typedef uint64_t fmi3UInt64;
typedef bool fmi3Boolean, fmi3Clock;
typedef const char *fmi3String;
typedef uint8_t fmi3Byte;
typedef const fmi3Byte *fmi3Binary;
typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef int fmi3DependencyKind, fmi3IntervalQualifier;
typedef void (*fmi3LogMessageCallback)(fmi3InstanceEnvironment, fmi3Status, fmi3String, fmi3String);
typedef void (*fmi3AnyCallback)(void);

#define FMI(name) fmi3##name /* for shared.c */

static void tell(const slave *f, int status, const char *message)
{
    const fmi3LogMessageCallback log = (fmi3LogMessageCallback)f->callback;
    log(f->environment, (fmi3Status)status, status > 2 ? "logStatusError" : "logStatusWarning", message);
}

EXPORT const char *fmi3GetVersion(void) { return "3.0"; }

EXPORT fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3Boolean events, fmi3Boolean early, const fmi3ValueReference required[], size_t n,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3AnyCallback update)
{
    slave *f = n || events ? NULL : create(name, token);
    if (!f) {
        if (log)
            log(environment, fmi3Error, "logStatusError", "events or intermediate variables, another model, or no memory");
        return NULL;
    }
    f->logging = logging;
    f->environment = environment;
    f->callback = (void (*)(void))log;
    return f;
}

EXPORT fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
                                                 fmi3Boolean visible, fmi3Boolean logging,
                                                 fmi3InstanceEnvironment environment, fmi3LogMessageCallback log)
{
    return NULL;
}

EXPORT fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
                                                      fmi3Boolean visible, fmi3Boolean logging,
                                                      fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                                      fmi3AnyCallback update, fmi3AnyCallback lock,
                                                      fmi3AnyCallback unlock)
{
    return NULL;
}

EXPORT fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean has_tolerance, fmi3Float64 tolerance,
                                              fmi3Float64 start, fmi3Boolean has_stop, fmi3Float64 stop)
{
    slave *f = c;
    f->s.origin = f->s.time = start;
    f->s.phase = INITIALISING;
    return fmi3OK;
}

EXPORT fmi3Status fmi3EnterStepMode(fmi3Instance c) { return fmi3OK; }

EXPORT fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference at[], size_t n, fmi3Float64 value[], size_t m)
{
    return m == n ? (fmi3Status)get_values(c, at, n, value) : fmi3Error;
}

EXPORT fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference at[], size_t n, const fmi3Float64 value[],
                                 size_t m)
{
    return m == n ? (fmi3Status)set_values(c, at, n, value) : fmi3Error;
}

EXPORT fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 size, fmi3Boolean no_return,
                             fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last)
{
    slave *f = c;
    const int done = do_step(f, time, size);
    *event = *terminate = *early = false;
    *last = f->s.time;
    return done ? fmi3OK : fmi3Error;
}

/* There are no variables of other types, no clocks, no derivatives and no events. */
#define NONE_OF(type)                                                                                             \
    EXPORT fmi3Status fmi3Get##type(fmi3Instance c, const fmi3ValueReference at[], size_t n, fmi3##type value[],   \
                                    size_t m)                                                                     \
    {                                                                                                             \
        return n ? fmi3Error : fmi3OK;                                                                            \
    }                                                                                                             \
    EXPORT fmi3Status fmi3Set##type(fmi3Instance c, const fmi3ValueReference at[], size_t n,                       \
                                    const fmi3##type value[], size_t m)                                           \
    {                                                                                                             \
        return n ? fmi3Error : fmi3OK;                                                                            \
    }

NONE_OF(Float32)
NONE_OF(Int8)
NONE_OF(UInt8)
NONE_OF(Int16)
NONE_OF(UInt16)
NONE_OF(Int32)
NONE_OF(UInt32)
NONE_OF(Int64)
NONE_OF(UInt64)
NONE_OF(Boolean)
NONE_OF(String)

#define REFUSED(name, ...) \
    EXPORT fmi3Status fmi3##name(fmi3Instance c, __VA_ARGS__) { return fmi3Error; }
#define REFUSED_ALONE(name) \
    EXPORT fmi3Status fmi3##name(fmi3Instance c) { return fmi3Error; }
#define OF_CLOCKS const fmi3ValueReference at[], size_t n

REFUSED(GetBinary, OF_CLOCKS, size_t size[], fmi3Binary value[], size_t m)
REFUSED(SetBinary, OF_CLOCKS, const size_t size[], const fmi3Binary value[], size_t m)
REFUSED(GetClock, OF_CLOCKS, fmi3Clock value[])
REFUSED(SetClock, OF_CLOCKS, const fmi3Clock value[])
REFUSED(GetDirectionalDerivative, OF_CLOCKS, const fmi3ValueReference known[], size_t m, const fmi3Float64 seed[],
        size_t k, fmi3Float64 value[], size_t l)
REFUSED(GetAdjointDerivative, OF_CLOCKS, const fmi3ValueReference known[], size_t m, const fmi3Float64 seed[], size_t k,
        fmi3Float64 value[], size_t l)
REFUSED(GetVariableDependencies, fmi3ValueReference of, size_t element[], fmi3ValueReference on[], size_t of_on[],
        fmi3DependencyKind kind[], size_t n)
REFUSED(GetOutputDerivatives, OF_CLOCKS, const fmi3Int32 order[], fmi3Float64 value[], size_t m)
REFUSED(GetIntervalDecimal, OF_CLOCKS, fmi3Float64 value[], fmi3IntervalQualifier qualifier[])
REFUSED(GetIntervalFraction, OF_CLOCKS, fmi3UInt64 counter[], fmi3UInt64 resolution[], fmi3IntervalQualifier of[])
REFUSED(GetShiftDecimal, OF_CLOCKS, fmi3Float64 value[])
REFUSED(GetShiftFraction, OF_CLOCKS, fmi3UInt64 counter[], fmi3UInt64 resolution[])
REFUSED(SetIntervalDecimal, OF_CLOCKS, const fmi3Float64 value[])
REFUSED(SetIntervalFraction, OF_CLOCKS, const fmi3UInt64 counter[], const fmi3UInt64 resolution[])
REFUSED(SetShiftDecimal, OF_CLOCKS, const fmi3Float64 value[])
REFUSED(SetShiftFraction, OF_CLOCKS, const fmi3UInt64 counter[], const fmi3UInt64 resolution[])
REFUSED(UpdateDiscreteStates, fmi3Boolean *a, fmi3Boolean *b, fmi3Boolean *d, fmi3Boolean *e, fmi3Boolean *g,
        fmi3Float64 *next)
REFUSED(CompletedIntegratorStep, fmi3Boolean no_return, fmi3Boolean *event, fmi3Boolean *terminate)
REFUSED(SetTime, fmi3Float64 time)
REFUSED(SetContinuousStates, const fmi3Float64 value[], size_t n)
REFUSED(GetContinuousStateDerivatives, fmi3Float64 value[], size_t n)
REFUSED(GetEventIndicators, fmi3Float64 value[], size_t n)
REFUSED(GetContinuousStates, fmi3Float64 value[], size_t n)
REFUSED(GetNominalsOfContinuousStates, fmi3Float64 value[], size_t n)
REFUSED(ActivateModelPartition, fmi3ValueReference clock, fmi3Float64 time)
REFUSED_ALONE(EnterConfigurationMode)
REFUSED_ALONE(ExitConfigurationMode)
REFUSED_ALONE(EnterEventMode)
REFUSED_ALONE(EnterContinuousTimeMode)
REFUSED_ALONE(EvaluateDiscreteStates)

EXPORT fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance c, fmi3ValueReference at, size_t *n)
{
    *n = 0;
    return fmi3Error;
}

EXPORT fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *n)
{
    *n = 0;
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *n)
{
    *n = 0;
    return fmi3OK;
}

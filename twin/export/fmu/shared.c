/* --- Functions that both versions of FMI have, under the names of the one that stands above. ------------------------ */

EXPORT FMI(Status) FMI(SetDebugLogging)(FMI(Instance) c, FMI(Boolean) on, size_t n, const FMI(String) categories[])
{
    ((slave *)c)->logging = on;
    return FMI(OK);
}

EXPORT void FMI(FreeInstance)(FMI(Instance) c) { free(c); }

EXPORT FMI(Status) FMI(ExitInitializationMode)(FMI(Instance) c)
{
    slave *f = c;
    if (!begin(f)) {
        say(f, FAILED, "T_initial or step is out of range");
        return FMI(Error);
    }
    f->s.phase = STEPPING;
    return FMI(OK);
}

EXPORT FMI(Status) FMI(Terminate)(FMI(Instance) c)
{
    ((slave *)c)->s.phase = TERMINATED;
    return FMI(OK);
}

EXPORT FMI(Status) FMI(Reset)(FMI(Instance) c)
{
    to_defaults(c);
    return FMI(OK);
}

EXPORT FMI(Status) FMI(GetFMUState)(FMI(Instance) c, FMI(FMUState) *state)
{
    if (*state)
        memcpy(*state, &((slave *)c)->s, SAVED);
    else
        *state = copy_of(c);
    return *state ? FMI(OK) : FMI(Error);
}

EXPORT FMI(Status) FMI(SetFMUState)(FMI(Instance) c, FMI(FMUState) state)
{
    restore(c, state);
    return FMI(OK);
}

EXPORT FMI(Status) FMI(FreeFMUState)(FMI(Instance) c, FMI(FMUState) *state)
{
    free(*state);
    *state = NULL;
    return FMI(OK);
}

EXPORT FMI(Status) FMI(SerializedFMUStateSize)(FMI(Instance) c, FMI(FMUState) state, size_t *size)
{
    *size = SAVED;
    return FMI(OK);
}

EXPORT FMI(Status) FMI(SerializeFMUState)(FMI(Instance) c, FMI(FMUState) state, FMI(Byte) bytes[], size_t size)
{
    if (size < SAVED)
        return FMI(Error);
    memcpy(bytes, state, SAVED);
    return FMI(OK);
}

EXPORT FMI(Status) FMI(DeserializeFMUState)(FMI(Instance) c, const FMI(Byte) bytes[], size_t size, FMI(FMUState) *state)
{
    if (size != SAVED || memcmp(bytes, DIGEST, 16)) {
        say(c, FAILED, "a state of another model");
        return FMI(Error);
    }
    if (!*state)
        *state = malloc(SAVED);
    if (!*state)
        return FMI(Error);
    memcpy(*state, bytes, SAVED);
    return FMI(OK);
}

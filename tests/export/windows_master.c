/* A master for one FMI 2.0 slave on Windows: windows_master.exe SLAVE.dll TOKEN < commands

   s REFERENCE VALUE   set a variable        b   begin: initialisation is over
   d TIME SIZE         one communication step        g REFERENCE   print a variable */

#include <stdio.h>
#include <string.h>
#include <windows.h>

typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *others[4];
} callbacks;

static void told(void *environment, const char *name, int status, const char *category, const char *message, ...)
{
    (void)environment;
    fprintf(stderr, "%s %d %s %s\n", name, status, category, message);
}

#define LOAD(name) (void *)(size_t)GetProcAddress(library, name)

int main(int count, char **argument)
{
    static const callbacks functions = {told, {0}};
    char command;
    double first, second;
    HMODULE library = count == 3 ? LoadLibraryA(argument[1]) : NULL;
    if (!library)
        return 2;
    void *(*instantiate)(const char *, int, const char *, const char *, const callbacks *, int, int) =
        LOAD("fmi2Instantiate");
    int (*setup)(void *, int, double, double, int, double) = LOAD("fmi2SetupExperiment");
    int (*enter)(void *) = LOAD("fmi2EnterInitializationMode"), (*leave)(void *) = LOAD("fmi2ExitInitializationMode");
    int (*set)(void *, const unsigned *, size_t, const double *) = LOAD("fmi2SetReal");
    int (*get)(void *, const unsigned *, size_t, double *) = LOAD("fmi2GetReal");
    int (*step)(void *, double, double, int) = LOAD("fmi2DoStep");
    void (*release)(void *) = LOAD("fmi2FreeInstance");
    if (!instantiate || !setup || !enter || !leave || !set || !get || !step || !release)
        return 3;
    void *slave = instantiate("windows", 1, argument[2], "", &functions, 0, 1);
    if (!slave || setup(slave, 0, 0, 0, 0, 0) || enter(slave))
        return 4;
    while (scanf(" %c", &command) == 1) {
        int status = 0;
        if (strchr("sdg", command) && scanf("%lf", &first) != 1)
            return 5;
        if (strchr("sd", command) && scanf("%lf", &second) != 1)
            return 5;
        const unsigned at = (unsigned)first;
        if (command == 's')
            status = set(slave, &at, 1, &second);
        else if (command == 'b')
            status = leave(slave);
        else if (command == 'd')
            status = step(slave, first, second, 1);
        else if (command == 'g') {
            status = get(slave, &at, 1, &second);
            printf("%.17g\n", second);
        }
        if (status)
            return 6;
    }
    release(slave);
    return 0;
}

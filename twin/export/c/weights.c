/* The numbers of all large tables. TWIN_WEIGHTS names a file with the same as bytes: gcc and clang take it at once. */
#ifdef TWIN_WEIGHTS
#ifdef _WIN32
#define TWIN_READ_ONLY ".section .rdata,\"dr\"\n"
#define TWIN_BACK ".text\n"
#else
#define TWIN_READ_ONLY ".section .rodata\n"
#define TWIN_BACK ".previous\n"
#endif
#if defined(__clang__) || !defined(_WIN32)
#define TWIN_HIDDEN __attribute__((visibility("hidden")))
#else
#define TWIN_HIDDEN
#endif
__asm__(TWIN_READ_ONLY ".balign 64\n"
        ".globl twin_weights\n"
        "twin_weights:\n"
        ".incbin \"" TWIN_WEIGHTS "\"\n" TWIN_BACK);
extern const real twin_weights[] TWIN_HIDDEN;
#else
static const real twin_weights[] = {
THE_NUMBERS
};
#endif

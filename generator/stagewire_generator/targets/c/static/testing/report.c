/**
 * @file report.c
 * Prints results; the only file of the vectors that needs a standard library.
 */
#include "testing/report.h"

#include <stdio.h>

/* Number of examples for each enum stagewire_outcome. */
struct tally {
    size_t of[STAGEWIRE_NOTED + 1];
};

static const char *const outcomes[] = {"passed", "failed", "noted"};

static void print(void *user, const struct stagewire_finding *finding)
{
    struct tally *const tally = user;

    ++tally->of[finding->outcome];
    printf("%s %s", finding->id, outcomes[finding->outcome]);
    if (finding->what != NULL) {
        printf(": %s", finding->what);
    }
    if (finding->where != NULL) {
        printf(" (%s)", finding->where);
    }
    printf("\n");
}

int stagewire_print(const struct stagewire_suite *const *suites, size_t count)
{
    size_t failed = 0;

    for (size_t i = 0; i < count; ++i) {
        struct tally tally = {{0, 0, 0}};
        failed += stagewire_run(suites[i], print, &tally);
        printf("%s: %lu passed, %lu failed, %lu noted\n", suites[i]->name,
            (unsigned long)tally.of[STAGEWIRE_PASSED], (unsigned long)tally.of[STAGEWIRE_FAILED],
            (unsigned long)tally.of[STAGEWIRE_NOTED]);
    }
    return failed == 0 ? 0 : 1;
}

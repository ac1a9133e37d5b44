/* Runs the worked examples of one package (SUITE of SUITE_H) on the chip, with the same output as on a host. */
#include SUITE_H

#include "semihosting.h"

static const char *const outcomes[] = {"passed", "failed", "noted"};

static void print(void *user, const struct stagewire_finding *finding)
{
    uint32_t *const tally = (uint32_t *)user;

    ++tally[finding->outcome];
    semihosting_write(finding->id);
    semihosting_write(" ");
    semihosting_write(outcomes[finding->outcome]);
    if (finding->what != NULL) {
        semihosting_write(": ");
        semihosting_write(finding->what);
    }
    if (finding->where != NULL) {
        semihosting_write(" (");
        semihosting_write(finding->where);
        semihosting_write(")");
    }
    semihosting_write("\n");
}

int main(void)
{
    uint32_t tally[] = {0, 0, 0};
    const size_t failed = stagewire_run(&SUITE, print, tally);

    semihosting_write(SUITE.name);
    for (size_t i = 0; i < sizeof(outcomes) / sizeof(outcomes[0]); ++i) {
        semihosting_write(i == 0 ? ": " : ", ");
        semihosting_write_number(tally[i]);
        semihosting_write(" ");
        semihosting_write(outcomes[i]);
    }
    semihosting_write("\n");
    return failed == 0 ? 0 : 1;
}

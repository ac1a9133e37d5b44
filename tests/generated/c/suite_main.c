/* Runs one suite of a package (SUITE of SUITE_H) on a host, and prints the results. */
#include "testing/report.h"

#include SUITE_H

int main(void)
{
    const struct stagewire_suite *const suites[] = {&SUITE};

    return stagewire_print(suites, 1);
}

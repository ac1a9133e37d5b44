/**
 * @file report.h
 * Runs suites on a host and prints what was found.
 */
#ifndef STAGEWIRE_TESTING_REPORT_H
#define STAGEWIRE_TESTING_REPORT_H

#include "testing/vectors.h"

#ifdef __cplusplus
extern "C" {
#endif

/**
 * Runs suites, prints a line for every example and one with the figures of each suite.
 *
 * Returns what main() has to return: 0, or 1 when an example failed.
 */
int stagewire_print(const struct stagewire_suite *const *suites, size_t count);

#ifdef __cplusplus
}
#endif

#endif

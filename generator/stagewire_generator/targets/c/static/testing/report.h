/**
 * @file report.h
 * Runs suites on a host and prints the results.
 */
#ifndef STAGEWIRE_TESTING_REPORT_H
#define STAGEWIRE_TESTING_REPORT_H

#include "testing/vectors.h"

#ifdef __cplusplus
extern "C" {
#endif

/**
 * Runs suites, and prints a line for each example and a summary line for each suite.
 *
 * Returns the exit status for main(): 0, or 1 if an example failed.
 */
int stagewire_print(const struct stagewire_suite *const *suites, size_t count);

#ifdef __cplusplus
}
#endif

#endif

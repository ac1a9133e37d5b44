/**
 * @file failed.c
 * Prints the failures of a round trip; for hosts.
 */
#include <stdio.h>

#include "testing/round_trip.h"

void stagewire_failed(const char *layout, const char *condition)
{
    printf("%s: %s\n", layout, condition);
}

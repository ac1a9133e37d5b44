/* Reports failures of a round trip to the emulator. */
#include "testing/round_trip.h"

#include "semihosting.h"

void stagewire_failed(const char *layout, const char *condition)
{
    semihosting_write(layout);
    semihosting_write(": ");
    semihosting_write(condition);
    semihosting_write("\n");
}

/*
 * Reads conversions from standard input and writes the results to standard output, as native integers.
 * Each request is five int64_t (the function, and up to four arguments), each answer two (status, result).
 */
#include <stdio.h>

#include "stagewire_apt/quantities.h"

enum { TO_COUNTS,
    FROM_COUNTS,
    TO_INT16,
    TO_UINT16,
    TO_INT32,
    TO_UINT32,
    SHARE_NUMERATOR,
    SHARE_DENOMINATOR };

static apt_status narrow(
    int64_t which, const apt_ratio *value, const apt_scale *scale, int64_t *result)
{
    apt_status status = APT_OK;
    int16_t int16 = (int16_t)*result;
    uint16_t uint16 = (uint16_t)*result;
    int32_t int32 = (int32_t)*result;
    uint32_t uint32 = (uint32_t)*result;

    switch (which) {
    case TO_INT16:
        status = apt_to_counts_int16(value, scale, &int16);
        *result = int16;
        break;
    case TO_UINT16:
        status = apt_to_counts_uint16(value, scale, &uint16);
        *result = uint16;
        break;
    case TO_INT32:
        status = apt_to_counts_int32(value, scale, &int32);
        *result = int32;
        break;
    default:
        status = apt_to_counts_uint32(value, scale, &uint32);
        *result = uint32;
        break;
    }
    return status;
}

int main(void)
{
    int64_t in[5];

    while (fread(in, sizeof(in[0]), 5U, stdin) == 5U) {
        const apt_ratio first = {in[1], in[2]};
        const apt_scale scale = {in[3], in[4]};
        apt_scale share = {111, 111};
        int64_t out[2] = {0, 111}; /* 111 is the initial value of the result */

        switch (in[0]) {
        case TO_COUNTS:
            out[0] = apt_to_counts(&first, &scale, &out[1]);
            break;
        case FROM_COUNTS:
            out[0] = apt_from_counts(first.numerator, &scale, first.denominator, &out[1]);
            break;
        case SHARE_NUMERATOR:
        case SHARE_DENOMINATOR:
            out[0] = apt_scale_of_share(&first, (uint32_t)in[3], &share);
            out[1] = in[0] == SHARE_NUMERATOR ? share.numerator : share.denominator;
            break;
        default:
            out[0] = narrow(in[0], &first, &scale, &out[1]);
            break;
        }
        if (fwrite(out, sizeof(out[0]), 2U, stdout) != 2U) {
            return 1;
        }
    }
    return 0;
}

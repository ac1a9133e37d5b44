/*
 * The accessors with a bound, each in a separate function that is called many times. Valgrind counts
 * their instructions.
 *
 *     accessors NAME    decode, decode_packed, encode or encode_unchecked
 */
#include "packed.h"
#include "stagewire_apt/stagewire_apt.h"

#include <stdio.h>
#include <string.h>

#define CALLS 1000

__attribute__((noinline)) apt_status decode(
    const uint8_t *frame, size_t size, apt_mot_get_dcstatusupdate *message)
{
    return apt_mot_get_dcstatusupdate_decode(frame, size, message);
}

/* Hand-written code with the same checks and the same struct. */
__attribute__((noinline)) apt_status decode_packed(
    const uint8_t *frame, size_t size, apt_mot_get_dcstatusupdate *message)
{
    const struct packed_status *it = (const void *)frame;
    if (size != sizeof *it || it->header.id != APT_MOT_GET_DCSTATUSUPDATE_ID
        || it->header.length != APT_MOT_GET_DCSTATUSUPDATE_LENGTH
        || (it->header.dest & APT_DATA_FLAG) == 0U) {
        return APT_WRONG_LENGTH;
    }
    message->chan_ident = it->chan_ident;
    message->position = it->position;
    message->velocity = it->velocity;
    message->reserved = it->reserved;
    message->status_bits = it->status_bits;
    return APT_OK;
}

__attribute__((noinline)) apt_status encode(
    const apt_mot_move_absolute *move, apt_addresses addresses, uint8_t *out, size_t cap)
{
    return apt_mot_move_absolute_encode(move, addresses, out, cap);
}

__attribute__((noinline)) apt_status encode_unchecked(
    const apt_mot_move_absolute *move, apt_addresses addresses, uint8_t *out, size_t cap)
{
    return apt_mot_move_absolute_encode_unchecked(move, addresses, out, cap);
}

int main(int argc, char **argv)
{
    const char *const name = argc == 2 ? argv[1] : "";
    apt_mot_get_dcstatusupdate status = {1U, 200000, 10, 0U, 0x80000400U};
    const apt_mot_move_absolute move = {1U, 200000};
    uint8_t frame[APT_MOT_GET_DCSTATUSUPDATE_SIZE];
    uint8_t out[APT_MOT_MOVE_ABSOLUTE_SIZE];
    apt_status verdict =
        apt_mot_get_dcstatusupdate_encode(&status, apt_to_host(0x50U), frame, sizeof frame);
    int i;
    for (i = 0; i < CALLS && verdict == APT_OK; ++i) {
        if (strcmp(name, "decode") == 0) {
            verdict = decode(frame, sizeof frame, &status);
        } else if (strcmp(name, "decode_packed") == 0) {
            verdict = decode_packed(frame, sizeof frame, &status);
        } else if (strcmp(name, "encode") == 0) {
            verdict = encode(&move, apt_host_to(0x50U), out, sizeof out);
        } else if (strcmp(name, "encode_unchecked") == 0) {
            verdict = encode_unchecked(&move, apt_host_to(0x50U), out, sizeof out);
        } else {
            return 2;
        }
    }
    printf("%d %ld\n", CALLS, (long)status.position);
    return (int)verdict;
}

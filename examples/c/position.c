/*
 * Reads the position of an axis of an MS-2000. A reply has no frame: its meaning depends on the request.
 *
 *     position PORT AXIS      AXIS is X, Y or Z
 *
 * Exit status: 0 success, 1 no reply, 2 wrong usage.
 */
#include "serial.h"
#include "stagewire_ms2000/quantities.h"
#include "stagewire_ms2000/stagewire_ms2000.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#define ANSWER_MS 1000

static const ms2000_scale POSITION = MS2000_SCALE_POSITION;

static bool read_position(const struct serial *port, uint8_t axis, int64_t *nanometres)
{
    const int64_t until = serial_now() + ANSWER_MS;
    uint8_t bytes[MS2000_READ_MOTOR_POSITION_SIZE];
    ms2000_read_motor_position_reply reply;
    ms2000_replies replies;
    ms2000_event event;

    ms2000_replies_init(&replies);
    if (ms2000_read_motor_position_encode(axis, bytes, sizeof(bytes)) != MS2000_OK
        || ms2000_replies_sent(&replies, bytes, sizeof(bytes)) != MS2000_OK
        || !serial_send(port, bytes, sizeof(bytes))) {
        return false;
    }
    for (;;) {
        const uint8_t *next = bytes;
        size_t left = serial_receive(port, until, bytes, sizeof(bytes));

        if (left == 0U) {
            return false;
        }
        while (ms2000_replies_next(&replies, &next, &left, &event) != MS2000_EVENT_NONE) {
            if (event.kind == MS2000_EVENT_MESSAGE) {
                return ms2000_read_motor_position_reply_decode(event.bytes, event.size, &reply)
                    == MS2000_OK
                    && ms2000_from_counts(reply.position, &POSITION, 1000, nanometres)
                    == MS2000_OK;
            }
        }
    }
}

int main(int argc, char **argv)
{
    static const char NAMES[] = "XYZ";
    static const uint8_t AXES[] = {MS2000_AXIS_X, MS2000_AXIS_Y, MS2000_AXIS_Z};
    const char *found = (argc == 3 && strlen(argv[2]) == 1U) ? strchr(NAMES, argv[2][0]) : NULL;
    int64_t nanometres;
    struct serial port;

    if (found == NULL) {
        (void)fprintf(stderr, "usage: %s PORT X|Y|Z\n", argv[0]);
        return 2;
    }
    if (!serial_open(&port, argv[1], B9600)
        || !read_position(&port, AXES[found - NAMES], &nanometres)) {
        return 1;
    }
    (void)printf("%s is at %" PRId64 " nm\n", argv[2], nanometres);
    return 0;
}

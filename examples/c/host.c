/*
 * A host for the controller in firmware.c, or for a real one with an MLS203 stage, over a serial port.
 *
 *     host PORT                       prints the controller and its velocity
 *     host PORT VELOCITY POSITION     sets the velocity (um/s), moves to the position (um), and waits
 *
 * Exit status: 0 success, 1 no reply or an error, 2 wrong usage.
 */
#include "serial.h"
#include "stagewire_apt/quantities.h"
#include "stagewire_apt/stagewire_apt.h"

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#define DEVICE 0x21U /* the card in the first bay */
#define ANSWER_MS 1000 /* timeout of a reply */
#define MOVE_MS 10000 /* timeout of a move */

static const apt_scale POSITION = APT_SCALE_MLS203_BBD10X_POSITION;
static const apt_scale VELOCITY = APT_SCALE_MLS203_BBD10X_VELOCITY;
static const apt_scale ACCELERATION = APT_SCALE_MLS203_BBD10X_ACCELERATION;

/* A port, and the bytes received from it. */
struct line {
    struct serial port;
    apt_parser parser;
    uint8_t bytes[256];
    const uint8_t *next;
    size_t left;
};

/* Wait for a message of the controller; ignore other messages. */
static bool wait_for(struct line *line, uint16_t id, apt_event *event, int64_t milliseconds)
{
    const int64_t until = serial_now() + milliseconds;

    do {
        while (apt_parser_next(&line->parser, &line->next, &line->left, event) != APT_EVENT_NONE) {
            if (event->kind == APT_EVENT_MESSAGE && apt_id_of(event->bytes) == id
                && apt_addresses_of(event->bytes).source == DEVICE) {
                return true;
            }
        }
        line->next = line->bytes;
        line->left = serial_receive(&line->port, until, line->bytes, sizeof(line->bytes));
    } while (line->left > 0U);
    return false;
}

/* Read the hardware information and print it. */
static bool say_who(struct line *line)
{
    const apt_hw_req_info request = APT_HW_REQ_INFO_INIT;
    uint8_t frame[APT_HW_REQ_INFO_SIZE];
    apt_hw_get_info info;
    apt_event event;

    if (apt_hw_req_info_encode(&request, apt_host_to(DEVICE), frame, sizeof(frame)) != APT_OK
        || !serial_send(&line->port, frame, sizeof(frame))
        || !wait_for(line, APT_HW_GET_INFO_ID, &event, ANSWER_MS)
        || apt_hw_get_info_decode(event.bytes, event.size, &info) != APT_OK) {
        return false;
    }
    (void)printf("%.8s, serial number %" PRId32 "\n", info.model_number, info.serial_number);
    return true;
}

/* Read the velocity parameters and print them in um/s and um/s^2. */
static bool read_profile(struct line *line, apt_mot_get_velparams *profile)
{
    const apt_mot_req_velparams request = {APT_CHANNEL_CHAN1, 0};
    uint8_t frame[APT_MOT_REQ_VELPARAMS_SIZE];
    int64_t velocity;
    int64_t acceleration;
    apt_event event;

    if (apt_mot_req_velparams_encode(&request, apt_host_to(DEVICE), frame, sizeof(frame)) != APT_OK
        || !serial_send(&line->port, frame, sizeof(frame))
        || !wait_for(line, APT_MOT_GET_VELPARAMS_ID, &event, ANSWER_MS)
        || apt_mot_get_velparams_decode(event.bytes, event.size, profile) != APT_OK
        || apt_from_counts(profile->max_velocity, &VELOCITY, 1000, &velocity) != APT_OK
        || apt_from_counts(profile->acceleration, &ACCELERATION, 1000, &acceleration) != APT_OK) {
        return false;
    }
    (void)printf("velocity %" PRId64 " um/s, ", velocity);
    (void)printf("acceleration %" PRId64 " um/s^2\n", acceleration);
    return true;
}

/* Set the velocity; keep the acceleration. */
static bool set_velocity(struct line *line, int64_t velocity_um_s, const apt_mot_get_velparams *now)
{
    const apt_ratio velocity = {velocity_um_s, 1000};
    apt_mot_set_velparams set = APT_MOT_SET_VELPARAMS_INIT;
    uint8_t frame[APT_MOT_SET_VELPARAMS_SIZE];

    set.chan_ident = now->chan_ident;
    set.acceleration = now->acceleration;
    if (apt_to_counts_uint32(&velocity, &VELOCITY, &set.max_velocity) != APT_OK) {
        (void)fprintf(stderr, "velocity out of range: %" PRId64 " um/s\n", velocity_um_s);
        return false;
    }
    return apt_mot_set_velparams_encode(&set, apt_host_to(DEVICE), frame, sizeof(frame)) == APT_OK
        && serial_send(&line->port, frame, sizeof(frame));
}

/* Move, and wait until the controller reports the end of the move. */
static bool move_to(struct line *line, int64_t position_um)
{
    const apt_ratio position = {position_um, 1000};
    apt_mot_move_absolute move = {APT_CHANNEL_CHAN1, 0};
    uint8_t frame[APT_MOT_MOVE_ABSOLUTE_SIZE];
    apt_mot_move_completed_dc ended;
    apt_event event;
    int64_t reached;

    if (apt_to_counts_int32(&position, &POSITION, &move.absolute_distance) != APT_OK) {
        (void)fprintf(stderr, "position out of range: %" PRId64 " um\n", position_um);
        return false;
    }
    if (apt_mot_move_absolute_encode(&move, apt_host_to(DEVICE), frame, sizeof(frame)) != APT_OK
        || !serial_send(&line->port, frame, sizeof(frame))
        || !wait_for(line, APT_MOT_MOVE_COMPLETED_ID, &event, MOVE_MS)
        || apt_mot_move_completed_dc_decode(event.bytes, event.size, &ended) != APT_OK
        || apt_from_counts(ended.position, &POSITION, 1000, &reached) != APT_OK) {
        return false;
    }
    (void)printf("moved to %" PRId64 " um\n", reached);
    return reached == position_um;
}

static bool read_number(const char *text, int64_t *value)
{
    char *end;

    errno = 0;
    *value = strtoll(text, &end, 10);
    return errno == 0 && end != text && *end == '\0';
}

int main(int argc, char **argv)
{
    struct line line;
    apt_mot_get_velparams profile;
    int64_t velocity = 0;
    int64_t position = 0;

    if ((argc != 2 && argc != 4)
        || (argc == 4 && (!read_number(argv[2], &velocity) || !read_number(argv[3], &position)))) {
        (void)fprintf(stderr, "usage: %s PORT [VELOCITY POSITION], in um/s and um\n", argv[0]);
        return 2;
    }
    if (!serial_open(&line.port, argv[1], B115200)) {
        return 1;
    }
    line.left = 0U;
    apt_parser_init(&line.parser, APT_END_HOST);
    if (!say_who(&line) || !read_profile(&line, &profile)) {
        return 1;
    }
    if (argc == 4
        && (!set_velocity(&line, velocity, &profile) || !read_profile(&line, &profile)
            || !move_to(&line, position))) {
        return 1;
    }
    return 0;
}

/*
 * One channel of a brushless DC controller. It identifies itself, keeps a velocity profile, moves on
 * command, and reports the end of a move. The motor is simulated by a counter.
 */
#include "firmware.h"

#define DEVICE 0x21U /* the card in the first bay */

static const apt_hw_get_info INFO = {
    10000001, "MADE-UP", APT_HARDWARE_TYPE_BRUSHLESS_DC_CONTROLLER, {0, 0, 1, 0}, "no motor", 1};

static void answer(struct firmware *it, const uint8_t *frame, size_t size)
{
    const apt_addresses back = apt_reply_to(frame);
    uint8_t out[APT_HW_GET_INFO_SIZE]; /* the longest reply */
    apt_mot_get_velparams report;
    apt_mot_move_absolute move;

    if (apt_addresses_of(frame).dest != DEVICE) {
        return;
    }
    switch (apt_id_of(frame)) {
    case APT_HW_REQ_INFO_ID:
        if (apt_hw_get_info_encode(&INFO, back, out, sizeof(out)) == APT_OK) {
            firmware_write(out, APT_HW_GET_INFO_SIZE);
        }
        break;
    case APT_MOT_SET_VELPARAMS_ID: /* if decoding fails, the profile is unchanged */
        (void)apt_mot_set_velparams_decode(frame, size, &it->profile);
        break;
    case APT_MOT_REQ_VELPARAMS_ID:
        report.chan_ident = it->profile.chan_ident;
        report.min_velocity = it->profile.min_velocity;
        report.acceleration = it->profile.acceleration;
        report.max_velocity = it->profile.max_velocity;
        if (apt_mot_get_velparams_encode(&report, back, out, sizeof(out)) == APT_OK) {
            firmware_write(out, APT_MOT_GET_VELPARAMS_SIZE);
        }
        break;
    case APT_MOT_MOVE_ABSOLUTE_ID: /* only the form with a position is supported */
        if (apt_mot_move_absolute_decode(frame, size, &move) == APT_OK) {
            it->target = move.absolute_distance;
            it->waiting = back;
            it->moving = true;
        }
        break;
    default: /* not supported */
        break;
    }
}

static void turn(struct firmware *it)
{
    const int64_t way = (int64_t)it->target - it->position;
    const int64_t most = (it->profile.max_velocity >> 16) + 1; /* counts per cycle; at least 1 */
    uint8_t out[APT_MOT_MOVE_COMPLETED_DC_SIZE];
    apt_mot_move_completed_dc ended = APT_MOT_MOVE_COMPLETED_DC_INIT;

    if (way > most || way < -most) {
        it->position += (int32_t)(way < 0 ? -most : most);
    } else if (it->moving) {
        it->position = it->target;
        it->moving = false;
        ended.chan_ident = APT_CHANNEL_CHAN1;
        ended.position = it->position;
        ended.status_bits = APT_DC_STATUS_BITS_SETTLED | APT_DC_STATUS_BITS_CHANNEL_ENABLED;
        if (apt_mot_move_completed_dc_encode(&ended, it->waiting, out, sizeof(out)) == APT_OK) {
            firmware_write(out, sizeof(out));
        }
    }
}

void firmware_init(struct firmware *it)
{
    /* The default: 1000 mm/s^2 and 10 mm/s, in counts of an MLS203. */
    static const apt_mot_set_velparams profile = {APT_CHANNEL_CHAN1, 0, 13744, 1342177};

    apt_parser_init(&it->parser, APT_END_DEVICE);
    it->profile = profile;
    it->position = 0;
    it->target = 0;
    it->moving = false;
}

void firmware_poll(struct firmware *it)
{
    uint8_t bytes[64];
    const uint8_t *next = bytes;
    size_t left = firmware_read(bytes, sizeof(bytes));
    apt_event event;
    apt_event_kind kind;

    while ((kind = apt_parser_next(&it->parser, &next, &left, &event)) != APT_EVENT_NONE) {
        if (kind == APT_EVENT_MESSAGE) {
            answer(it, event.bytes, event.size);
        }
    }
    turn(it);
}

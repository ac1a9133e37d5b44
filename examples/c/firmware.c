/*
 * One channel of a brushless DC controller. It identifies itself, keeps its settings, moves on
 * command, and reports its status and the end of each movement. pics.toml declares what it supports.
 */
#include "firmware.h"

#define DEVICE 0x21U /* the card in the first bay */
#define CHANNEL APT_CHANNEL_CHAN1
#define UPDATE_CYCLES 977U /* 100 ms */
#define GAP_CYCLES 488U /* 50 ms: after this silence, the rest of a frame will not arrive */

/* Encode a message and send it. */
#define SEND(name, NAME, message, to) \
    do { \
        uint8_t frame_[APT_##NAME##_SIZE]; \
        if (apt_##name##_encode((message), (to), frame_, sizeof(frame_)) == APT_OK) { \
            firmware_write(frame_, sizeof(frame_)); \
        } \
    } while (0)

static const apt_hw_get_info INFO = {
    .serial_number = 10000001,
    .model_number = "ION001",
    .type = APT_HARDWARE_TYPE_BRUSHLESS_DC_CONTROLLER,
    .software_version = {0, 0, 1, 0},
    .notes = "made up, without a motor",
    .nchs = 1,
};

static uint32_t status_bits(const struct firmware *it)
{
    uint32_t bits = it->enabled ? APT_DC_STATUS_BITS_CHANNEL_ENABLED : 0U;

    if (it->motor.state != MOTOR_AT_REST) {
        bits |= it->motor.velocity < 0 ? APT_DC_STATUS_BITS_MOVING_REVERSE
                                       : APT_DC_STATUS_BITS_MOVING_FORWARD;
    } else if (it->enabled) {
        bits |= APT_DC_STATUS_BITS_SETTLED;
    }
    return bits;
}

/* The velocity in a status: whole counts per cycle. */
static int16_t velocity_of(const struct firmware *it)
{
    return (int16_t)(it->motor.velocity / 65536);
}

/* The fields of each message that reports the status. */
#define STATUS(it) \
    { \
        CHANNEL, motor_position(&(it)->motor), velocity_of(it), 0, status_bits(it) \
    }

/* Report the end of a movement, completed or stopped. */
static void report_end(const struct firmware *it, bool stopped)
{
    if (!it->reports_ends) {
        return;
    }
    if (stopped) {
        const apt_mot_move_stopped_dc end = STATUS(it);
        SEND(mot_move_stopped_dc, MOT_MOVE_STOPPED_DC, &end, it->mover);
    } else {
        const apt_mot_move_completed_dc end = STATUS(it);
        SEND(mot_move_completed_dc, MOT_MOVE_COMPLETED_DC, &end, it->mover);
    }
}

static void move(struct firmware *it, const uint8_t *frame, int32_t target)
{
    if (it->enabled) {
        it->mover = apt_reply_to(frame);
        motor_move(&it->motor, target);
    }
}

/* Carry out a command that moves or stops the motor; return false for any other message. */
static bool command(struct firmware *it, const uint8_t *frame, size_t size)
{
    const int32_t here = motor_position(&it->motor);
    const bool has_packet = size > APT_HEADER_SIZE;
    apt_mot_move_absolute absolute = {CHANNEL, it->absolute.absolute_position};
    apt_mot_move_relative relative = {CHANNEL, it->relative.relative_distance};
    apt_mot_move_stop stop;

    switch (apt_id_of(frame)) {
    case APT_MOT_MOVE_ABSOLUTE_ID: /* without a packet, to the stored position */
        if (!has_packet || apt_mot_move_absolute_decode(frame, size, &absolute) == APT_OK) {
            move(it, frame, absolute.absolute_distance);
        }
        return true;
    case APT_MOT_MOVE_RELATIVE_ID:
        if (!has_packet || apt_mot_move_relative_decode(frame, size, &relative) == APT_OK) {
            move(it, frame, here + relative.relative_distance);
        }
        return true;
    case APT_MOT_MOVE_STOP_ID:
        if (apt_mot_move_stop_decode(frame, size, &stop) == APT_OK
            && it->motor.state != MOTOR_AT_REST) {
            it->mover = apt_reply_to(frame);
            motor_stop(&it->motor, stop.stop_mode == APT_STOP_MODE_IMMEDIATE);
        }
        return true;
    default:
        return false;
    }
}

/* Change a setting; return false for any other message. If decoding fails, nothing changes. */
static bool set(struct firmware *it, const uint8_t *frame, size_t size)
{
    apt_mot_set_velparams profile;
    apt_mot_set_poscounter counter;
    apt_mod_set_chanenablestate enable;

    switch (apt_id_of(frame)) {
    case APT_MOT_SET_VELPARAMS_ID:
        if (apt_mot_set_velparams_decode(frame, size, &profile) == APT_OK) {
            it->min_velocity = profile.min_velocity;
            it->motor.acceleration = profile.acceleration;
            it->motor.max_velocity = profile.max_velocity;
        }
        return true;
    case APT_MOT_SET_MOVERELPARAMS_ID:
        (void)apt_mot_set_moverelparams_decode(frame, size, &it->relative);
        return true;
    case APT_MOT_SET_MOVEABSPARAMS_ID:
        (void)apt_mot_set_moveabsparams_decode(frame, size, &it->absolute);
        return true;
    case APT_MOT_SET_POSCOUNTER_ID:
        if (apt_mot_set_poscounter_decode(frame, size, &counter) == APT_OK) {
            motor_count_from(&it->motor, counter.position);
        }
        return true;
    case APT_MOD_SET_CHANENABLESTATE_ID:
        if (apt_mod_set_chanenablestate_decode(frame, size, &enable) == APT_OK) {
            it->enabled = enable.enable_state == APT_ENABLE_STATE_ENABLE;
            if (!it->enabled && it->motor.state != MOTOR_AT_REST) {
                motor_stop(&it->motor, true);
            }
        }
        return true;
    case APT_HW_START_UPDATEMSGS_ID:
    case APT_HW_STOP_UPDATEMSGS_ID:
        it->updates = apt_id_of(frame) == APT_HW_START_UPDATEMSGS_ID;
        it->listener = apt_reply_to(frame);
        it->last_update = it->now;
        return true;
    case APT_MOT_SUSPEND_ENDOFMOVEMSGS_ID:
    case APT_MOT_RESUME_ENDOFMOVEMSGS_ID:
        it->reports_ends = apt_id_of(frame) == APT_MOT_RESUME_ENDOFMOVEMSGS_ID;
        return true;
    default:
        return false;
    }
}

/* Answer a request. Anything else is not supported and gets no answer. */
static void answer(const struct firmware *it, const uint8_t *frame)
{
    const apt_addresses back = apt_reply_to(frame);
    const apt_mot_get_velparams velocity = {CHANNEL, it->min_velocity, it->motor.acceleration, it->motor.max_velocity};
    const apt_mot_get_moverelparams relative = {CHANNEL, it->relative.relative_distance};
    const apt_mot_get_moveabsparams absolute = {CHANNEL, it->absolute.absolute_position};
    const apt_mot_get_poscounter counter = {CHANNEL, motor_position(&it->motor)};
    const apt_mot_get_statusbits bits = {CHANNEL, status_bits(it)};
    const apt_mot_get_dcstatusupdate now = STATUS(it);
    const apt_mod_get_chanenablestate enable = {CHANNEL, it->enabled ? APT_ENABLE_STATE_ENABLE : APT_ENABLE_STATE_DISABLE};

    switch (apt_id_of(frame)) {
    case APT_HW_REQ_INFO_ID:
        SEND(hw_get_info, HW_GET_INFO, &INFO, back);
        break;
    case APT_MOD_REQ_CHANENABLESTATE_ID:
        SEND(mod_get_chanenablestate, MOD_GET_CHANENABLESTATE, &enable, back);
        break;
    case APT_MOT_REQ_VELPARAMS_ID:
        SEND(mot_get_velparams, MOT_GET_VELPARAMS, &velocity, back);
        break;
    case APT_MOT_REQ_MOVERELPARAMS_ID:
        SEND(mot_get_moverelparams, MOT_GET_MOVERELPARAMS, &relative, back);
        break;
    case APT_MOT_REQ_MOVEABSPARAMS_ID:
        SEND(mot_get_moveabsparams, MOT_GET_MOVEABSPARAMS, &absolute, back);
        break;
    case APT_MOT_REQ_POSCOUNTER_ID:
        SEND(mot_get_poscounter, MOT_GET_POSCOUNTER, &counter, back);
        break;
    case APT_MOT_REQ_STATUSBITS_ID:
        SEND(mot_get_statusbits, MOT_GET_STATUSBITS, &bits, back);
        break;
    case APT_MOT_REQ_DCSTATUSUPDATE_ID:
        SEND(mot_get_dcstatusupdate, MOT_GET_DCSTATUSUPDATE, &now, back);
        break;
    default:
        break;
    }
}

static void take(struct firmware *it, const apt_event *event)
{
    const uint8_t *frame = event->bytes;

    if (event->kind == APT_EVENT_MESSAGE && apt_addresses_of(frame).dest == DEVICE
        && !command(it, frame, event->size) && !set(it, frame, event->size)) {
        answer(it, frame);
    }
}

/* Process received messages. After a gap, abandon an incomplete frame. */
static void receive(struct firmware *it)
{
    uint8_t bytes[64];
    const uint8_t *next = bytes;
    size_t left = firmware_read(bytes, sizeof(bytes));
    apt_event event;

    if (left > 0U) {
        it->last_byte = it->now;
    } else if (it->now - it->last_byte >= GAP_CYCLES) {
        while (apt_parser_abandon(&it->parser, &event) != APT_EVENT_NONE) {
            take(it, &event);
        }
    }
    while (apt_parser_next(&it->parser, &next, &left, &event) != APT_EVENT_NONE) {
        take(it, &event);
    }
}

void firmware_init(struct firmware *it)
{
    apt_parser_init(&it->parser, APT_END_DEVICE);
    it->now = firmware_cycles();
    it->last_byte = it->now;
    motor_init(&it->motor);
    it->motor.acceleration = 13744; /* 1000 mm/s^2 of an MLS203 */
    it->motor.max_velocity = 1342177; /* 10 mm/s */
    it->enabled = true;
    it->reports_ends = true;
    it->updates = false;
    it->min_velocity = 0;
    it->relative.relative_distance = 0;
    it->absolute.absolute_position = 0;
}

void firmware_poll(struct firmware *it)
{
    const uint32_t now = firmware_cycles();

    for (; it->now != now; it->now++) {
        const bool stopping = it->motor.state == MOTOR_STOPPING;
        if (motor_turn(&it->motor)) {
            report_end(it, stopping);
        }
    }
    receive(it);
    if (it->updates && now - it->last_update >= UPDATE_CYCLES) {
        const apt_mot_get_dcstatusupdate report = STATUS(it);
        it->last_update += UPDATE_CYCLES;
        SEND(mot_get_dcstatusupdate, MOT_GET_DCSTATUSUPDATE, &report, it->listener);
    }
}

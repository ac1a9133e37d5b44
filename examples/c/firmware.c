/*
 * The loop of a controller with one DC motor. It identifies itself, keeps its settings, moves on command,
 * and reports its status and the end of each motion. unit.h says which controller it is.
 */
#include "firmware.h"

#include "settings.h"
#include "unit.h"

#define CYCLES(milliseconds) (((milliseconds) * (uint32_t)UNIT.cycles + 512U) / 1024U)
#define UPDATE CYCLES(100U)
#define GAP CYCLES(50U) /* after this silence, the rest of a frame will not arrive */
#define IDENTIFIES CYCLES(5000U)
#define FLASH CYCLES(250U)
#define MOST_UNACKNOWLEDGED 50U

/* Encode a message and send it. */
#define SEND(name, NAME, message, to) \
    do { \
        uint8_t frame_[APT_##NAME##_SIZE]; \
        if (apt_##name##_encode((message), (to), frame_, sizeof(frame_)) == APT_OK) { \
            firmware_write(frame_, sizeof(frame_)); \
        } \
    } while (0)

/* The fields of each message that reports the status. The velocity is in whole counts per cycle. */
#define STATUS(motion) \
    { \
        CHANNEL, motor_position(&(motion)->motor), (int16_t)((motion)->motor.velocity / 65536), 0, \
            motion_status_bits(motion) \
    }

/*
 * Return whether to send a status message that was not requested. Over USB it is lost if the host has not
 * acknowledged the last fifty, because the host may have crashed.
 */
static bool may_report(struct firmware *it)
{
    if (!UNIT.usb) {
        return true;
    }
    if (it->unacknowledged == MOST_UNACKNOWLEDGED) {
        return false;
    }
    it->unacknowledged++;
    return true;
}

static void report_end(struct firmware *it, enum motion_end end)
{
    const apt_addresses to = it->motion.mover;
    const apt_mot_move_completed_dc completed = STATUS(&it->motion);
    const apt_mot_move_stopped_dc stopped = STATUS(&it->motion);
    const apt_mot_move_homed homed = {CHANNEL, 0};

    if (!it->reports_ends || !may_report(it)) {
        return;
    }
    if (end == MOTION_STOPPED) {
        SEND(mot_move_stopped_dc, MOT_MOVE_STOPPED_DC, &stopped, to);
    } else if (end == MOTION_HOMED) {
        SEND(mot_move_homed, MOT_MOVE_HOMED, &homed, to);
    } else {
        SEND(mot_move_completed_dc, MOT_MOVE_COMPLETED_DC, &completed, to);
    }
}

/* Send the status if it is time for it. */
static void update(struct firmware *it)
{
    const apt_mot_get_dcstatusupdate report = STATUS(&it->motion);

    if (!it->updates || it->now - it->last_update < UPDATE) {
        return;
    }
    it->last_update += UPDATE;
    if (may_report(it)) {
        SEND(mot_get_dcstatusupdate, MOT_GET_DCSTATUSUPDATE, &report, it->listener);
    }
}

/* Light the lamp, in the cases that a setting allows. */
static void light(struct firmware *it)
{
    const uint32_t at_limit = APT_DC_STATUS_BITS_FORWARD_HARDWARE_LIMIT | APT_DC_STATUS_BITS_REVERSE_HARDWARE_LIMIT;
    const bool flash = it->now / FLASH % 2U == 0U;
    apt_mot_get_avmodes modes;
    bool lit = false;

    if (!SETTING_READ(avmodes, AVMODES, &modes)) {
        return;
    }
    if ((modes.mode_bits & APT_LED_MODE_LEDMODE_MOVING) != 0U) {
        lit = it->motion.doing != DOING_NOTHING;
    }
    if ((modes.mode_bits & APT_LED_MODE_LEDMODE_LIMITSWITCH) != 0U) {
        lit = lit || (flash && (motion_status_bits(&it->motion) & at_limit) != 0U);
    }
    if ((modes.mode_bits & APT_LED_MODE_LEDMODE_IDENT) != 0U) {
        lit = lit || (flash && it->identifies_for > 0U);
    }
    if (lit != it->lit) {
        it->lit = lit;
        firmware_lamp(lit);
    }
}

/* Change the state of the controller; return false for any other message. */
static bool obey(struct firmware *it, const uint8_t *frame, size_t size)
{
    apt_mot_set_poscounter position;
    apt_mot_set_enccounter encoder;
    apt_mot_set_eepromparams saved;
    apt_mod_set_chanenablestate enable;
    apt_mod_set_digoutputs outputs;

    switch (apt_id_of(frame)) {
    case APT_MOD_IDENTIFY_ID:
        it->identifies_for = IDENTIFIES;
        return true;
    case APT_HW_DISCONNECT_ID:
        it->updates = false;
        return true;
    case APT_HW_START_UPDATEMSGS_ID:
    case APT_HW_STOP_UPDATEMSGS_ID:
        it->updates = apt_id_of(frame) == APT_HW_START_UPDATEMSGS_ID;
        it->listener = apt_reply_to(frame);
        it->last_update = it->now;
        return true;
    case APT_MOT_ACK_DCSTATUSUPDATE_ID:
        it->unacknowledged = 0U;
        return true;
    case APT_MOT_SUSPEND_ENDOFMOVEMSGS_ID:
    case APT_MOT_RESUME_ENDOFMOVEMSGS_ID:
        it->reports_ends = apt_id_of(frame) == APT_MOT_RESUME_ENDOFMOVEMSGS_ID;
        return true;
    case APT_MOD_SET_CHANENABLESTATE_ID:
        if (apt_mod_set_chanenablestate_decode(frame, size, &enable) == APT_OK && enable.chan_ident == CHANNEL) {
            motion_enable(&it->motion, enable.enable_state == APT_ENABLE_STATE_ENABLE);
        }
        return true;
    case APT_MOD_SET_DIGOUTPUTS_ID:
        if (UNIT.has_outputs && apt_mod_set_digoutputs_decode(frame, size, &outputs) == APT_OK) {
            it->outputs = outputs.bit;
            firmware_outputs(outputs.bit);
        }
        return true;
    case APT_MOT_SET_POSCOUNTER_ID:
        if (apt_mot_set_poscounter_decode(frame, size, &position) == APT_OK && position.chan_ident == CHANNEL) {
            motor_count_from(&it->motion.motor, position.position);
        }
        return true;
    case APT_MOT_SET_ENCCOUNTER_ID:
        if (apt_mot_set_enccounter_decode(frame, size, &encoder) == APT_OK && encoder.chan_ident == CHANNEL) {
            it->motion.encoder_zero = motor_place(&it->motion.motor) - encoder.encoder_count;
        }
        return true;
    case APT_MOT_SET_EEPROMPARAMS_ID:
        if (apt_mot_set_eepromparams_decode(frame, size, &saved) == APT_OK && saved.chan_ident == CHANNEL) {
            settings_save(saved.msg_id);
        }
        return true;
    default:
        return false;
    }
}

/* Answer a request. Anything else is not supported and gets no answer. */
static void answer(const struct firmware *it, const uint8_t *frame)
{
    const struct motion *motion = &it->motion;
    const apt_addresses back = apt_reply_to(frame);
    const apt_hub_get_bayused bay = {APT_HUB_BAY_STANDALONE, 0};
    const apt_mod_get_digoutputs outputs = {it->outputs, 0};
    const uint8_t enabled = motion->enabled ? APT_ENABLE_STATE_ENABLE : APT_ENABLE_STATE_DISABLE;
    const apt_mod_get_chanenablestate enable = {CHANNEL, enabled};
    const apt_mot_get_poscounter position = {CHANNEL, motor_position(&motion->motor)};
    const apt_mot_get_enccounter encoder = {CHANNEL, motion_encoder(motion)};
    const apt_mot_get_statusbits bits = {CHANNEL, motion_status_bits(motion)};
    const apt_mot_get_dcstatusupdate status = STATUS(motion);
    const uint16_t id = apt_id_of(frame);

    if (id == APT_HW_REQ_INFO_ID) {
        SEND(hw_get_info, HW_GET_INFO, &UNIT.info, back);
    } else if (id == APT_HUB_REQ_BAYUSED_ID && UNIT.usb) {
        SEND(hub_get_bayused, HUB_GET_BAYUSED, &bay, back);
    } else if (id == APT_MOD_REQ_DIGOUTPUTS_ID && UNIT.has_outputs) {
        SEND(mod_get_digoutputs, MOD_GET_DIGOUTPUTS, &outputs, back);
    }
    if (frame[2] != CHANNEL) {
        return;
    }
    switch (id) {
    case APT_MOD_REQ_CHANENABLESTATE_ID:
        SEND(mod_get_chanenablestate, MOD_GET_CHANENABLESTATE, &enable, back);
        break;
    case APT_MOT_REQ_POSCOUNTER_ID:
        SEND(mot_get_poscounter, MOT_GET_POSCOUNTER, &position, back);
        break;
    case APT_MOT_REQ_ENCCOUNTER_ID:
        SEND(mot_get_enccounter, MOT_GET_ENCCOUNTER, &encoder, back);
        break;
    case APT_MOT_REQ_STATUSBITS_ID:
        SEND(mot_get_statusbits, MOT_GET_STATUSBITS, &bits, back);
        break;
    case APT_MOT_REQ_DCSTATUSUPDATE_ID:
        SEND(mot_get_dcstatusupdate, MOT_GET_DCSTATUSUPDATE, &status, back);
        break;
    default:
        break;
    }
}

static void take(struct firmware *it, const apt_event *event)
{
    const uint8_t *frame = event->bytes;

    if (event->kind == APT_EVENT_MESSAGE && apt_addresses_of(frame).dest == UNIT.address
        && !motion_take(&it->motion, frame, event->size) && !settings_take(frame, event->size)
        && !obey(it, frame, event->size)) {
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
    } else if (it->now - it->last_byte >= GAP) {
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
    it->identifies_for = 0U;
    it->reports_ends = true;
    it->updates = false;
    it->unacknowledged = 0U;
    it->lit = false;
    it->outputs = 0U;
    settings_init();
    motion_init(&it->motion);
}

void firmware_poll(struct firmware *it)
{
    const uint32_t now = firmware_cycles();

    for (; it->now != now; it->now++) {
        const enum motion_end end = motion_turn(&it->motion);
        if (end != MOTION_CONTINUES) {
            report_end(it, end);
        }
        if (it->identifies_for > 0U) {
            it->identifies_for--;
        }
    }
    receive(it);
    update(it);
    light(it);
}

/*
 * Clockwise is forward, and positions rise forward. The settings of a unit decide which commands it has: without
 * MOT_JOGPARAMS it does not jog, without MOT_HOMEPARAMS it does not home, and so on.
 */
#include "motion.h"

#include "settings.h"
#include "unit.h"

/* Prepare a move with the settings for moves, without software limits. Its places are still to be set. */
static void prepare(struct move *move)
{
    apt_mot_get_velparams set;
    const bool known = SETTING_READ(velparams, VELPARAMS, &set);

    move->velocity = known ? set.max_velocity : 0U;
    move->acceleration = known ? set.acceleration : 0U;
    move->low = -MOTOR_FAR;
    move->high = MOTOR_FAR;
    move->brakes = false;
}

/* Whether software limits stop moves. */
static bool limits_moves(const apt_mot_get_limswitchparams *limits)
{
    const unsigned mode = limits->software_limit_mode & ~(unsigned)APT_SOFTWARE_LIMIT_MODE_ROTATION_STAGE;
    return mode == APT_SOFTWARE_LIMIT_MODE_STOP_IMMEDIATE || mode == APT_SOFTWARE_LIMIT_MODE_STOP_PROFILED;
}

/* Whether a limit switch is used, by its setting. */
static bool is_used(uint16_t hard_limit)
{
    return (hard_limit & ~(unsigned)APT_HARD_LIMIT_SWAPPED) != APT_HARD_LIMIT_IGNORE;
}

/* Start a motion, unless the motor cannot move. */
static void begin(struct motion *it, enum doing doing, const struct move *move, const uint8_t *frame)
{
    if (!it->enabled || move->velocity == 0U || move->acceleration == 0U) {
        return;
    }
    it->mover = apt_reply_to(frame);
    it->doing = doing;
    motor_move(&it->motor, move);
}

/* Start a motion that software limits end. */
static void begin_limited(struct motion *it, enum doing doing, struct move *move, const uint8_t *frame)
{
    apt_mot_get_limswitchparams limits;

    if (SETTING_READ(limswitchparams, LIMSWITCHPARAMS, &limits) && limits_moves(&limits)) {
        move->high = it->motor.zero + (int32_t)limits.cw_soft_limit;
        move->low = it->motor.zero + limits.ccw_soft_limit;
        move->brakes = (limits.software_limit_mode & APT_SOFTWARE_LIMIT_MODE_STOP_PROFILED)
            == APT_SOFTWARE_LIMIT_MODE_STOP_PROFILED;
    }
    begin(it, doing, move, frame);
}

/*
 * Move to a position. With a backlash distance above 0 the motor arrives on its way forward, and below 0 in
 * reverse: from the other side it goes beyond the target by the distance, and comes back.
 */
static void move_to(struct motion *it, int64_t position, const uint8_t *frame)
{
    apt_mot_get_genmoveparams backlash = {CHANNEL, 0};
    struct move move;
    int64_t rest;

    prepare(&move);
    if (move.acceleration == 0U) {
        return;
    }
    move.to = it->motor.zero + position;
    move.by = move.to;
    rest = motor_rest(&it->motor, move.acceleration);
    if (SETTING_READ(genmoveparams, GENMOVEPARAMS, &backlash)
        && ((backlash.backlash_distance > 0 && move.to < rest)
            || (backlash.backlash_distance < 0 && move.to > rest))) {
        move.by = move.to - backlash.backlash_distance;
    }
    begin_limited(it, DOING_MOVE, &move, frame);
}

static void move_absolute(struct motion *it, const uint8_t *frame, size_t size)
{
    apt_mot_get_moveabsparams kept = {CHANNEL, 0};
    apt_mot_move_absolute move = {CHANNEL, 0};

    if (size == APT_HEADER_SIZE) {
        if (SETTING_READ(moveabsparams, MOVEABSPARAMS, &kept)) {
            move_to(it, kept.absolute_position, frame);
        }
    } else if (apt_mot_move_absolute_decode(frame, size, &move) == APT_OK) {
        move_to(it, move.absolute_distance, frame);
    }
}

static void move_relative(struct motion *it, const uint8_t *frame, size_t size)
{
    const int64_t here = motor_position(&it->motor);
    apt_mot_get_moverelparams kept = {CHANNEL, 0};
    apt_mot_move_relative move = {CHANNEL, 0};

    if (size == APT_HEADER_SIZE) {
        if (SETTING_READ(moverelparams, MOVERELPARAMS, &kept)) {
            move_to(it, here + kept.relative_distance, frame);
        }
    } else if (apt_mot_move_relative_decode(frame, size, &move) == APT_OK) {
        move_to(it, here + move.relative_distance, frame);
    }
}

/* Set where a move goes in the direction of a message, 1 or 2: by a distance, or until a stop. */
static bool aim(const struct motion *it, struct move *move, uint8_t direction, int64_t distance)
{
    const int64_t way = direction == APT_MOVE_DIRECTION_FORWARD ? distance : -distance;

    move->by = motor_place(&it->motor) + way;
    move->to = move->by;
    return direction == APT_MOVE_DIRECTION_FORWARD || direction == APT_MOVE_DIRECTION_REVERSE;
}

static void move_velocity(struct motion *it, const uint8_t *frame, size_t size)
{
    apt_mot_move_velocity command;
    struct move move;

    prepare(&move);
    if (apt_mot_move_velocity_decode(frame, size, &command) == APT_OK
        && aim(it, &move, command.direction, MOTOR_FAR)) {
        begin_limited(it, DOING_MOVE, &move, frame);
    }
}

static void jog(struct motion *it, const uint8_t *frame, size_t size)
{
    apt_mot_get_jogparams set;
    apt_mot_move_jog command;
    struct move move;
    int64_t distance;

    if (!SETTING_READ(jogparams, JOGPARAMS, &set) || set.jog_max_velocity < 0 || set.jog_acceleration < 0
        || apt_mot_move_jog_decode(frame, size, &command) != APT_OK) {
        return;
    }
    prepare(&move);
    move.velocity = (uint32_t)set.jog_max_velocity;
    move.acceleration = (uint32_t)set.jog_acceleration;
    distance = set.jog_mode == APT_JOG_MODE_CONTINUOUS ? MOTOR_FAR : set.jog_step_size;
    if (aim(it, &move, command.direction, distance)) {
        begin_limited(it, DOING_JOG, &move, frame);
    }
}

/* Home: run into a limit switch, and leave it by the offset. Without a switch on its way it does not home. */
static void home(struct motion *it, const uint8_t *frame)
{
    apt_mot_get_homeparams set;
    apt_mot_get_limswitchparams limits;
    struct move move;
    bool forward;

    if (!SETTING_READ(homeparams, HOMEPARAMS, &set)
        || !SETTING_READ(limswitchparams, LIMSWITCHPARAMS, &limits)) {
        return;
    }
    forward = set.home_direction == APT_MOVE_DIRECTION_FORWARD;
    if (set.limit_switch != (forward ? APT_HOME_LIMIT_SWITCH_FORWARD : APT_HOME_LIMIT_SWITCH_REVERSE)
        || !is_used(forward ? limits.cw_hard_limit : limits.ccw_hard_limit)) {
        return;
    }
    prepare(&move);
    move.velocity = set.home_velocity;
    move.by = forward ? MOTOR_FAR : -MOTOR_FAR;
    move.to = forward ? (int64_t)it->motor.travel - set.offset_distance : set.offset_distance;
    if (it->enabled && move.velocity > 0U && move.acceleration > 0U) {
        it->homed = false;
    }
    begin(it, DOING_HOME, &move, frame);
}

/*
 * Stop; a motor at rest has stopped in the next cycle. If the message has no known mode, a jog stops as its
 * parameters say, and anything else brakes.
 */
static void stop(struct motion *it, const uint8_t *frame, size_t size)
{
    apt_mot_get_jogparams set;
    apt_mot_move_stop command;
    unsigned mode;

    if (apt_mot_move_stop_decode(frame, size, &command) != APT_OK) {
        return;
    }
    mode = command.stop_mode;
    if (mode != APT_STOP_MODE_IMMEDIATE && mode != APT_STOP_MODE_PROFILED && it->doing == DOING_JOG
        && SETTING_READ(jogparams, JOGPARAMS, &set)) {
        mode = set.jog_stop_mode;
    }
    it->mover = apt_reply_to(frame);
    it->doing = DOING_STOP;
    motor_stop(&it->motor, mode == APT_STOP_MODE_IMMEDIATE);
}

bool motion_take(struct motion *it, const uint8_t *frame, size_t size)
{
    const unsigned channel = size > APT_HEADER_SIZE ? apt_get_16(&frame[APT_HEADER_SIZE]) : frame[2];

    if (channel != CHANNEL) {
        return false;
    }
    switch (apt_id_of(frame)) {
    case APT_MOT_MOVE_ABSOLUTE_ID: /* without a packet, to the stored position */
        move_absolute(it, frame, size);
        return true;
    case APT_MOT_MOVE_RELATIVE_ID:
        move_relative(it, frame, size);
        return true;
    case APT_MOT_MOVE_VELOCITY_ID:
        move_velocity(it, frame, size);
        return true;
    case APT_MOT_MOVE_JOG_ID:
        jog(it, frame, size);
        return true;
    case APT_MOT_MOVE_HOME_ID:
        home(it, frame);
        return true;
    case APT_MOT_MOVE_STOP_ID:
        stop(it, frame, size);
        return true;
    default:
        return false;
    }
}

void motion_init(struct motion *it)
{
    motor_init(&it->motor, &UNIT.stage);
    it->doing = DOING_NOTHING;
    it->enabled = true;
    it->homed = false;
    it->encoder_zero = it->motor.zero;
}

void motion_enable(struct motion *it, bool enabled)
{
    it->enabled = enabled;
    if (!enabled && it->doing != DOING_NOTHING) {
        it->doing = DOING_STOP;
        motor_stop(&it->motor, true);
    }
}

enum motion_end motion_turn(struct motion *it)
{
    const enum doing did = it->doing;

    if (!motor_turn(&it->motor)) {
        return MOTION_CONTINUES;
    }
    it->doing = DOING_NOTHING;
    if (did == DOING_HOME) {
        it->homed = true;
        motor_count_from(&it->motor, 0);
        it->encoder_zero = it->motor.zero;
        return MOTION_HOMED;
    }
    return did == DOING_STOP ? MOTION_STOPPED : MOTION_COMPLETED;
}

int32_t motion_encoder(const struct motion *it)
{
    return (int32_t)(motor_place(&it->motor) - it->encoder_zero);
}

static uint32_t motion_bits(const struct motion *it)
{
    const int direction = motor_direction(&it->motor);
    uint32_t bits = it->doing == DOING_HOME ? APT_DC_STATUS_BITS_HOMING : 0U;

    if (it->doing == DOING_NOTHING) {
        return it->enabled ? APT_DC_STATUS_BITS_SETTLED : 0U;
    }
    if (direction > 0) {
        bits |= APT_DC_STATUS_BITS_MOVING_FORWARD;
        bits |= it->doing == DOING_JOG ? APT_DC_STATUS_BITS_JOGGING_FORWARD : 0U;
    }
    if (direction < 0) {
        bits |= APT_DC_STATUS_BITS_MOVING_REVERSE;
        bits |= it->doing == DOING_JOG ? APT_DC_STATUS_BITS_JOGGING_REVERSE : 0U;
    }
    return bits;
}

static uint32_t limit_bits(const struct motion *it)
{
    const int64_t place = motor_place(&it->motor);
    const int32_t position = motor_position(&it->motor);
    apt_mot_get_limswitchparams set;
    uint32_t bits = 0U;

    if (!SETTING_READ(limswitchparams, LIMSWITCHPARAMS, &set)) {
        return 0U;
    }
    if (place >= it->motor.travel && is_used(set.cw_hard_limit)) {
        bits |= APT_DC_STATUS_BITS_FORWARD_HARDWARE_LIMIT;
    }
    if (place <= 0 && is_used(set.ccw_hard_limit)) {
        bits |= APT_DC_STATUS_BITS_REVERSE_HARDWARE_LIMIT;
    }
    if (limits_moves(&set) && position >= (int32_t)set.cw_soft_limit) {
        bits |= APT_DC_STATUS_BITS_FORWARD_SOFTWARE_LIMIT;
    }
    if (limits_moves(&set) && position <= set.ccw_soft_limit) {
        bits |= APT_DC_STATUS_BITS_REVERSE_SOFTWARE_LIMIT;
    }
    return bits;
}

uint32_t motion_status_bits(const struct motion *it)
{
    uint32_t bits = motion_bits(it) | limit_bits(it) | APT_DC_STATUS_BITS_MOTOR_CONNECTED;

    if (it->enabled) {
        bits |= APT_DC_STATUS_BITS_CHANNEL_ENABLED;
    }
    if (it->homed) {
        bits |= APT_DC_STATUS_BITS_HOMED;
    }
    return bits & UNIT.status_bits;
}

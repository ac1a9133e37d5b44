/* The motions of the channel: moves, jogs, homing and stops, their ends, and the status bits. */
#ifndef MOTION_H
#define MOTION_H

#include "motor.h"
#include "stagewire_apt/stagewire_apt.h"

/** Kind of a motion. */
enum doing { DOING_NOTHING,
    DOING_MOVE,
    DOING_JOG,
    DOING_HOME,
    DOING_STOP };

/** State of the channel. */
struct motion {
    struct motor motor;
    enum doing doing;
    apt_addresses mover; /* addresses for the message at the end of the motion */
    bool enabled;
    bool homed;
    int64_t encoder_zero; /* the place where the encoder counter is 0 */
};

/** How a motion has ended. */
enum motion_end { MOTION_CONTINUES,
    MOTION_COMPLETED,
    MOTION_STOPPED,
    MOTION_HOMED };

/** Initialise the channel: enabled, at rest, not homed. */
void motion_init(struct motion *it);

/** Carry out a command that moves or stops the motor; return false for any other message. */
bool motion_take(struct motion *it, const uint8_t *frame, size_t size);

/** Enable or disable the channel; a disabled motor stops at once. */
void motion_enable(struct motion *it, bool enabled);

/** Turn the motor for one servo cycle. */
enum motion_end motion_turn(struct motion *it);

/** Return the encoder counter. */
int32_t motion_encoder(const struct motion *it);

/** Return the status bits. */
uint32_t motion_status_bits(const struct motion *it);

#endif

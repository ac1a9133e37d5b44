/*
 * A motor with a trapezoidal velocity profile, simulated. Units are those of the protocol: counts,
 * and counts per servo cycle in steps of 1/65536.
 */
#ifndef MOTOR_H
#define MOTOR_H

#include <stdbool.h>
#include <stdint.h>

/** State of the motor. */
struct motor {
    int64_t position; /* in 1/65536 count */
    int64_t velocity; /* signed, in 1/65536 count per cycle */
    uint32_t acceleration; /* 1/65536 count per cycle and cycle */
    uint32_t max_velocity;
    int32_t target;
    enum { MOTOR_AT_REST,
        MOTOR_MOVING,
        MOTOR_STOPPING } state;
};

/** Initialise the motor at rest at position 0. The profile is still to be set. */
void motor_init(struct motor *motor);

/** Return the position in counts. */
int32_t motor_position(const struct motor *motor);

/** Set the counter at rest: the motor stays where it is, and its position gets another number. */
void motor_count_from(struct motor *motor, int32_t position);

/** Move to a target. */
void motor_move(struct motor *motor, int32_t target);

/** Stop: at once, or with the acceleration of the profile. */
void motor_stop(struct motor *motor, bool at_once);

/** Turn for one servo cycle; return true if a movement ends in this cycle. */
bool motor_turn(struct motor *motor);

#endif

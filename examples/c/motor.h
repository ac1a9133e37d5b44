/*
 * A motor on a stage, simulated: it accelerates, cruises and brakes, and the stage ends its travel. Units
 * are those of the protocol: counts, and counts per servo cycle in steps of 1/65536.
 */
#ifndef MOTOR_H
#define MOTOR_H

#include <stdbool.h>
#include <stdint.h>

/** A place beyond any travel, in counts: a move towards it continues until something ends it. */
#define MOTOR_FAR (INT64_C(1) << 40)

/** A move. Places are counts above the lower end of the travel. */
struct move {
    uint32_t velocity; /* the highest, in 1/65536 count per cycle; above 0 */
    uint32_t acceleration; /* in 1/65536 count per cycle and cycle; above 0 */
    int64_t by; /* where it goes first */
    int64_t to; /* where it goes then and ends; usually the same place */
    int64_t low; /* software limits, which end the way to a place */
    int64_t high;
    bool brakes; /* at a software limit; otherwise it stops there at once */
};

/** A stage. */
struct stage {
    int32_t travel; /* the upper end in counts; the lower one is 0 */
    int32_t place; /* where it is at power-on */
};

/** State of the motor. */
struct motor {
    int64_t position; /* in 1/65536 count above the lower end of the travel */
    int64_t velocity; /* signed, in 1/65536 count per cycle */
    int32_t travel; /* of the stage */
    int64_t zero; /* the place where the position counter is 0 */
    struct move move;
    enum { MOTOR_AT_REST,
        MOTOR_MOVING,
        MOTOR_BRAKING } state;
};

/** Initialise the motor at rest. The counter is 0 where the stage is. */
void motor_init(struct motor *motor, const struct stage *stage);

/** Return the place in counts. */
int64_t motor_place(const struct motor *motor);

/** Return the position counter. */
int32_t motor_position(const struct motor *motor);

/** Set the position counter: the motor stays where it is, and its position gets another number. */
void motor_count_from(struct motor *motor, int32_t position);

/** Return the direction of the motion: 1 up, -1 down, 0 at rest. */
int motor_direction(const struct motor *motor);

/** Return the place where the motor would come to rest if it braked now. */
int64_t motor_rest(const struct motor *motor, uint32_t acceleration);

/** Move. A motor in motion changes to the new move at its present velocity. */
void motor_move(struct motor *motor, const struct move *move);

/** Stop: at once, or with the acceleration of the move. */
void motor_stop(struct motor *motor, bool at_once);

/** Turn for one servo cycle; return true if a movement ends in this cycle. */
bool motor_turn(struct motor *motor);

#endif

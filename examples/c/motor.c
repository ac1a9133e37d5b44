/* The profile: accelerate, cruise, and brake early enough to come to rest at the target. */
#include "motor.h"

#define ONE_COUNT INT64_C(65536)
#define FASTEST INT64_C(0x3FFFFFFF) /* its square fits into 64 bits; 8 m/s on an MLS203 */

static int64_t limited(uint32_t value)
{
    const int64_t wide = (int64_t)value;
    return wide > FASTEST ? FASTEST : wide;
}

static void halt_at(struct motor *motor, int64_t position)
{
    motor->position = position;
    motor->velocity = 0;
}

void motor_init(struct motor *motor, const struct stage *stage)
{
    halt_at(motor, stage->place * ONE_COUNT);
    motor->travel = stage->travel;
    motor->zero = stage->place;
    motor->move.acceleration = 1; /* for a stop before the first move */
    motor->move.by = stage->place;
    motor->state = MOTOR_AT_REST;
}

int64_t motor_place(const struct motor *motor)
{
    return motor->position / ONE_COUNT;
}

int32_t motor_position(const struct motor *motor)
{
    return (int32_t)(motor_place(motor) - motor->zero);
}

void motor_count_from(struct motor *motor, int32_t position)
{
    motor->zero = motor_place(motor) - position;
}

int motor_direction(const struct motor *motor)
{
    const int64_t left = motor->move.by * ONE_COUNT - motor->position;
    const int64_t way = motor->velocity != 0 ? motor->velocity : left;

    if (motor->state == MOTOR_AT_REST || way == 0) {
        return 0;
    }
    return way < 0 ? -1 : 1;
}

int64_t motor_rest(const struct motor *motor, uint32_t acceleration)
{
    const int64_t speed = motor->velocity < 0 ? -motor->velocity : motor->velocity;
    return (motor->position + motor->velocity * speed / (2 * limited(acceleration))) / ONE_COUNT;
}

void motor_move(struct motor *motor, const struct move *move)
{
    motor->move.velocity = move->velocity; /* one by one: a chip may have no memcpy() */
    motor->move.acceleration = move->acceleration;
    motor->move.by = move->by;
    motor->move.to = move->to;
    motor->move.low = move->low;
    motor->move.high = move->high;
    motor->move.brakes = move->brakes;
    motor->state = MOTOR_MOVING;
}

void motor_stop(struct motor *motor, bool at_once)
{
    if (at_once) {
        motor->velocity = 0;
    }
    motor->move.to = motor->move.by; /* it does not go on to the second place */
    motor->state = MOTOR_BRAKING;
}

/* Brake; return true at rest. */
static bool brake(struct motor *motor, int64_t step)
{
    if (motor->velocity > step) {
        motor->velocity -= step;
    } else if (motor->velocity < -step) {
        motor->velocity += step;
    } else {
        halt_at(motor, motor_place(motor) * ONE_COUNT);
        return true;
    }
    motor->position += motor->velocity;
    return false;
}

/* Approach the target; return true there. */
static bool approach(struct motor *motor, int64_t step)
{
    const int64_t most = limited(motor->move.velocity);
    const int64_t way = motor->move.by * ONE_COUNT - motor->position;
    const int64_t sign = way < 0 ? -1 : 1;
    const int64_t left = way * sign;
    int64_t speed = motor->velocity * sign; /* negative if it moves away from the target */

    if (left <= speed + step && speed <= 2 * step) {
        halt_at(motor, motor->move.by * ONE_COUNT);
        return true;
    }
    if (speed > most || (speed > step && speed + speed * speed / (2 * step) >= left)) {
        speed -= step;
    } else {
        speed = speed + step < most ? speed + step : most;
    }
    motor->velocity = speed * sign;
    motor->position += motor->velocity;
    return false;
}

/* End the motion at an end of the travel, where its switch is; return whether it has come there. */
static bool meets_end(struct motor *motor)
{
    const int64_t end = motor->velocity < 0 ? 0 : motor->travel * ONE_COUNT;
    const int64_t left = motor->velocity < 0 ? motor->position - end : end - motor->position;

    if (motor->velocity == 0 || left > 0) {
        return false;
    }
    halt_at(motor, end);
    return true;
}

/* Stop or brake at a software limit, or beyond it; return whether the motor is at rest. */
static bool meets_limit(struct motor *motor, int64_t before)
{
    const bool down = motor->velocity < 0;
    const int64_t limit = (down ? motor->move.low : motor->move.high) * ONE_COUNT;
    const int64_t left = down ? motor->position - limit : limit - motor->position;
    const int64_t left_before = down ? before - limit : limit - before;

    if (motor->velocity == 0 || left > 0) {
        return false;
    }
    if (motor->move.brakes) {
        motor->state = MOTOR_BRAKING;
        return false;
    }
    halt_at(motor, left_before > 0 ? limit : motor_place(motor) * ONE_COUNT);
    return true;
}

bool motor_turn(struct motor *motor)
{
    const int64_t step = limited(motor->move.acceleration);
    const int64_t before = motor->position;
    bool there;

    if (motor->state == MOTOR_AT_REST) {
        return false;
    }
    if (motor->state == MOTOR_BRAKING) {
        there = brake(motor, step) || meets_end(motor);
    } else {
        there = approach(motor, step) || meets_end(motor) || meets_limit(motor, before);
    }
    if (there && motor->move.by != motor->move.to) {
        motor->move.by = motor->move.to;
        motor->state = MOTOR_MOVING;
        return false;
    }
    if (there) {
        motor->state = MOTOR_AT_REST;
    }
    return there;
}

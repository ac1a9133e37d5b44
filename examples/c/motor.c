/* The profile: accelerate, cruise, and brake early enough to come to rest at the target. */
#include "motor.h"

#define ONE_COUNT INT64_C(65536)
#define FASTEST INT64_C(0x3FFFFFFF) /* its square fits into 64 bits; 8 m/s on an MLS203 */

static int64_t limited(uint32_t value)
{
    const int64_t wide = (int64_t)value;
    return wide < 1 ? 1 : (wide > FASTEST ? FASTEST : wide);
}

static void rest_at(struct motor *motor, int64_t position)
{
    motor->position = position;
    motor->velocity = 0;
    motor->state = MOTOR_AT_REST;
}

void motor_init(struct motor *motor)
{
    rest_at(motor, 0);
    motor->target = 0;
    motor->acceleration = 1;
    motor->max_velocity = 1;
}

int32_t motor_position(const struct motor *motor)
{
    return (int32_t)(motor->position / ONE_COUNT);
}

void motor_count_from(struct motor *motor, int32_t position)
{
    if (motor->state == MOTOR_AT_REST) {
        motor->position = position * ONE_COUNT;
    }
}

void motor_move(struct motor *motor, int32_t target)
{
    motor->target = target;
    motor->state = MOTOR_MOVING;
}

void motor_stop(struct motor *motor, bool at_once)
{
    if (at_once) {
        motor->velocity = 0;
    }
    motor->state = MOTOR_STOPPING;
}

/* Brake; return true at rest. */
static bool brake(struct motor *motor, int64_t step)
{
    if (motor->velocity > step) {
        motor->velocity -= step;
    } else if (motor->velocity < -step) {
        motor->velocity += step;
    } else {
        rest_at(motor, motor_position(motor) * ONE_COUNT);
        return true;
    }
    motor->position += motor->velocity;
    return false;
}

/* Approach the target; return true there. */
static bool approach(struct motor *motor, int64_t step)
{
    const int64_t most = limited(motor->max_velocity);
    const int64_t way = motor->target * ONE_COUNT - motor->position;
    const int64_t sign = way < 0 ? -1 : 1;
    const int64_t left = way * sign;
    int64_t speed = motor->velocity * sign; /* negative if it moves away from the target */

    if (left <= speed + step && speed <= 2 * step) {
        rest_at(motor, motor->target * ONE_COUNT);
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

bool motor_turn(struct motor *motor)
{
    const int64_t step = limited(motor->acceleration);

    switch (motor->state) {
    case MOTOR_MOVING:
        return approach(motor, step);
    case MOTOR_STOPPING:
        return brake(motor, step);
    default:
        return false;
    }
}

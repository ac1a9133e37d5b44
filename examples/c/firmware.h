/*
 * A motor controller in one loop. It needs no operating system and no C library, only three
 * functions that each platform defines: two transfer bytes, and one is the timer.
 */
#ifndef FIRMWARE_H
#define FIRMWARE_H

#include "motor.h"
#include "stagewire_apt/stagewire_apt.h"

/** Read at most cap received bytes and return their number; does not wait. */
size_t firmware_read(uint8_t *bytes, size_t cap);

/** Send all bytes. */
void firmware_write(const uint8_t *bytes, size_t size);

/** Return the number of servo cycles of 102.4 us since an arbitrary start; it may wrap around. */
uint32_t firmware_cycles(void);

/** State of the controller. */
struct firmware {
    apt_parser parser;
    uint32_t now; /* in servo cycles, like the next two */
    uint32_t last_byte;
    uint32_t last_update;
    struct motor motor;
    apt_addresses mover; /* addresses for the message at the end of a movement */
    apt_addresses listener; /* addresses for updates */
    bool enabled;
    bool reports_ends; /* of movements */
    bool updates;
    int32_t min_velocity; /* kept, without an effect */
    apt_mot_set_moverelparams relative;
    apt_mot_set_moveabsparams absolute;
};

/** Initialise the controller with the motor at rest. */
void firmware_init(struct firmware *it);

/** Answer received messages, turn the motor up to the present, and send an update if one is due. */
void firmware_poll(struct firmware *it);

#endif

/*
 * A motor controller in one loop. It needs no operating system and no C library, only the two
 * functions that transfer bytes, which each platform defines.
 */
#ifndef FIRMWARE_H
#define FIRMWARE_H

#include "stagewire_apt/stagewire_apt.h"

/** Read at most cap received bytes and return their number; does not wait. */
size_t firmware_read(uint8_t *bytes, size_t cap);

/** Send all bytes. */
void firmware_write(const uint8_t *bytes, size_t size);

/** State of the controller. */
struct firmware {
    apt_parser parser;
    apt_mot_set_velparams profile;
    apt_addresses waiting; /* addresses for the message at the end of the move */
    int32_t position;
    int32_t target;
    bool moving;
};

/** Initialise the controller with the motor at rest. */
void firmware_init(struct firmware *it);

/** Answer received messages, and turn the motor for one servo cycle of 102.4 us. */
void firmware_poll(struct firmware *it);

#endif

/*
 * A motor controller in one loop. It needs no operating system and no C library: only the two
 * functions that move bytes, which whoever puts it on a chip or on a computer writes.
 */
#ifndef FIRMWARE_H
#define FIRMWARE_H

#include "stagewire_apt/stagewire_apt.h"

/** Take what has come in, at most cap bytes, and return how many there are; never waits. */
size_t firmware_read(uint8_t *bytes, size_t cap);

/** Send bytes, all of them. */
void firmware_write(const uint8_t *bytes, size_t size);

/** All that the controller remembers. */
struct firmware {
    apt_parser parser;
    apt_mot_set_velparams profile;
    apt_addresses waiting; /* who is told when the move has ended */
    int32_t position;
    int32_t target;
    bool moving;
};

/** Begin, with the motor at rest. */
void firmware_init(struct firmware *it);

/** Do one round: answer what has come, and let the motor turn for a servo cycle of 102.4 us. */
void firmware_poll(struct firmware *it);

#endif

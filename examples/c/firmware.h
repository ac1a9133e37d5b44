/*
 * A motor controller in one loop. It needs no operating system and no C library, only the functions that
 * each platform defines: its line, its timer, its EEPROM, its outputs and its lamp.
 */
#ifndef FIRMWARE_H
#define FIRMWARE_H

#include "motion.h"
#include "stagewire_apt/stagewire_apt.h"

/** Read at most cap received bytes and return their number; does not wait. */
size_t firmware_read(uint8_t *bytes, size_t cap);

/** Send all bytes. */
void firmware_write(const uint8_t *bytes, size_t size);

/** Return the number of servo cycles since an arbitrary start; it may wrap around. */
uint32_t firmware_cycles(void);

/** Read bytes of the EEPROM; return false if they were never written. */
bool firmware_load(size_t at, uint8_t *bytes, size_t size);

/** Write bytes to the EEPROM. */
void firmware_save(size_t at, const uint8_t *bytes, size_t size);

/** Switch the digital outputs on or off: one bit each. */
void firmware_outputs(uint8_t bits);

/** Switch the lamp on the front panel on or off. */
void firmware_lamp(bool lit);

/** State of the controller. */
struct firmware {
    apt_parser parser;
    uint32_t now; /* in servo cycles, like the next four */
    uint32_t last_byte;
    uint32_t last_update;
    uint32_t identifies_for; /* the rest of the time in which the lamp flashes */
    struct motion motion;
    apt_addresses listener; /* addresses for updates */
    bool reports_ends; /* of motions */
    bool updates;
    uint8_t unacknowledged; /* status messages since the last keep-alive message */
    bool lit; /* the lamp */
    uint8_t outputs; /* that are on */
};

/** Initialise the controller with the motor at rest, and the settings from the EEPROM. */
void firmware_init(struct firmware *it);

/** Answer received messages, turn the motor up to the present, and send an update if one is due. */
void firmware_poll(struct firmware *it);

#endif

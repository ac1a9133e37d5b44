/*
 * The facts in which units differ. bbd101.c and kdc101.c each define one unit, and a program is linked with
 * one of them.
 */
#ifndef UNIT_H
#define UNIT_H

#include "motor.h"
#include "settings.h"
#include "stagewire_apt/stagewire_apt.h"

/** The only channel. */
#define CHANNEL APT_CHANNEL_CHAN1

/** A controller with one motor. */
struct unit {
    apt_hw_get_info info;
    uint8_t address;
    bool usb; /* it requires keep-alive messages, and can be in a hub for USB */
    bool has_outputs; /* digital outputs */
    uint16_t cycles; /* number of servo cycles in 1.024 s */
    struct stage stage;
    uint32_t status_bits; /* that it reports; the others are 0 */
    const struct setting *settings;
    size_t setting_count;
    uint8_t *kept; /* room for their frames */
};

/** The unit. */
extern const struct unit UNIT;

#endif

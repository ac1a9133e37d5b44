/*
 * A small unit: the card of a BBD101 with an MLS203, as far as the host in host.c needs it. bbd101.toml
 * declares what it supports.
 */
#include "unit.h"

static const apt_mot_get_velparams VELPARAMS = {
    .chan_ident = CHANNEL,
    .acceleration = 13744, /* 1000 mm/s^2 */
    .max_velocity = 1342177, /* 10 mm/s */
};
static const apt_mot_get_moverelparams MOVERELPARAMS = {CHANNEL, 0};
static const apt_mot_get_moveabsparams MOVEABSPARAMS = {CHANNEL, 0};

#define SETTINGS(X) \
    X(velparams, VELPARAMS) \
    X(moverelparams, MOVERELPARAMS) \
    X(moveabsparams, MOVEABSPARAMS)

SETTINGS(SETTING_RENEW)

static const struct setting table[] = {SETTINGS(SETTING_ROW)};
static struct {
    SETTINGS(SETTING_MEMBER)
} kept;

#define STATUS_BITS \
    (APT_DC_STATUS_BITS_MOVING_FORWARD | APT_DC_STATUS_BITS_MOVING_REVERSE \
        | APT_DC_STATUS_BITS_SETTLED | APT_DC_STATUS_BITS_CHANNEL_ENABLED)

const struct unit UNIT = {
    .info = {
        .serial_number = 10000001,
        .model_number = "ION001",
        .type = APT_HARDWARE_TYPE_BRUSHLESS_DC_CONTROLLER,
        .software_version = {0, 0, 1, 0},
        .notes = "made up, without a motor",
        .nchs = 1,
    },
    .address = 0x21, /* the card in the first bay */
    .usb = false,
    .has_outputs = false,
    .cycles = 10000, /* of 102.4 us */
    .stage = {.travel = 2200000 /* 110 mm */, .place = 1100000},
    .status_bits = STATUS_BITS,
    .settings = table,
    .setting_count = sizeof(table) / sizeof(table[0]),
    .kept = (uint8_t *)&kept,
};

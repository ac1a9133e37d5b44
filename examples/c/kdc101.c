/*
 * A complete unit: a KDC101 with an MTS25-Z8, with all messages that Issue 37 lists for it (pages 8 and 9),
 * and the digital outputs, which page 141 assigns to its trigger ports.
 * The parameters of the PID loop, of the top panel and of the trigger ports are kept, but have no effect:
 * there is no motor, no panel and no port.
 */
#include "unit.h"

#define MM(millimetres) ((int32_t)((millimetres)*INT64_C(107984256) / 3125)) /* 34554.96 counts */

/* Velocities and accelerations of the MTS25-Z8, rounded. */
#define MM_PER_S(tenths) (77298U * (tenths)) /* for 0.1 mm/s */
#define MM_PER_S2(number) (264U * (number))

static const apt_mot_get_velparams VELPARAMS = {
    .chan_ident = CHANNEL,
    .acceleration = MM_PER_S2(4),
    .max_velocity = MM_PER_S(20),
};
static const apt_mot_get_jogparams JOGPARAMS = {
    .chan_ident = CHANNEL,
    .jog_mode = APT_JOG_MODE_SINGLE_STEP,
    .jog_step_size = MM(1) / 10,
    .jog_acceleration = MM_PER_S2(4),
    .jog_max_velocity = MM_PER_S(10),
    .jog_stop_mode = APT_STOP_MODE_PROFILED,
};
static const apt_mot_get_genmoveparams GENMOVEPARAMS = {CHANNEL, 0};
static const apt_mot_get_moverelparams MOVERELPARAMS = {CHANNEL, 0};
static const apt_mot_get_moveabsparams MOVEABSPARAMS = {CHANNEL, 0};
static const apt_mot_get_homeparams HOMEPARAMS = {
    .chan_ident = CHANNEL,
    .home_direction = APT_MOVE_DIRECTION_REVERSE,
    .limit_switch = APT_HOME_LIMIT_SWITCH_REVERSE,
    .home_velocity = MM_PER_S(10),
    .offset_distance = 0,
};
static const apt_mot_get_limswitchparams LIMSWITCHPARAMS = {
    .chan_ident = CHANNEL,
    .cw_hard_limit = APT_HARD_LIMIT_MAKES,
    .ccw_hard_limit = APT_HARD_LIMIT_MAKES,
    .cw_soft_limit = MM(25),
    .ccw_soft_limit = 0,
    .software_limit_mode = APT_SOFTWARE_LIMIT_MODE_IGNORE,
};
static const apt_mot_get_dcpidparams DCPIDPARAMS = {
    .chan_ident = CHANNEL,
    .proportional = 65, /* as in the example of page 94 */
    .integral = 175,
    .differential = 600,
    .integral_limit = 20000,
    .filter_control = 15,
};
static const apt_mot_get_avmodes AVMODES = {
    .chan_ident = CHANNEL,
    .mode_bits = APT_LED_MODE_LEDMODE_IDENT | APT_LED_MODE_LEDMODE_LIMITSWITCH | APT_LED_MODE_LEDMODE_MOVING,
};
static const apt_mot_get_potparams POTPARAMS = {
    .chan_ident = CHANNEL,
    .zero_wnd = 20,
    .vel1 = MM(1) / 10,
    .wnd1 = 50,
    .vel2 = MM(2) / 10,
    .wnd2 = 80,
    .vel3 = MM(5) / 10,
    .wnd3 = 100,
    .vel4 = MM(1),
};
static const apt_mot_get_buttonparams BUTTONPARAMS = {
    .chan_ident = CHANNEL,
    .mode = APT_BUTTON_MODE_JOG,
    .position1 = MM(5),
    .position2 = MM(10),
    .time_out = 2000,
};
static const apt_mot_get_kcubemmiparams KCUBEMMIPARAMS = {
    .chan_ident = CHANNEL,
    .js_mode = APT_WHEEL_MODE_VELOCITY,
    .js_max_vel = MM_PER_S(10),
    .js_accn = MM_PER_S2(4),
    .dir_sense = APT_WHEEL_DIRECTION_POSITIVE,
    .preset_pos1 = MM(5),
    .preset_pos2 = MM(10),
    .disp_brightness = 60,
    .disp_timeout = 10,
    .disp_dim_level = 5,
};
static const apt_mot_get_kcubetrigioconfig KCUBETRIGIOCONFIG = {
    .chan_ident = CHANNEL,
    .trig1_mode = APT_TRIGGER_PORT_MODE_DISABLED,
    .trig1_polarity = APT_TRIGGER_POLARITY_HIGH,
    .trig2_mode = APT_TRIGGER_PORT_MODE_DISABLED,
    .trig2_polarity = APT_TRIGGER_POLARITY_HIGH,
};
static const apt_mot_get_kcubepostrigparams KCUBEPOSTRIGPARAMS = {
    .chan_ident = CHANNEL,
    .start_pos_fwd = MM(1),
    .interval_fwd = MM(1),
    .num_pulses_fwd = 1,
    .start_pos_rev = MM(2),
    .interval_rev = MM(1),
    .num_pulses_rev = 1,
    .pulse_width = 50000,
    .num_cycles = 1,
};

#define SETTINGS(X) \
    X(velparams, VELPARAMS) \
    X(jogparams, JOGPARAMS) \
    X(genmoveparams, GENMOVEPARAMS) \
    X(moverelparams, MOVERELPARAMS) \
    X(moveabsparams, MOVEABSPARAMS) \
    X(homeparams, HOMEPARAMS) \
    X(limswitchparams, LIMSWITCHPARAMS) \
    X(dcpidparams, DCPIDPARAMS) \
    X(avmodes, AVMODES) \
    X(potparams, POTPARAMS) \
    X(buttonparams, BUTTONPARAMS)

/* The settings that only a K-Cube has. Pages 137 to 147 print two lengths of each; it sends the longer one. */
#define KCUBE_SETTINGS(X) \
    X(kcubemmiparams, KCUBEMMIPARAMS) \
    X(kcubetrigioconfig, KCUBETRIGIOCONFIG) \
    X(kcubepostrigparams, KCUBEPOSTRIGPARAMS)
#define KCUBE_ROW(name, NAME) SETTING_SHORT_ROW(name, NAME, APT_MOT_SET_##NAME##_SHORT_SIZE)

SETTINGS(SETTING_RENEW)
KCUBE_SETTINGS(SETTING_RENEW)

static const struct setting table[] = {SETTINGS(SETTING_ROW) KCUBE_SETTINGS(KCUBE_ROW)};
static struct {
    SETTINGS(SETTING_MEMBER)
    KCUBE_SETTINGS(SETTING_MEMBER)
} kept;

/* The bits of page 129 that it can set. */
#define STATUS_BITS \
    (APT_KDC101_STATUS_BITS_FORWARD_HARDWARE_LIMIT | APT_KDC101_STATUS_BITS_REVERSE_HARDWARE_LIMIT \
        | APT_KDC101_STATUS_BITS_FORWARD_SOFTWARE_LIMIT | APT_KDC101_STATUS_BITS_REVERSE_SOFTWARE_LIMIT \
        | APT_KDC101_STATUS_BITS_MOVING_FORWARD | APT_KDC101_STATUS_BITS_MOVING_REVERSE \
        | APT_KDC101_STATUS_BITS_JOGGING_FORWARD | APT_KDC101_STATUS_BITS_JOGGING_REVERSE \
        | APT_KDC101_STATUS_BITS_MOTOR_CONNECTED | APT_KDC101_STATUS_BITS_HOMING \
        | APT_KDC101_STATUS_BITS_HOMED | APT_KDC101_STATUS_BITS_CHANNEL_ENABLED)

const struct unit UNIT = {
    .info = {
        .serial_number = 27000001,
        .model_number = "KDC101",
        .type = 16, /* the vendor's XA software expects it */
        .software_version = {0, 0, 1, 0},
        .notes = "made up, without a motor",
        .stage_id = 7, /* an MTS25-Z8 for the vendor's XA software */
        .nchs = 1,
    },
    .address = 0x50,
    .usb = true,
    .has_outputs = true, /* the trigger ports, in a mode for outputs */
    .cycles = 3000, /* of 2048/6 us, as page 39 says */
    .stage = {.travel = MM(25), .place = MM(3)},
    .status_bits = STATUS_BITS,
    .settings = table,
    .setting_count = sizeof(table) / sizeof(table[0]),
    .kept = (uint8_t *)&kept,
};

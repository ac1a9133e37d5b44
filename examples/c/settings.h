/*
 * The settings of a unit: messages in threes, where REQ returns in GET what SET has set. A unit lists its
 * settings in a table. Each is kept as the frame of its GET, in RAM and in the EEPROM.
 */
#ifndef SETTINGS_H
#define SETTINGS_H

#include "stagewire_apt/stagewire_apt.h"

/** Room for the longest frame of a setting. */
#define SETTING_ROOM 64U

/** A setting. */
struct setting {
    uint16_t set; /* the ids of its messages */
    uint16_t req;
    uint16_t get;
    uint8_t size; /* of the frame */
    uint8_t shortest; /* frame of a SET: if the document has a second, shorter layout */
    /* Write the frame of the setting from another one, or from the defaults; false for invalid values. */
    bool (*renew)(const uint8_t *frame, uint8_t *out);
};

/**
 * Define how a setting is renewed, from its defaults: a constant with the name of the GET. Encoding checks
 * the ranges of the document.
 */
#define SETTING_RENEW(name, NAME) \
    APT_STATIC_ASSERT(APT_MOT_GET_##NAME##_SIZE <= SETTING_ROOM, room_for_##name); \
    static bool renew_##name(const uint8_t *frame, uint8_t *out) \
    { \
        apt_mot_get_##name message; \
        const size_t size = APT_MOT_GET_##NAME##_SIZE; \
        if (frame != NULL && apt_mot_get_##name##_decode(frame, size, &message) != APT_OK) { \
            return false; \
        } \
        return apt_mot_get_##name##_encode(frame != NULL ? &message : &(NAME), \
                   apt_to_host(UNIT.address), out, size) \
            == APT_OK; \
    }

/** A row of the table. */
#define SETTING_ROW(name, NAME) SETTING_SHORT_ROW(name, NAME, APT_MOT_SET_##NAME##_SIZE)

/** A row of the table; a shorter SET keeps the values that it does not have. */
#define SETTING_SHORT_ROW(name, NAME, shortest) \
    {APT_MOT_SET_##NAME##_ID, APT_MOT_REQ_##NAME##_ID, APT_MOT_GET_##NAME##_ID, \
        APT_MOT_GET_##NAME##_SIZE, (shortest), renew_##name},

/** A member of the struct that has room for the frames. */
#define SETTING_MEMBER(name, NAME) uint8_t name[APT_MOT_GET_##NAME##_SIZE];

/** Decode a setting; return false if the unit does not have it. */
#define SETTING_READ(name, NAME, message) \
    (apt_mot_get_##name##_decode( \
         settings_find(APT_MOT_GET_##NAME##_ID), APT_MOT_GET_##NAME##_SIZE, (message)) \
        == APT_OK)

/** Read all settings from the EEPROM; a setting that was never saved gets its default. */
void settings_init(void);

/** Return the frame of a setting by the id of its GET, or bytes that no decoder accepts. */
const uint8_t *settings_find(uint16_t get);

/** Carry out a SET or answer a REQ; return false for any other message. */
bool settings_take(const uint8_t *frame, size_t size);

/** Save a setting to the EEPROM by the id of its SET. */
void settings_save(uint16_t set);

#endif

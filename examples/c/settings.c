/* Frames of settings follow each other, in RAM and in the EEPROM, in the order of the table. */
#include "settings.h"

#include "firmware.h"
#include "unit.h"

/* A setting in the table, and where its frame is. */
struct found {
    const struct setting *setting; /* NULL: none */
    size_t at;
};

/* The role of a message in a setting. */
enum role { SET,
    REQ,
    GET };

static struct found find(enum role role, uint16_t id)
{
    struct found found = {NULL, 0U};
    size_t number;

    for (number = 0U; number < UNIT.setting_count; number++) {
        const struct setting *setting = &UNIT.settings[number];
        const uint16_t ids[] = {setting->set, setting->req, setting->get};
        if (ids[role] == id) {
            found.setting = setting;
            break;
        }
        found.at += setting->size;
    }
    return found;
}

void settings_init(void)
{
    uint8_t saved[SETTING_ROOM];
    size_t number;
    size_t at = 0U;

    for (number = 0U; number < UNIT.setting_count; number++) {
        const struct setting *setting = &UNIT.settings[number];
        if (!firmware_load(at, saved, setting->size) || !setting->renew(saved, &UNIT.kept[at])) {
            (void)setting->renew(NULL, &UNIT.kept[at]);
        }
        at += setting->size;
    }
}

const uint8_t *settings_find(uint16_t get)
{
    static const uint8_t none[APT_HEADER_SIZE] = {0};
    const struct found found = find(GET, get);

    return found.setting == NULL ? none : &UNIT.kept[found.at];
}

/* Put the values of a SET into the frame, if all are valid. */
static void set(const struct found *found, const uint8_t *frame, size_t size)
{
    const struct setting *setting = found->setting;
    const size_t whole = size < setting->size ? setting->shortest : setting->size;
    uint8_t *kept = &UNIT.kept[found->at];
    uint8_t changed[SETTING_ROOM];

    if (size < whole || apt_get_16(&frame[APT_HEADER_SIZE]) != CHANNEL) {
        return;
    }
    apt_copy(changed, setting->size, kept);
    apt_copy(&changed[APT_HEADER_SIZE], whole - APT_HEADER_SIZE, &frame[APT_HEADER_SIZE]);
    (void)setting->renew(changed, kept);
}

/* Send the frame to the host that asked. */
static void answer(const struct found *found, const uint8_t *frame)
{
    const apt_addresses back = apt_reply_to(frame);
    uint8_t *kept = &UNIT.kept[found->at];

    if (frame[2] == CHANNEL) {
        kept[4] = (uint8_t)(back.dest | APT_DATA_FLAG);
        kept[5] = back.source;
        firmware_write(kept, found->setting->size);
    }
}

bool settings_take(const uint8_t *frame, size_t size)
{
    const struct found to_set = find(SET, apt_id_of(frame));
    const struct found asked = find(REQ, apt_id_of(frame));

    if (to_set.setting != NULL) {
        set(&to_set, frame, size);
    } else if (asked.setting != NULL) {
        answer(&asked, frame);
    }
    return to_set.setting != NULL || asked.setting != NULL;
}

void settings_save(uint16_t set_id)
{
    const struct found found = find(SET, set_id);

    if (found.setting != NULL) {
        firmware_save(found.at, &UNIT.kept[found.at], found.setting->size);
    }
}

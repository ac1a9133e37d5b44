/* Every layout of one package (LAYOUTS, LAYOUT_COUNT of LAYOUTS_H), through the functions of the headers.
 *
 * The first two bytes of an input choose the layout. The third chooses whether the remaining bytes are a message of
 * this layout, a message of any layout, or the content of the struct. The fourth is an address.
 *
 * A decoded message encodes to the same bytes without checks; a packet that lacked the data flag, to the bytes
 * with it. The checked function makes the same bytes, or refuses a value out of range. A refused message leaves
 * the output unchanged. */
#include "check.h"

#include "testing/layout.h"

#include LAYOUTS_H

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { ONE = 1,
    ALL = 2 };

typedef uint64_t words[ROOM / sizeof(uint64_t)]; /* aligned for every struct */

/* Returns whether the value of an integer field is within its range in the table of fields. */
static bool field_fits(const struct stagewire_field *field, const uint8_t *message)
{
    uint64_t bits = 0;
    uint8_t of_8;
    uint16_t of_16;
    uint32_t of_32;
    switch (field->size) {
    case 1:
        memcpy(&of_8, message + field->offset, sizeof of_8);
        bits = field->kind == STAGEWIRE_SIGNED ? (uint64_t)(int64_t)(int8_t)of_8 : of_8;
        break;
    case 2:
        memcpy(&of_16, message + field->offset, sizeof of_16);
        bits = field->kind == STAGEWIRE_SIGNED ? (uint64_t)(int64_t)(int16_t)of_16 : of_16;
        break;
    case 4:
        memcpy(&of_32, message + field->offset, sizeof of_32);
        bits = field->kind == STAGEWIRE_SIGNED ? (uint64_t)(int64_t)(int32_t)of_32 : of_32;
        break;
    default:
        CHECK(field->size == 8);
        memcpy(&bits, message + field->offset, sizeof bits);
    }
    if (field->kind == STAGEWIRE_UNSIGNED) {
        return bits >= (uint64_t)field->minimum && bits <= (uint64_t)field->maximum;
    }
    return (int64_t)bits >= field->minimum && (int64_t)bits <= field->maximum;
}

static bool is_array(const struct stagewire_field *field)
{
    return field->kind == STAGEWIRE_UNSIGNED_ARRAY || field->kind == STAGEWIRE_SIGNED_ARRAY;
}

/* Lets the arrays of a struct have a number of integers that the struct and the input choose, from none to more than
 * the longest message holds: as many as the other fields state, or another number. */
static void give_arrays(const struct stagewire_layout *layout, uint8_t *message, const uint8_t *data, size_t size)
{
    static uint8_t room[ROOM];
    for (size_t i = 0; i < layout->field_count; ++i) {
        const struct stagewire_field *field = &layout->fields[i];
        if (!is_array(field)) {
            continue;
        }
        struct stagewire_array array;
        CHECK(field->size == sizeof array);
        memcpy(&array, message + field->offset, sizeof array);
        array.count %= (ROOM - 64U) / field->wire_size; /* the other fields take less than 64 bytes */
        const size_t length = array.count * field->wire_size;
        uint8_t *bytes = at_the_end_of(room, length);
        for (size_t at = 0; at < length; ++at) {
            bytes[at] = data[at % size];
        }
        array.bytes = bytes;
        memcpy(message + field->offset, &array, sizeof array);
    }
}

/* Returns whether the arrays have as many integers as the other fields state: only then are the bytes a message. */
static bool counts_fit(const struct stagewire_layout *layout, const uint8_t *bytes, size_t size)
{
    static words decoded;
    for (size_t i = 0; i < layout->field_count; ++i) {
        if (is_array(&layout->fields[i])) {
            return layout->decode(bytes, size, decoded, NULL) == STAGEWIRE_OK;
        }
    }
    return true;
}

static bool fits(const struct stagewire_layout *layout, const uint8_t *message)
{
    for (size_t i = 0; i < layout->field_count; ++i) {
        const struct stagewire_field *field = &layout->fields[i];
        const bool is_integer = field->kind == STAGEWIRE_UNSIGNED || field->kind == STAGEWIRE_SIGNED;
        if (is_integer && !field_fits(field, message)) {
            return false;
        }
    }
    return true;
}

/* Returns whether a function of the headers makes the whole message: other forms and extra bytes are added to it. */
static bool is_plain(const struct stagewire_envelope *to)
{
    return to->size_slot == STAGEWIRE_SLOT_AS_PRINTED && to->extra_size == 0;
}

/* Encodes into exactly size bytes at the end of a room; checks that one byte less is refused, with nothing written. */
static const uint8_t *encode(const struct stagewire_layout *layout, const void *message,
    const struct stagewire_envelope *to, size_t size)
{
    static uint8_t room[ROOM];
    static uint8_t untouched[ROOM];
    size_t made = 0;
    uint8_t *out = room;
    if (is_plain(to)) {
        out = at_the_end_of(room, size);
        CHECK(layout->encode(message, to, out, size, &made, false) == STAGEWIRE_OK);
        memset(room, 0xA5, sizeof room);
        memset(untouched, 0xA5, sizeof untouched);
        CHECK(layout->encode(message, to, out, size - 1, &made, false) == STAGEWIRE_NO_SPACE);
        CHECK(memcmp(room, untouched, sizeof room) == 0);
    }
    CHECK(layout->encode(message, to, out, is_plain(to) ? size : sizeof room, &made, false) == STAGEWIRE_OK);
    CHECK(made == size);
    return out;
}

/* Checks that the checked function makes the same bytes, or refuses a range, an address or a dummy message. */
static void checked(const struct stagewire_layout *layout, const void *message, const struct stagewire_envelope *to,
    const uint8_t *bytes, size_t size)
{
    static uint8_t room[ROOM];
    static uint8_t untouched[ROOM];
    size_t made = 0;
    memset(room, 0x5A, sizeof room);
    const enum stagewire_verdict verdict = layout->encode(message, to, room, sizeof room, &made, true);
    const bool is_dummy = verdict == STAGEWIRE_UNSUPPORTED;
    const bool may = fits(layout, message) && to->dest <= 0x7F && counts_fit(layout, bytes, size);
    CHECK(verdict == STAGEWIRE_OK || verdict == STAGEWIRE_OUT_OF_RANGE || is_dummy);
    CHECK(may == (verdict != STAGEWIRE_OUT_OF_RANGE));
    if (verdict == STAGEWIRE_OK) {
        CHECK(made == size && memcmp(room, bytes, size) == 0);
    } else {
        memset(untouched, 0x5A, sizeof untouched);
        CHECK(memcmp(room, untouched, sizeof room) == 0);
    }
}

static void decode(const struct stagewire_layout *layout, const uint8_t *data, size_t size)
{
    static uint8_t room[ROOM];
    static words message;
    static words untouched;
    struct stagewire_envelope from = {0};
    memset(message, 0xC3, layout->struct_size);
    memset(untouched, 0xC3, layout->struct_size);
    uint8_t *bytes = at_the_end_of(room, size);
    memcpy(bytes, data, size);
    if (layout->decode(bytes, size, message, &from) != STAGEWIRE_OK) {
        CHECK(memcmp(message, untouched, layout->struct_size) == 0);
        return;
    }
    CHECK(size >= layout->length);
    if (strcmp(layout->kind, "message") == 0 && memcmp(bytes, "\xC0\x08\x08", 4) == 0) {
        bytes[4] |= 0x80; /* this packet is also received without the data flag */
    }
    CHECK(memcmp(encode(layout, message, &from, size), bytes, size) == 0);
    checked(layout, message, &from, bytes, size);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static uint8_t room[ROOM];
    static words message;
    if (size < 4 || size > 600) {
        return 0;
    }
    const struct stagewire_layout *layout = &LAYOUTS[(data[0] | (unsigned)data[1] << 8) % LAYOUT_COUNT];
    if (data[2] == ONE) {
        decode(layout, data + 4, size - 4);
        return 0;
    }
    if (data[2] == ALL) {
        for (size_t i = 0; i < LAYOUT_COUNT; ++i) {
            decode(&LAYOUTS[i], data + 4, size - 4);
        }
        return 0;
    }
    struct stagewire_envelope to = {.source = 1, .axis = 0x18};
    if (strcmp(layout->kind, "message") == 0) {
        to.dest = data[3];
    }
    memset(message, 0, layout->struct_size);
    memcpy(message, data + 4, size - 4 < layout->struct_size ? size - 4 : layout->struct_size);
    give_arrays(layout, (uint8_t *)message, data, size);
    size_t made = 0;
    CHECK(layout->encode(message, &to, room, sizeof room, &made, false) == STAGEWIRE_OK);
    checked(layout, message, &to, room, made);
    decode(layout, room, made);
    return 0;
}

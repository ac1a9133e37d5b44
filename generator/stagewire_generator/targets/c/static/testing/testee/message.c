/**
 * @file
 * Messages as JSON: from the fields of a request to the C struct of a layout, and back.
 */
#include "testing/testee/message.h"

#include <string.h>

const struct stagewire_layout *message_layout(const struct json_value *message, const char *form)
{
    for (size_t i = 0; i < testee_protocol.layout_count; ++i) {
        const struct stagewire_layout *const layout = &testee_protocol.layouts[i];
        if (json_is(message, layout->message) && strcmp(layout->form, form) == 0) {
            return layout;
        }
    }
    return NULL;
}

const struct stagewire_field *message_field(
    const struct stagewire_layout *layout, const struct json_value *name)
{
    for (size_t i = 0; i < layout->field_count; ++i) {
        if (json_is(name, layout->fields[i].name)) {
            return &layout->fields[i];
        }
    }
    return NULL;
}

/* Integers are 64 bits in two's complement; a struct member has the lower bits of them. */

static void store(const struct stagewire_field *field, uint64_t bits, void *message)
{
    uint8_t *const at = (uint8_t *)message + field->offset;
    const uint8_t bits_8 = (uint8_t)(bits & UINT8_MAX);
    const uint16_t bits_16 = (uint16_t)(bits & UINT16_MAX);
    const uint32_t bits_32 = (uint32_t)(bits & UINT32_MAX);
    switch (field->size) {
    case sizeof bits_8:
        memcpy(at, &bits_8, sizeof bits_8);
        break;
    case sizeof bits_16:
        memcpy(at, &bits_16, sizeof bits_16);
        break;
    case sizeof bits_32:
        memcpy(at, &bits_32, sizeof bits_32);
        break;
    default:
        memcpy(at, &bits, sizeof bits);
        break;
    }
}

static uint64_t stored(const struct stagewire_field *field, const void *message)
{
    const uint8_t *const at = (const uint8_t *)message + field->offset;
    uint8_t bits_8 = 0;
    uint16_t bits_16 = 0;
    uint32_t bits_32 = 0;
    uint64_t bits = 0;
    switch (field->size) {
    case sizeof bits_8:
        memcpy(&bits_8, at, sizeof bits_8);
        bits = bits_8;
        break;
    case sizeof bits_16:
        memcpy(&bits_16, at, sizeof bits_16);
        bits = bits_16;
        break;
    case sizeof bits_32:
        memcpy(&bits_32, at, sizeof bits_32);
        bits = bits_32;
        break;
    default:
        memcpy(&bits, at, sizeof bits);
        break;
    }
    const uint64_t sign = UINT64_C(1) << (8U * field->size - 1U);
    return field->kind == STAGEWIRE_SIGNED ? (bits ^ sign) - sign : bits;
}

static int64_t as_signed(uint64_t bits)
{
    int64_t value = 0;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static enum stagewire_verdict set_integer(
    const struct stagewire_field *field, const struct json_value *value, void *message)
{
    uint64_t magnitude = 0;
    bool negative = false;
    if (value->kind != JSON_INTEGER) {
        return STAGEWIRE_BAD_VALUE;
    }
    if (!json_integer(value, &magnitude, &negative)) {
        return STAGEWIRE_OUT_OF_RANGE;
    }
    const uint64_t sign = UINT64_C(1) << (8U * field->size - 1U);
    uint64_t greatest = negative ? sign : sign - 1U;
    if (field->kind == STAGEWIRE_UNSIGNED) {
        greatest = negative ? 0U : sign - 1U + sign;
    }
    if (magnitude > greatest) {
        return STAGEWIRE_OUT_OF_RANGE;
    }
    store(field, negative ? 0U - magnitude : magnitude, message);
    return STAGEWIRE_OK;
}

/* The bytes of the array of the message that is being encoded. */
static uint8_t array_bytes[UINT16_MAX];

/* The field of one integer of an array, as in a struct of its own. */
static struct stagewire_field item_of(const struct stagewire_field *array)
{
    struct stagewire_field item = *array;
    item.kind = array->kind == STAGEWIRE_SIGNED_ARRAY ? STAGEWIRE_SIGNED : STAGEWIRE_UNSIGNED;
    item.offset = 0;
    item.size = sizeof(uint64_t);
    return item;
}

static bool is_in_range(const struct stagewire_field *field, const void *message);

static enum stagewire_verdict set_array(
    const struct stagewire_field *field, const struct json_value *value, void *message)
{
    const struct stagewire_field item = item_of(field);
    struct stagewire_array array = {array_bytes, 0};
    if (value->kind != JSON_LIST) {
        return STAGEWIRE_BAD_VALUE;
    }
    for (const struct json_value *at = json_first(value); at != json_next(value);
         at = json_next(at)) {
        uint64_t bits = 0;
        const enum stagewire_verdict verdict = set_integer(&item, at, &bits);
        const size_t end = (array.count + 1) * field->wire_size;
        if (verdict != STAGEWIRE_OK) {
            return verdict;
        }
        if (!is_in_range(&item, &bits) || end > sizeof array_bytes) {
            return STAGEWIRE_OUT_OF_RANGE;
        }
        for (size_t i = 0; i < field->wire_size; ++i) {
            array_bytes[end - field->wire_size + i] = (uint8_t)(bits >> 8 * i & UINT8_MAX);
        }
        ++array.count;
    }
    memcpy((uint8_t *)message + field->offset, &array, sizeof array);
    return STAGEWIRE_OK;
}

static void write_array(
    struct json_writer *writer, const struct stagewire_field *field, const uint8_t *at)
{
    struct stagewire_array array = {NULL, 0};
    memcpy(&array, at, sizeof array);
    json_open(writer, '[');
    for (size_t i = 0; i < array.count; ++i) {
        const uint64_t sign = UINT64_C(1) << (8U * field->wire_size - 1U);
        uint64_t bits = 0;
        for (size_t byte = 0; byte < field->wire_size; ++byte) {
            bits |= (uint64_t)array.bytes[i * field->wire_size + byte] << 8 * byte;
        }
        if (field->kind == STAGEWIRE_SIGNED_ARRAY) {
            json_put_integer(writer, as_signed((bits ^ sign) - sign));
        } else {
            json_put_unsigned(writer, bits);
        }
    }
    json_close(writer, ']');
}

static bool is_integer(const struct stagewire_field *field)
{
    return field->kind == STAGEWIRE_UNSIGNED || field->kind == STAGEWIRE_SIGNED;
}

static bool is_in_range(const struct stagewire_field *field, const void *message)
{
    if (!is_integer(field)) {
        return true;
    }
    const uint64_t bits = stored(field, message);
    if (field->kind == STAGEWIRE_UNSIGNED) {
        return bits >= (uint64_t)field->minimum && bits <= (uint64_t)field->maximum;
    }
    return as_signed(bits) >= field->minimum && as_signed(bits) <= field->maximum;
}

/* Latin-1 in UTF-8: one byte, or two that begin with C2 or C3. */
static enum stagewire_verdict set_text(
    const struct stagewire_field *field, const struct json_value *value, void *message)
{
    uint8_t *const to = (uint8_t *)message + field->offset;
    size_t length = 0;
    uint8_t last = 0xFF;
    if (value->kind != JSON_TEXT) {
        return STAGEWIRE_BAD_VALUE;
    }
    for (size_t i = 0; i < value->size; ++i) {
        last = (uint8_t)value->text[i];
        if (last > 0xC3) {
            return STAGEWIRE_BAD_VALUE;
        }
        if (last > 0x7F) {
            last = (uint8_t)((last & 3) << 6 | ((uint8_t)value->text[++i] & 0x3F));
        }
        if (length < field->size) {
            to[length] = last;
        }
        ++length;
    }
    if (length > field->size) {
        return STAGEWIRE_OUT_OF_RANGE;
    }
    if (last == 0) { /* NULs fill the field, so a NUL at the end would be lost */
        return STAGEWIRE_BAD_VALUE;
    }
    memset(to + length, 0, field->size - length);
    return STAGEWIRE_OK;
}

static enum stagewire_verdict set_bytes(
    const struct stagewire_field *field, const struct json_value *value, void *message)
{
    size_t size = 0;
    if (!json_is_hex(value)) {
        return STAGEWIRE_BAD_VALUE;
    }
    if (value->size / 2 != field->size) {
        return STAGEWIRE_OUT_OF_RANGE;
    }
    const uint8_t *const bytes = json_bytes(value, &size);
    memcpy((uint8_t *)message + field->offset, bytes, size);
    return STAGEWIRE_OK;
}

enum stagewire_verdict message_set(
    const struct stagewire_field *field, const struct json_value *value, void *message)
{
    switch (field->kind) {
    case STAGEWIRE_TEXT:
        return set_text(field, value, message);
    case STAGEWIRE_BYTES:
        return set_bytes(field, value, message);
    case STAGEWIRE_UNSIGNED_ARRAY:
    case STAGEWIRE_SIGNED_ARRAY:
        return set_array(field, value, message);
    case STAGEWIRE_UNSIGNED:
    case STAGEWIRE_SIGNED:
    default:
        return set_integer(field, value, message);
    }
}

static void set_constant(const struct stagewire_field *field, void *message)
{
    if (is_integer(field)) {
        store(field, (uint64_t)field->constant, message);
    } else {
        memset((uint8_t *)message + field->offset, 0, field->size);
    }
}

/* Check the names of fields, and that bytes are hex, before all values. */
static bool check_fields(
    struct testee *testee, const struct stagewire_layout *layout, const struct json_value *fields)
{
    const struct json_value *unknown = NULL;
    for (const struct json_value *at = json_first(fields); at != json_next(fields);
         at = json_next(at + 1)) {
        const struct stagewire_field *const field = message_field(layout, at);
        if (field == NULL) {
            unknown = unknown == NULL ? at : unknown;
        } else if (field->kind == STAGEWIRE_BYTES && !json_is_hex(at + 1)) {
            return testee_refuse(testee, TESTEE_BAD_VALUE, "the field must be hex", at);
        }
    }
    if (unknown != NULL) {
        return testee_refuse(testee, TESTEE_UNKNOWN_FIELD, "the layout has no such field", unknown);
    }
    if (testee_given(testee, "data") != NULL) {
        return testee_refuse(
            testee, TESTEE_BAD_VALUE, "give the fields of the message, not data", NULL);
    }
    for (size_t i = 0; i < layout->field_count; ++i) {
        if (!layout->fields[i].optional && json_get(fields, layout->fields[i].name) == NULL) {
            return testee_refuse(testee, TESTEE_MISSING_FIELD, layout->fields[i].name, NULL);
        }
    }
    return true;
}

bool message_read(struct testee *testee, const struct stagewire_layout *layout)
{
    const struct json_value *const fields = testee_object(testee, "fields");
    bool in_range = true;
    if (!check_fields(testee, layout, fields)) {
        return false;
    }
    for (size_t i = 0; i < layout->field_count; ++i) {
        const struct stagewire_field *const field = &layout->fields[i];
        const struct json_value *const value = json_get(fields, field->name);
        if (value == NULL) {
            set_constant(field, testee->message);
            continue;
        }
        const enum stagewire_verdict verdict = message_set(field, value, testee->message);
        if (verdict != STAGEWIRE_OK) {
            /* The first error is reported; a previous field may be out of range. */
            return testee_passes(testee, in_range ? verdict : STAGEWIRE_OUT_OF_RANGE, value);
        }
        in_range = in_range && is_in_range(field, testee->message);
    }
    return true;
}

bool message_read_byte(struct testee *testee, const char *key, uint8_t *byte)
{
    const struct stagewire_field field = {
        .name = key, .size = sizeof *byte, .kind = STAGEWIRE_UNSIGNED};
    const struct json_value *const value = testee_get(testee, key);
    if (value == NULL) {
        return testee_refuse(testee, TESTEE_MISSING_FIELD, key, NULL);
    }
    return testee_passes(testee, set_integer(&field, value, byte), value);
}

void message_write_field(struct testee *testee, const struct stagewire_field *field)
{
    struct json_writer *const writer = &testee->writer;
    const uint8_t *const at = (const uint8_t *)testee->message + field->offset;
    size_t length = field->size;
    json_key(writer, field->name);
    switch (field->kind) {
    case STAGEWIRE_TEXT:
        while (length > 0 && at[length - 1] == 0) {
            --length;
        }
        json_open_text(writer);
        json_put_latin_1_piece(writer, at, length);
        json_close_text(writer);
        break;
    case STAGEWIRE_BYTES:
        json_put_hex(writer, at, length);
        break;
    case STAGEWIRE_UNSIGNED_ARRAY:
    case STAGEWIRE_SIGNED_ARRAY:
        write_array(writer, field, at);
        break;
    case STAGEWIRE_SIGNED:
        json_put_integer(writer, as_signed(stored(field, testee->message)));
        break;
    case STAGEWIRE_UNSIGNED:
    default:
        json_put_unsigned(writer, stored(field, testee->message));
        break;
    }
}

void message_write(struct testee *testee, const struct stagewire_layout *layout)
{
    json_key(&testee->writer, "fields");
    json_open(&testee->writer, '{');
    for (size_t i = 0; i < layout->field_count; ++i) {
        const struct stagewire_field *const field = &layout->fields[i];
        if (!field->unnamed || field->constant != 0 || stored(field, testee->message) != 0) {
            message_write_field(testee, field);
        }
    }
    json_close(&testee->writer, '}');
}

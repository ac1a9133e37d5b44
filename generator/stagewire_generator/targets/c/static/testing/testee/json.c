/**
 * @file
 * Access to the values of a JSON text.
 */
#include "testing/testee/json.h"

#include "testing/testee/json_text.h"

#include <stdlib.h>
#include <string.h>

void json_free(struct json *json)
{
    free(json->values);
    memset(json, 0, sizeof *json);
}

const struct json_value *json_first(const struct json_value *holder)
{
    return holder + 1;
}

const struct json_value *json_next(const struct json_value *value)
{
    return value + value->span;
}

const struct json_value *json_get(const struct json_value *object, const char *key)
{
    if (object == NULL || object->kind != JSON_OBJECT) {
        return NULL;
    }
    for (const struct json_value *at = json_first(object); at != json_next(object);
         at = json_next(at + 1)) {
        if (json_is(at, key)) {
            return at + 1;
        }
    }
    return NULL;
}

bool json_is(const struct json_value *value, const char *text)
{
    return value->kind == JSON_TEXT && value->size == strlen(text)
        && memcmp(value->text, text, value->size) == 0;
}

bool json_integer(const struct json_value *value, uint64_t *magnitude, bool *negative)
{
    uint64_t sum = 0;
    *negative = value->text[0] == '-';
    for (size_t i = *negative ? 1 : 0; i < value->size; ++i) {
        const uint64_t digit = (uint64_t)(value->text[i] - '0');
        if (sum > (UINT64_MAX - digit) / 10) {
            return false;
        }
        sum = sum * 10 + digit;
    }
    *magnitude = sum;
    return true;
}

bool json_is_hex(const struct json_value *value)
{
    if (value->kind != JSON_TEXT || value->size % 2 != 0) {
        return false;
    }
    for (size_t i = 0; i < value->size; ++i) {
        if (json_hex_value(value->text[i]) > 15) {
            return false;
        }
    }
    return true;
}

const uint8_t *json_bytes(const struct json_value *hex, size_t *size)
{
    uint8_t *const bytes = (uint8_t *)hex->text;
    *size = hex->size / 2;
    for (size_t i = 0; i < *size; ++i) {
        bytes[i] = (uint8_t)((json_hex_value(hex->text[2 * i]) << 4)
            | json_hex_value(hex->text[2 * i + 1]));
    }
    return bytes;
}

/**
 * @file
 * The characters of JSON: UTF-8, escapes and hex digits.
 */
#include "testing/testee/json_text.h"

#include <string.h>

enum {
    UNIT = 4, /* hex digits of an escaped UTF-16 code unit */
    NO_UNIT = 0x10000
};

size_t json_character_size(const char *text, size_t size)
{
    const unsigned char *const bytes = (const unsigned char *)text;
    const unsigned char first = bytes[0];
    if (first < 0x80) {
        return 1;
    }
    const size_t length = first < 0xE0 ? 2 : (first < 0xF0 ? 3 : 4);
    if (first < 0xC2 || first > 0xF4 || length > size) {
        return 0;
    }
    /* Exclude overlong forms, surrogates and code points after U+10FFFF. */
    const unsigned char least = first == 0xE0 ? 0xA0 : (first == 0xF0 ? 0x90 : 0x80);
    const unsigned char greatest = first == 0xED ? 0x9F : (first == 0xF4 ? 0x8F : 0xBF);
    if (bytes[1] < least || bytes[1] > greatest) {
        return 0;
    }
    for (size_t i = 2; i < length; ++i) {
        if ((bytes[i] & 0xC0) != 0x80) {
            return 0;
        }
    }
    return length;
}

uint32_t json_hex_value(char character)
{
    static const char digits[] = "0123456789abcdef0123456789ABCDEF";
    const char *const found = character == '\0' ? NULL : strchr(digits, character);
    return found == NULL ? 16U : (uint32_t)(found - digits) % 16U;
}

/* The code unit of `uXXXX`; NO_UNIT for other text. */
static uint32_t escaped_unit(const char *from, const char *end)
{
    uint32_t unit = 0;
    if (end - from < 1 + UNIT || from[0] != 'u') {
        return NO_UNIT;
    }
    for (size_t i = 1; i <= UNIT; ++i) {
        const uint32_t digit = json_hex_value(from[i]);
        if (digit > 15) {
            return NO_UNIT;
        }
        unit = (unit << 4) | digit;
    }
    return unit;
}

static char *put_code_point(char *to, uint32_t code)
{
    if (code < 0x80) {
        *to++ = (char)code;
        return to;
    }
    if (code < 0x800) {
        *to++ = (char)(0xC0 | (code >> 6));
    } else {
        if (code < 0x10000) {
            *to++ = (char)(0xE0 | (code >> 12));
        } else {
            *to++ = (char)(0xF0 | (code >> 18));
            *to++ = (char)(0x80 | ((code >> 12) & 0x3F));
        }
        *to++ = (char)(0x80 | ((code >> 6) & 0x3F));
    }
    *to++ = (char)(0x80 | (code & 0x3F));
    return to;
}

const char *json_read_escape(const char *from, const char *end, char **to)
{
    static const char letters[] = "\"\\/bfnrt";
    static const char meant[] = "\"\\/\b\f\n\r\t";
    const char *const found = from == end || *from == '\0' ? NULL : strchr(letters, *from);
    if (found != NULL) {
        *(*to)++ = meant[found - letters];
        return from + 1;
    }
    uint32_t code = escaped_unit(from, end);
    if (code == NO_UNIT) {
        return NULL;
    }
    from += 1 + UNIT;
    if (code >= 0xD800 && code <= 0xDBFF && from < end && *from == '\\') {
        const uint32_t low = escaped_unit(from + 1, end);
        if (low >= 0xDC00 && low <= 0xDFFF) {
            code = 0x10000 + ((code - 0xD800) << 10) + (low - 0xDC00);
            from += 2 + UNIT;
        }
    }
    *to = put_code_point(*to, code);
    return from;
}

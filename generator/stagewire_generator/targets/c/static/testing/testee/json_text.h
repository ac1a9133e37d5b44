/**
 * @file
 * The characters of JSON: UTF-8, escapes and hex digits.
 */
#ifndef STAGEWIRE_TESTING_TESTEE_JSON_TEXT_H
#define STAGEWIRE_TESTING_TESTEE_JSON_TEXT_H

#include <stddef.h>
#include <stdint.h>

/**
 * Bytes of the UTF-8 character that a text begins with; the text is not empty.
 *
 * @return 0 when it begins with none. Overlong ones and surrogates are none.
 */
size_t json_character_size(const char *text, size_t size);

/** The value of a hex digit, small or capital; 16 for any other character. */
uint32_t json_hex_value(char character);

/**
 * Decode the escape whose backslash stands before a position, or two that are one character.
 *
 * What it means is written to `*to`, which moves on; that is never longer than the escape, so that a
 * text can be decoded in its own place. A surrogate without a partner is kept as if it were a character.
 *
 * @return where the escape ends; NULL when it is none.
 */
const char *json_read_escape(const char *from, const char *end, char **to);

#endif

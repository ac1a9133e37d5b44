/**
 * @file
 * The characters of JSON: UTF-8, escapes and hex digits.
 */
#ifndef STAGEWIRE_TESTING_TESTEE_JSON_TEXT_H
#define STAGEWIRE_TESTING_TESTEE_JSON_TEXT_H

#include <stddef.h>
#include <stdint.h>

/**
 * The length of the first UTF-8 character of a text, which must not be empty.
 *
 * @return 0 for invalid UTF-8, such as overlong forms and surrogates.
 */
size_t json_character_size(const char *text, size_t size);

/** The value of a hex digit in lower or upper case; 16 for any other character. */
uint32_t json_hex_value(char character);

/**
 * Decode the escape after a backslash, or two escapes that are a surrogate pair.
 *
 * The decoded text is written to `*to`, which is advanced. It is never longer than the escape, so a
 * text can be decoded in place. A lone surrogate is kept like a character.
 *
 * @return the end of the escape; NULL if it is invalid.
 */
const char *json_read_escape(const char *from, const char *end, char **to);

#endif

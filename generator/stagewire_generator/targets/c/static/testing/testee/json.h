/**
 * @file
 * JSON as a testee reads it: one text that is whole in memory, in UTF-8, strictly by RFC 8259; a key
 * that stands twice is refused.
 *
 * The values of a text stand one after the other in one array, a list or an object before what it
 * holds. Nothing recurses, so that no text is too much for the stack.
 */
#ifndef STAGEWIRE_TESTING_TESTEE_JSON_H
#define STAGEWIRE_TESTING_TESTEE_JSON_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    /** Lists and objects within each other; deeper ones are refused. */
    JSON_MAXIMUM_DEPTH = 512,
    /** Digits of an integer; a longer one is refused, as by the reader of Python. */
    JSON_MAXIMUM_DIGITS = 4300
};

enum json_kind {
    JSON_NULL,
    JSON_FALSE,
    JSON_TRUE,
    JSON_INTEGER,
    JSON_REAL, /**< A number with a fraction or an exponent, whatever its value. */
    JSON_TEXT,
    JSON_LIST,
    JSON_OBJECT /**< Holds keys, each a text with its value right behind it. */
};

struct json_value {
    enum json_kind kind;
    /** Values that it consists of, itself included: the next one stands so far behind. */
    uint32_t span;
    /** The digits of a number; a decoded text, in UTF-8 but for surrogates without a partner. */
    char *text;
    /** Bytes of the text; any of them may be NUL. */
    size_t size;
};

/** The values of one text. Begin with all zeros; it may be read into again and again. */
struct json {
    struct json_value *values; /**< The first is the outermost. */
    size_t count;
    size_t room;
    const char *problem; /**< Why the text is none. */
};

/**
 * Read a text. Strings are decoded where they stand, so that it changes; it has to outlive the values.
 *
 * @return false for what is not JSON; the problem says why.
 */
bool json_read(struct json *json, char *text, size_t size);

/** Give the memory of the values back. */
void json_free(struct json *json);

/** The first value in a list, or the first key in an object; the end of it when it is empty. */
const struct json_value *json_first(const struct json_value *holder);

/** What follows on a value: the next in its list, the next key in its object, or their end. */
const struct json_value *json_next(const struct json_value *value);

/** The value of a key in an object; NULL when there is none, or no object. */
const struct json_value *json_get(const struct json_value *object, const char *key);

/** Whether a value is exactly this text. */
bool json_is(const struct json_value *value, const char *text);

/**
 * The value of an integer: what it is without its sign, and whether it has one.
 *
 * @return false for one that needs more than 64 bits.
 */
bool json_integer(const struct json_value *value, uint64_t *magnitude, bool *negative);

/** Whether a value is a text of hex digits in pairs and nothing else. */
bool json_is_hex(const struct json_value *value);

/** The bytes that such a text gives. They take its place, so that it can be asked for them once. */
const uint8_t *json_bytes(const struct json_value *hex, size_t *size);

#endif

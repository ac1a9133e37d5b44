/**
 * @file JSON reader of the testee: reads a complete text in memory, in UTF-8, strictly by RFC 8259.
 * Duplicate keys are an error.
 *
 * The values of a text are stored in one array, a list or an object before its content. Reading
 * does not recurse, so no text can overflow the stack.
 */
#ifndef STAGEWIRE_TESTING_TESTEE_JSON_H
#define STAGEWIRE_TESTING_TESTEE_JSON_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    /** Maximum nesting of lists and objects. */
    JSON_MAXIMUM_DEPTH = 512,
    /** Maximum number of digits of an integer, as in Python. */
    JSON_MAXIMUM_DIGITS = 4300
};

enum json_kind {
    JSON_NULL,
    JSON_FALSE,
    JSON_TRUE,
    JSON_INTEGER,
    JSON_REAL, /**< A number with a fraction or an exponent. */
    JSON_TEXT,
    JSON_LIST,
    JSON_OBJECT /**< Contains keys, which are texts, each followed by its value. */
};

struct json_value {
    enum json_kind kind;
    /** Number of values in it, including itself: the distance to the next value. */
    uint32_t span;
    /** The digits of a number, or a decoded text in UTF-8, which may contain lone surrogates. */
    char *text;
    /** Bytes of the text; any of them may be NUL. */
    size_t size;
};

/** The values of a text. Initialise it with zeros; it can be used for several texts in turn. */
struct json {
    struct json_value *values; /**< The first is the outermost. */
    size_t count;
    size_t room;
    const char *problem; /**< Why the text is not JSON. */
};

/**
 * Read a text. Strings are decoded in place: the text is modified and must outlive the values.
 *
 * @return false if the text is not JSON; problem gives the reason.
 */
bool json_read(struct json *json, char *text, size_t size);

/** Free the memory of the values. */
void json_free(struct json *json);

/** The first value of a list or the first key of an object; its end if it is empty. */
const struct json_value *json_first(const struct json_value *holder);

/** The next value of a list or the next key of an object; its end after the last one. */
const struct json_value *json_next(const struct json_value *value);

/** The value of a key in an object; NULL if the key is missing or the value is not an object. */
const struct json_value *json_get(const struct json_value *object, const char *key);

/** Whether a value is this text. */
bool json_is(const struct json_value *value, const char *text);

/**
 * Get the magnitude and the sign of an integer.
 *
 * @return false if the magnitude needs more than 64 bits.
 */
bool json_integer(const struct json_value *value, uint64_t *magnitude, bool *negative);

/** Whether a value is a text of pairs of hex digits. */
bool json_is_hex(const struct json_value *value);

/** The bytes of such a text. They overwrite the text, so this can be called only once. */
const uint8_t *json_bytes(const struct json_value *hex, size_t *size);

#endif

/**
 * @file
 * Messages as JSON: from the fields of a request to the C struct of a layout, and back.
 */
#ifndef STAGEWIRE_TESTING_TESTEE_MESSAGE_H
#define STAGEWIRE_TESTING_TESTEE_MESSAGE_H

#include "testing/testee/testee.h"

/** The layout of a message in a form, or NULL. */
const struct stagewire_layout *message_layout(const struct json_value *message, const char *form);

/** The field of a layout with a name, or NULL. */
const struct stagewire_field *message_field(
    const struct stagewire_layout *layout, const struct json_value *name);

/**
 * Set a field of a message.
 *
 * @return STAGEWIRE_OK; STAGEWIRE_BAD_VALUE for a wrong type; STAGEWIRE_OUT_OF_RANGE if the value
 *         does not fit in the C struct. The encoder checks narrower ranges.
 */
enum stagewire_verdict message_set(
    const struct stagewire_field *field, const struct json_value *value, void *message);

/**
 * Set all fields of the message of a testee from its request. A missing field gets its constant.
 *
 * @return false if the request was refused.
 */
bool message_read(struct testee *testee, const struct stagewire_layout *layout);

/**
 * Read a required value of one byte, such as an address or an axis.
 *
 * @return false if the request was refused.
 */
bool message_read_byte(struct testee *testee, const char *key, uint8_t *byte);

/** Write one field of the message of a testee. */
void message_write_field(struct testee *testee, const struct stagewire_field *field);

/** Write all fields of the message of a testee, except unused parameters that are zero. */
void message_write(struct testee *testee, const struct stagewire_layout *layout);

#endif

/**
 * @file
 * Messages as JSON: the fields of a request in the C struct of a layout, and back.
 */
#ifndef STAGEWIRE_TESTING_TESTEE_MESSAGE_H
#define STAGEWIRE_TESTING_TESTEE_MESSAGE_H

#include "testing/testee/testee.h"

/** The layout of a message by its form; NULL when it has none. */
const struct stagewire_layout *message_layout(const struct json_value *message, const char *form);

/** A field of a layout by its name; NULL when it has none. */
const struct stagewire_field *message_field(
    const struct stagewire_layout *layout, const struct json_value *name);

/**
 * Set a field of a message.
 *
 * @return STAGEWIRE_OK; STAGEWIRE_BAD_VALUE, or STAGEWIRE_OUT_OF_RANGE for what the C struct cannot
 *         hold. A range that is narrower than that is the encoder's to check.
 */
enum stagewire_verdict message_set(
    const struct stagewire_field *field, const struct json_value *value, void *message);

/**
 * Set all fields of the message of a testee from its request; one that is left out has its constant.
 *
 * @return false when the request was refused.
 */
bool message_read(struct testee *testee, const struct stagewire_layout *layout);

/**
 * Read a value of one byte, such as an address or an axis, which has to be given.
 *
 * @return false when the request was refused.
 */
bool message_read_byte(struct testee *testee, const char *key, uint8_t *byte);

/** Write one field of the message of a testee. */
void message_write_field(struct testee *testee, const struct stagewire_field *field);

/** Write all fields of the message of a testee, without parameters that mean nothing and are zero. */
void message_write(struct testee *testee, const struct stagewire_layout *layout);

#endif

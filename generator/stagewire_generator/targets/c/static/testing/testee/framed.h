/**
 * @file
 * Protocols whose frames begin with a header: id, length or two parameters, two addresses.
 */
#ifndef STAGEWIRE_TESTING_TESTEE_FRAMED_H
#define STAGEWIRE_TESTING_TESTEE_FRAMED_H

#include "testing/testee/testee.h"

enum {
    FRAMED_HEADER = 6,
    FRAMED_LONGEST_PACKET = 255, /**< without an array */
    FRAMED_ROOM = 0xFFFF, /**< the most that a header can announce */
    /** Flag in the receiver's address: a packet follows, and bytes 2 and 3 are its length. */
    FRAMED_DATA_FLAG = 0x80,
    FRAMED_HIGHEST_ADDRESS = 0x7F
};

/** The parts of such a package that its layouts do not contain. */
struct framed_package {
    /** Get the id at a position in the table of ids; false after the last one. */
    bool (*id_at)(size_t position, uint16_t *id);
    /** The name of a message by its id, or NULL; NULL also for an id that several messages share. */
    const char *(*name)(uint16_t id);
    /** Messages that the document names without an id; NULL after the last one. */
    const char *const *nameless;
    /** Begin a stream. */
    void (*begin)(enum testee_end end);
    struct testee_reader parser;
};

/** Decoder and encoder of such protocols. */
extern const struct testee_codec framed_codec;

/** Form of a message whose layout depends on the context, if there is no context. */
extern const char framed_undecided[];
/** Form of a message without a layout. */
extern const char framed_undocumented[];

/** Check that a layout depends on the context of the request; if not, answer with an error. */
bool framed_check_context(struct testee *testee);

/** Whether a context selects a layout. */
bool framed_agrees(const struct stagewire_layout *layout, const struct json_value *context);

/** Whether a context has another value than one that selects a layout. */
bool framed_contradicts(const struct stagewire_layout *layout, const struct json_value *context);

/** Whether all layouts of the message that depend on a context have the field at the same place. */
bool framed_is_shared(const struct stagewire_layout *layout, const struct stagewire_field *field);

/** Answer with the bytes of the frame that the request describes. */
void framed_encode(struct testee *testee);

/** Read two bytes, the least significant first. */
uint16_t framed_get_16(const uint8_t *bytes);

#endif

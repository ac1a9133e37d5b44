/**
 * @file
 * Protocols whose frames begin with a header: id, length or two parameters, two addresses.
 */
#ifndef STAGEWIRE_TESTING_TESTEE_FRAMED_H
#define STAGEWIRE_TESTING_TESTEE_FRAMED_H

#include "testing/testee/testee.h"

enum {
    FRAMED_HEADER = 6,
    FRAMED_LONGEST_PACKET = 255,
    /** In the receiver's address: a packet follows, and bytes 2 and 3 are its length. */
    FRAMED_DATA_FLAG = 0x80,
    FRAMED_HIGHEST_ADDRESS = 0x7F
};

/** What the package of such a protocol knows and its layouts do not say. */
struct framed_package {
    /** The id of a message by its position in the table of ids; false behind the last one. */
    bool (*id_at)(size_t position, uint16_t *id);
    /** The name of a message by its id; NULL when there is none. */
    const char *(*name)(uint16_t id);
    /** Messages that the document names without an id; NULL behind the last one. */
    const char *const *nameless;
    /** Begin a stream. */
    void (*begin)(enum testee_end end);
    struct testee_reader parser;
};

/** How such a protocol is decoded and encoded. */
extern const struct testee_codec framed_codec;

/** The form of a message whose layout only a context decides, while there is none. */
extern const char framed_undecided[];
/** The form of a message that has no layout. */
extern const char framed_undocumented[];

/** Refuse a context on which no layout depends; return whether the one of the request was right. */
bool framed_check_context(struct testee *testee);

/** Whether a context decides for a layout. */
bool framed_agrees(const struct stagewire_layout *layout, const struct json_value *context);

/** Whether a field is the same in all layouts of the message between which a context decides. */
bool framed_is_shared(const struct stagewire_layout *layout, const struct stagewire_field *field);

/** Answer with the bytes of the frame that the request describes. */
void framed_encode(struct testee *testee);

/** Two bytes, the lower one first. */
uint16_t framed_get_16(const uint8_t *bytes);

#endif

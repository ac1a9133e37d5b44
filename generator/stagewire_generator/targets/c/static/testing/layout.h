/**
 * @file layout.h
 * Layouts as data: what a test program asks that speaks any message by its name.
 *
 * The functions of a layout are those of the generated headers; a layout only makes them all look
 * alike. Firmware and hosts use the headers, and need nothing of this.
 */
#ifndef STAGEWIRE_TESTING_LAYOUT_H
#define STAGEWIRE_TESTING_LAYOUT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/** What encoding or decoding came to, by the words of the testee protocol. */
enum stagewire_verdict {
    STAGEWIRE_OK,
    STAGEWIRE_TRUNCATED,
    STAGEWIRE_TRAILING,
    STAGEWIRE_BAD_LENGTH,
    STAGEWIRE_UNKNOWN_MESSAGE,
    STAGEWIRE_OUT_OF_RANGE,
    STAGEWIRE_BAD_VALUE,
    STAGEWIRE_NO_SPACE,
    STAGEWIRE_UNSUPPORTED
};

/** What the member of a struct holds that stands for a field. */
enum stagewire_kind {
    STAGEWIRE_UNSIGNED,
    STAGEWIRE_SIGNED,
    STAGEWIRE_TEXT, /**< characters without an end mark */
    STAGEWIRE_BYTES
};

/** Whether a command has the slot that says how many bytes of data follow. */
enum stagewire_size_slot {
    STAGEWIRE_SLOT_AS_PRINTED, /**< as the document has it for this command */
    STAGEWIRE_SLOT_GIVEN,
    STAGEWIRE_SLOT_LEFT_OUT
};

/** What carries a message, whichever of it the framing has; the rest stays zero. */
struct stagewire_envelope {
    uint8_t dest;
    uint8_t source;
    uint8_t axis;
    uint8_t size_slot; /**< one of enum stagewire_size_slot */
    uint32_t address;
    const uint8_t *extra; /**< bytes beyond the layout; what was decoded has them in its bytes */
    size_t extra_size;
};

/** One field of a layout, header parameters included. */
struct stagewire_field {
    const char *name;
    uint16_t offset; /**< in the C struct, not on the wire */
    uint16_t size; /**< bytes in the C struct */
    uint16_t wire_size; /**< bytes on the wire */
    enum stagewire_kind kind;
    bool optional; /**< may be left out; then the constant is sent */
    bool unnamed; /**< a parameter of a header that means nothing */
    int64_t constant; /**< of this and of the range: the bits, where 8 bytes have no sign */
    int64_t minimum;
    int64_t maximum;
};

/** One way in which a message stands on the wire. */
struct stagewire_layout {
    const char *message;
    const char *form;
    const char *kind; /**< message, command or setup */
    uint16_t id;
    const char *context; /**< what decides for this layout, such as status; NULL where bytes do */
    const char *value; /**< what it has to be */
    uint16_t length; /**< bytes of payload */
    uint32_t message_size; /**< bytes of all of the message, as the document prints it */
    uint16_t struct_size; /**< bytes of the C struct; 0 where there is none */
    const struct stagewire_field *fields;
    uint16_t field_count;
    /** Encodes a message; *size is set when it did. Unchecked, no range is looked at. */
    enum stagewire_verdict (*encode)(const void *message, const struct stagewire_envelope *to,
        uint8_t *out, size_t cap, size_t *size, bool checked);
    /** Decodes exactly one message; *from, which may be NULL, is set when it did. */
    enum stagewire_verdict (*decode)(const uint8_t *bytes, size_t size, void *message,
        struct stagewire_envelope *from);
};

#endif

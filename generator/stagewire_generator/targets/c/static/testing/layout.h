/**
 * @file layout.h
 * Layouts as data, for test programs that handle any message by its name.
 *
 * A layout gives the functions of the generated headers a common signature. Firmware and hosts use
 * the headers directly and do not need this file.
 */
#ifndef STAGEWIRE_TESTING_LAYOUT_H
#define STAGEWIRE_TESTING_LAYOUT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/** Result of encoding or decoding; corresponds to the error codes of the testee protocol. */
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

/** Type of a struct member. */
enum stagewire_kind {
    STAGEWIRE_UNSIGNED,
    STAGEWIRE_SIGNED,
    STAGEWIRE_TEXT, /**< characters, not terminated */
    STAGEWIRE_BYTES,
    STAGEWIRE_UNSIGNED_ARRAY, /**< a struct stagewire_array; the last field of a packet */
    STAGEWIRE_SIGNED_ARRAY
};

/** The array at the end of a packet, as the array type of each package. */
struct stagewire_array {
    const uint8_t *bytes; /**< integers as on the wire; of a decoded message, a part of its bytes */
    size_t count;
};

/** Whether a command has a size slot. */
enum stagewire_size_slot {
    STAGEWIRE_SLOT_AS_PRINTED, /**< as the document prints this command */
    STAGEWIRE_SLOT_GIVEN,
    STAGEWIRE_SLOT_LEFT_OUT
};

/** The parts around a message. Members that the framing does not have are zero. */
struct stagewire_envelope {
    uint8_t dest;
    uint8_t source;
    uint8_t axis;
    uint8_t size_slot; /**< one of enum stagewire_size_slot */
    uint32_t address;
    const uint8_t *extra; /**< bytes after the layout; of a decoded message, a part of its bytes */
    size_t extra_size;
};

/** A field of a layout, or a header parameter. */
struct stagewire_field {
    const char *name;
    uint16_t offset; /**< in the C struct, not on the wire */
    uint16_t size; /**< bytes in the C struct */
    uint16_t wire_size; /**< bytes on the wire; of an array, of one integer */
    enum stagewire_kind kind;
    bool optional; /**< may be left out; then the constant is sent */
    bool unnamed; /**< an unused parameter of a header */
    int64_t constant; /**< this and the range hold the bits if the type is uint64_t */
    int64_t minimum;
    int64_t maximum;
};

/** A context that selects a layout, such as status, and its value. */
struct stagewire_context {
    const char *name; /**< NULL after the last one */
    const char *value;
};

/** A layout of a message on the wire. */
struct stagewire_layout {
    const char *message;
    const char *form;
    const char *kind; /**< message, command or setup */
    uint16_t id;
    const struct stagewire_context *contexts; /**< contexts that select it together, or NULL */
    uint16_t length; /**< bytes of payload */
    uint32_t message_size; /**< bytes of the message as the document prints it */
    uint16_t struct_size; /**< bytes of the C struct; 0 if there is none */
    const struct stagewire_field *fields;
    uint16_t field_count;
    /** Encodes a message and sets *size on success. Checks ranges only if checked is true. */
    enum stagewire_verdict (*encode)(const void *message, const struct stagewire_envelope *to,
        uint8_t *out, size_t cap, size_t *size, bool checked);
    /** Decodes exactly one message and sets *from on success; from may be NULL. */
    enum stagewire_verdict (*decode)(const uint8_t *bytes, size_t size, void *message,
        struct stagewire_envelope *from);
};

#endif

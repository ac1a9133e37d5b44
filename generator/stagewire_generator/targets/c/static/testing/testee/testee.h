/**
 * @file
 * The testee: answers requests about one protocol, one JSON object per line.
 *
 * A test suite uses testees to compare how implementations encode and decode. This testee is for
 * the generated C. It is a program for a host, uses the standard library and serves one protocol.
 * Its sources are all files of this directory, layouts.c and testee.c of the package, and the
 * source file of the package. Build it in the directory that contains testing/ and stagewire_apt/:
 *
 *     p=stagewire_apt; t=$(find testing/testee -name '*.c')
 *     cc -std=c99 -I. -o testee $t $p/testing/layouts.c $p/testing/testee.c $p/$p.c
 *
 * testee.schema.json is the schema of requests and answers.
 */
#ifndef STAGEWIRE_TESTING_TESTEE_TESTEE_H
#define STAGEWIRE_TESTING_TESTEE_TESTEE_H

#include "testing/layout.h"
#include "testing/testee/json.h"
#include "testing/testee/json_writer.h"

#include <stdbool.h>
#include <stddef.h>

/** Error code of an answer. */
enum testee_refusal {
    TESTEE_TRUNCATED,
    TESTEE_TRAILING,
    TESTEE_BAD_LENGTH,
    TESTEE_UNKNOWN_MESSAGE,
    TESTEE_UNKNOWN_FIELD,
    TESTEE_MISSING_FIELD,
    TESTEE_OUT_OF_RANGE,
    TESTEE_BAD_VALUE,
    TESTEE_BAD_REQUEST,
    TESTEE_UNSUPPORTED
};

/** Framing of a protocol, which decides on the keys of requests. The values are bits of a set. */
enum testee_framing {
    TESTEE_HEADER = 1,
    TESTEE_SLOTS = 2,
    TESTEE_PACKET = 4,
    TESTEE_ADDRESSED_PACKET = 8
};

/** A line that is being answered. */
struct testee {
    struct json_writer writer;
    const struct json_value
        *request; /**< The object on the line; its keys have been checked. */
    const struct json_value *id; /**< NULL if the line has none. */
    void *message; /**< Room for the C struct of any layout. */
};

/** The operations for protocols of one framing. Each function answers the request. */
struct testee_codec {
    void (*decode)(struct testee *testee);
    void (*encode)(struct testee *testee);
    void (*stream)(struct testee *testee);
};

/** The end of the line that receives a stream. */
enum testee_end {
    TESTEE_END_NONE,
    TESTEE_END_HOST,
    TESTEE_END_DEVICE
};

/** Kind of an event of a stream. */
enum testee_event_kind {
    TESTEE_NONE,
    TESTEE_MESSAGE,
    TESTEE_UNDOCUMENTED,
    TESTEE_UNKNOWN,
    TESTEE_WRONG_LENGTH,
    TESTEE_GARBAGE
};

/** Bytes that the struct does not own. */
struct testee_bytes {
    const uint8_t *bytes;
    size_t size;
};

/** An event of a stream. */
struct testee_event {
    enum testee_event_kind kind;
    struct testee_bytes bytes;
};

/** The parser of a package. */
struct testee_reader {
    /** Consume bytes up to the end of the next event; TESTEE_NONE when all bytes were consumed. */
    struct testee_event (*next)(struct testee_bytes *data);
    /** The pending bytes. */
    struct testee_bytes (*pending)(void);
};

struct framed_package;
struct command_package;
struct packet_package;

/** A protocol. */
struct testee_protocol {
    const char *name;
    enum testee_framing framing;
    const struct testee_codec *codec;
    const struct stagewire_layout *layouts;
    size_t layout_count;
    /** The package's part for the codec; only the member of the protocol's framing is not NULL. */
    const struct framed_package *framed;
    const struct command_package *commands;
    const struct packet_package *packets;
};

/** The protocol of this program. */
extern const struct testee_protocol testee_protocol;

/** The end of its layouts. */
const struct stagewire_layout *testee_layouts_end(void);

/** The value of a key of the request; NULL if it is missing. */
const struct json_value *testee_get(const struct testee *testee, const char *key);

/** The value of a key of the request; NULL if it is missing or null. */
const struct json_value *testee_given(const struct testee *testee, const char *key);

/** The object under a key of the request; an empty object if it is missing. */
const struct json_value *testee_object(const struct testee *testee, const char *key);

/** Whether the value of a key of the request is true. */
bool testee_is_set(const struct testee *testee, const char *key);

/**
 * Answer with an error.
 *
 * @param about shown after the text; may be NULL.
 * @return false, as the result of functions that return whether they succeeded.
 */
bool testee_refuse(struct testee *testee, enum testee_refusal refusal, const char *text,
    const struct json_value *about);

/** Answer with an error unless the verdict is STAGEWIRE_OK; return whether it is. */
bool testee_passes(
    struct testee *testee, enum stagewire_verdict verdict, const struct json_value *about);

/** Begin a successful answer; its content follows, key by key. */
void testee_accept(struct testee *testee);

/** Answer with the bytes of a message. */
void testee_answer_bytes(struct testee *testee, const uint8_t *bytes, size_t size);

/** State of writing events of a stream. Adjacent pieces of garbage become one event. */
struct testee_events {
    struct testee *testee;
    bool in_garbage;
};

/** Begin an event with more content than its bytes; end it with json_close(). */
void testee_open_event(struct testee_events *events, const char *name);

/** The end of the line in the request. */
enum testee_end testee_end_of(const struct testee *testee);

/**
 * Accept the request and answer with the events of its stream.
 *
 * @param put writes an event that is a message, documented or not; returns false if the message
 *            cannot be decoded.
 */
void testee_stream(struct testee *testee, const struct testee_reader *reader,
    bool (*put)(
        struct testee_events *events, const char *name, const struct testee_bytes *message));

#endif

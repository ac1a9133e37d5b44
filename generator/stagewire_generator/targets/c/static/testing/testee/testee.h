/**
 * @file
 * The testee: answers requests about one protocol, one JSON object a line in and one out.
 *
 * So any implementation can be asked what it makes of bytes and values; this one is the generated C. It
 * is a program for a host and uses the standard library. One program serves one protocol. Its sources
 * are all of this folder, layouts.c and testee.c of the package, and the source of the package itself;
 * in the folder that holds testing/ and stagewire_apt/:
 *
 *     p=stagewire_apt; t=$(find testing/testee -name '*.c')
 *     cc -std=c99 -I. -o testee $t $p/testing/layouts.c $p/testing/testee.c $p/$p.c
 *
 * Requests and answers have a schema, testee.schema.json.
 */
#ifndef STAGEWIRE_TESTING_TESTEE_TESTEE_H
#define STAGEWIRE_TESTING_TESTEE_TESTEE_H

#include "testing/layout.h"
#include "testing/testee/json.h"
#include "testing/testee/json_writer.h"

#include <stdbool.h>
#include <stddef.h>

/** Why a request is not granted. */
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

/** What a protocol is framed by, which decides what a request may say. Bits, which can be joined. */
enum testee_framing {
    TESTEE_HEADER = 1,
    TESTEE_SLOTS = 2,
    TESTEE_PACKET = 4,
    TESTEE_ADDRESSED_PACKET = 8
};

/** One line, while it is answered. */
struct testee {
    struct json_writer writer;
    const struct json_value
        *request; /**< The object on the line; its keys are known to be right. */
    const struct json_value *id; /**< NULL when the line has none. */
    void *message; /**< Room for the C struct of any layout. */
};

/** How protocols of one framing are spoken. Each function answers the request. */
struct testee_codec {
    void (*decode)(struct testee *testee);
    void (*encode)(struct testee *testee);
    void (*stream)(struct testee *testee);
};

/** Which end of the line listens to a stream. */
enum testee_end {
    TESTEE_END_NONE,
    TESTEE_END_HOST,
    TESTEE_END_DEVICE
};

/** Of which kind an event of a stream is. */
enum testee_event_kind {
    TESTEE_NONE,
    TESTEE_MESSAGE,
    TESTEE_UNDOCUMENTED,
    TESTEE_UNKNOWN,
    TESTEE_WRONG_LENGTH,
    TESTEE_GARBAGE
};

/** Bytes in somebody else's memory. */
struct testee_bytes {
    const uint8_t *bytes;
    size_t size;
};

/** What comes out of a stream. */
struct testee_event {
    enum testee_event_kind kind;
    struct testee_bytes bytes;
};

/** What cuts a stream into events: a parser of the package, which keeps one for that. */
struct testee_reader {
    /** Take bytes up to the end of the next event; TESTEE_NONE when all were taken without one. */
    struct testee_event (*next)(struct testee_bytes *data);
    /** The bytes that wait for more. */
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
    /** What the codec has to know beside the layouts; NULL but for the protocol's own framing. */
    const struct framed_package *framed;
    const struct command_package *commands;
    const struct packet_package *packets;
};

/** The protocol of this program. */
extern const struct testee_protocol testee_protocol;

/** The end of its layouts. */
const struct stagewire_layout *testee_layouts_end(void);

/** What the request has under a key; NULL when it is not there. */
const struct json_value *testee_get(const struct testee *testee, const char *key);

/** What the request has under a key; also NULL when that is null. */
const struct json_value *testee_given(const struct testee *testee, const char *key);

/** The object that the request has under a key; an empty one when it is not there. */
const struct json_value *testee_object(const struct testee *testee, const char *key);

/** Whether the request has true under a key. */
bool testee_is_set(const struct testee *testee, const char *key);

/**
 * Answer that the request is not granted.
 *
 * @param about shown behind the text; may be NULL.
 * @return false, for whoever returns whether all went well.
 */
bool testee_refuse(struct testee *testee, enum testee_refusal refusal, const char *text,
    const struct json_value *about);

/** Refuse unless the verdict is that all went well; return whether it is. */
bool testee_passes(
    struct testee *testee, enum stagewire_verdict verdict, const struct json_value *about);

/** Begin the answer to a request that is granted: what it says follows, key by key. */
void testee_accept(struct testee *testee);

/** Answer with the bytes of a message. */
void testee_answer_bytes(struct testee *testee, const uint8_t *bytes, size_t size);

/** Events of a stream, as they are written. Garbage that comes in pieces is one event. */
struct testee_events {
    struct testee *testee;
    bool in_garbage;
};

/** Begin an event of which more is said than its bytes; end it with json_close(). */
void testee_open_event(struct testee_events *events, const char *name);

/** Which end of the line the request is about. */
enum testee_end testee_end_of(const struct testee *testee);

/**
 * Accept the request and answer with the events of its stream.
 *
 * @param put writes an event that is a message, documented or not; false when the decoders do not take
 *            what the parser found.
 */
void testee_stream(struct testee *testee, const struct testee_reader *reader,
    bool (*put)(
        struct testee_events *events, const char *name, const struct testee_bytes *message));

#endif

/**
 * @file
 * The form of requests: their keys, and the types of values.
 */
#include "testing/testee/request.h"

const struct operation_name operation_names[OPERATIONS] = {
    {"hello", HELLO},
    {"decode", DECODE},
    {"encode", ENCODE},
    {"stream", STREAM},
};

/* Allowed types of a value: a bit for each type. */
enum {
    BOOLEAN = 1 << JSON_FALSE | 1 << JSON_TRUE,
    TEXT = 1 << JSON_TEXT,
    TEXT_OR_NULL = TEXT | 1 << JSON_NULL,
    LIST = 1 << JSON_LIST,
    OBJECT = 1 << JSON_OBJECT,
    ANYTHING = 0xFF
};

enum {
    EVERY_OPERATION = HELLO | DECODE | ENCODE | STREAM,
    ABOUT_A_PROTOCOL = DECODE | ENCODE | STREAM,
    EVERY_FRAMING = TESTEE_HEADER | TESTEE_SLOTS | TESTEE_PACKET | TESTEE_ADDRESSED_PACKET
};

/* Addresses and axes are checked by the codec, like fields. */
static const struct key {
    const char *name;
    unsigned kinds;
    unsigned known_to;
    unsigned framings;
    unsigned needed_by;
} known_keys[] = {
    {"id", ANYTHING, EVERY_OPERATION, EVERY_FRAMING, 0},
    {"op", TEXT, EVERY_OPERATION, EVERY_FRAMING, 0},
    {"protocol", TEXT, ABOUT_A_PROTOCOL, EVERY_FRAMING, ABOUT_A_PROTOCOL},
    {"hex", TEXT, DECODE, EVERY_FRAMING, DECODE},
    {"message", TEXT, ENCODE, EVERY_FRAMING, ENCODE},
    {"chunks", LIST, STREAM, EVERY_FRAMING, STREAM},
    {"form", TEXT, ENCODE, EVERY_FRAMING, 0},
    {"fields", OBJECT, ENCODE, EVERY_FRAMING, 0},
    {"extra", TEXT, ENCODE, EVERY_FRAMING, 0},
    {"end", TEXT, STREAM, EVERY_FRAMING, 0},
    {"context", OBJECT, ABOUT_A_PROTOCOL, TESTEE_HEADER, 0},
    {"data", TEXT_OR_NULL, ENCODE, TESTEE_HEADER, 0},
    {"dest", ANYTHING, ENCODE, TESTEE_HEADER, 0},
    {"source", ANYTHING, ENCODE, TESTEE_HEADER, 0},
    {"direction", TEXT, DECODE | ENCODE, TESTEE_SLOTS, 0},
    {"command", TEXT, DECODE | STREAM, TESTEE_SLOTS, 0},
    {"kind", TEXT, ENCODE, TESTEE_SLOTS, 0},
    {"axis", ANYTHING, ENCODE, TESTEE_SLOTS, 0},
    {"allow_dummy", BOOLEAN, ENCODE, TESTEE_SLOTS, 0},
    {"refuse_prefix_bytes", BOOLEAN, ENCODE, TESTEE_SLOTS, 0},
    {"address", ANYTHING, ENCODE, TESTEE_ADDRESSED_PACKET, 0},
};

static const struct key *const keys_end = known_keys + sizeof known_keys / sizeof *known_keys;

static bool bad(struct testee *testee, const char *text, const struct json_value *about)
{
    return testee_refuse(testee, TESTEE_BAD_REQUEST, text, about);
}

bool is_our_protocol(const struct testee *testee)
{
    const struct json_value *const protocol = testee_get(testee, "protocol");
    return protocol != NULL && json_is(protocol, testee_protocol.name);
}

static bool find_operation(struct testee *testee, enum operation *operation)
{
    const struct json_value *const op = testee_get(testee, "op");
    if (op == NULL || op->kind != JSON_TEXT) {
        return bad(testee, "op must be the name of an operation", op);
    }
    for (size_t i = 0; i < OPERATIONS; ++i) {
        if (json_is(op, operation_names[i].name)) {
            *operation = operation_names[i].operation;
            return true;
        }
    }
    return testee_refuse(testee, TESTEE_UNSUPPORTED, "unknown operation", op);
}

/* Check that all keys are known and have values of the right type. The known keys depend on the
   protocol; for another protocol, all keys are known. */
static bool check_keys(struct testee *testee, enum operation operation)
{
    const unsigned framing =
        is_our_protocol(testee) ? (unsigned)testee_protocol.framing : EVERY_FRAMING;
    const struct json_value *const request = testee->request;
    for (const struct json_value *at = json_first(request); at != json_next(request);
         at = json_next(at + 1)) {
        const struct key *key = known_keys;
        while (key != keys_end && !json_is(at, key->name)) {
            ++key;
        }
        if (key == keys_end || (key->known_to & operation) == 0 || (key->framings & framing) == 0) {
            return bad(testee, "unknown key for this operation", at);
        }
        if ((key->kinds & (1U << at[1].kind)) == 0) {
            return bad(testee, "the value of this key has the wrong type", at);
        }
    }
    return true;
}

static bool check_needed(struct testee *testee, enum operation operation)
{
    for (const struct key *key = known_keys; key != keys_end; ++key) {
        if ((key->needed_by & operation) != 0 && testee_get(testee, key->name) == NULL) {
            return bad(testee, "a required key is missing", NULL);
        }
    }
    return true;
}

static bool check_context(struct testee *testee)
{
    const struct json_value *const context = testee_object(testee, "context");
    for (const struct json_value *at = json_first(context); at != json_next(context);
         at = json_next(at + 1)) {
        if (at[1].kind != JSON_TEXT) {
            return bad(testee, "a context must be a string", at);
        }
    }
    return true;
}

static bool check_hex(struct testee *testee, const char *key)
{
    const struct json_value *const hex = testee_given(testee, key);
    return hex == NULL || json_is_hex(hex) || bad(testee, "bytes must be pairs of hex digits", hex);
}

static bool check_chunks(struct testee *testee)
{
    const struct json_value *const chunks = testee_get(testee, "chunks");
    for (const struct json_value *chunk = json_first(chunks); chunk != json_next(chunks);
         chunk = json_next(chunk)) {
        if (!json_is_hex(chunk)) {
            return bad(testee, "chunks must be strings of hex digits", chunk);
        }
    }
    return true;
}

static bool check_end(struct testee *testee)
{
    const struct json_value *const end = testee_get(testee, "end");
    return end == NULL || json_is(end, "host") || json_is(end, "device") || json_is(end, "none")
        || bad(testee, "end must be host, device or none", end);
}

static bool check_protocol(struct testee *testee)
{
    return is_our_protocol(testee)
        || testee_refuse(testee, TESTEE_UNSUPPORTED, "this program supports another protocol",
            testee_get(testee, "protocol"));
}

bool check_request(struct testee *testee, enum operation *operation)
{
    if (!find_operation(testee, operation) || !check_needed(testee, *operation)
        || !check_keys(testee, *operation) || !check_context(testee)) {
        return false;
    }
    switch (
        *operation) { /* with an unknown protocol, the order decides which error is reported */
    case DECODE:
        return check_protocol(testee) && check_hex(testee, "hex");
    case ENCODE:
        return check_hex(testee, "data") && check_hex(testee, "extra") && check_protocol(testee);
    case STREAM:
        return check_end(testee) && check_chunks(testee) && check_protocol(testee);
    case HELLO:
    default:
        return true;
    }
}

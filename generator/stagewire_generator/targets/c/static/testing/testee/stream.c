/**
 * @file
 * Streams: chunks in, events out.
 */
#include "testing/testee/testee.h"

static const char *const names[] = {
    [TESTEE_NONE] = "none",
    [TESTEE_MESSAGE] = "message",
    [TESTEE_UNDOCUMENTED] = "undocumented",
    [TESTEE_UNKNOWN] = "unknown",
    [TESTEE_WRONG_LENGTH] = "bad_length",
    [TESTEE_GARBAGE] = "garbage",
};

enum testee_end testee_end_of(const struct testee *testee)
{
    const struct json_value *const end = testee_get(testee, "end");
    if (end != NULL && json_is(end, "host")) {
        return TESTEE_END_HOST;
    }
    return end != NULL && json_is(end, "device") ? TESTEE_END_DEVICE : TESTEE_END_NONE;
}

static void end_garbage(struct testee_events *events)
{
    if (events->in_garbage) {
        json_close_text(&events->testee->writer);
        json_close(&events->testee->writer, '}');
        events->in_garbage = false;
    }
}

void testee_open_event(struct testee_events *events, const char *name)
{
    struct json_writer *const writer = &events->testee->writer;
    end_garbage(events);
    json_open(writer, '{');
    json_key(writer, "event");
    json_put_string(writer, name);
}

static void put_garbage(struct testee_events *events, const struct testee_bytes *piece)
{
    struct json_writer *const writer = &events->testee->writer;
    if (!events->in_garbage) {
        testee_open_event(events, names[TESTEE_GARBAGE]);
        json_key(writer, "hex");
        json_open_text(writer);
        events->in_garbage = true;
    }
    json_put_hex_piece(writer, piece->bytes, piece->size);
}

static void put_bytes(
    struct testee_events *events, const char *name, const struct testee_bytes *event)
{
    struct json_writer *const writer = &events->testee->writer;
    testee_open_event(events, name);
    json_key(writer, "hex");
    json_put_hex(writer, event->bytes, event->size);
    json_close(writer, '}');
}

void testee_stream(struct testee *testee, const struct testee_reader *reader,
    bool (*put)(struct testee_events *events, const char *name, const struct testee_bytes *message))
{
    struct json_writer *const writer = &testee->writer;
    const struct json_value *const chunks = testee_get(testee, "chunks");
    struct testee_events events = {testee, false};
    testee_accept(testee);
    json_key(writer, "events");
    json_open(writer, '[');
    for (const struct json_value *chunk = json_first(chunks); chunk != json_next(chunks);
         chunk = json_next(chunk)) {
        struct testee_bytes data;
        data.bytes = json_bytes(chunk, &data.size);
        for (struct testee_event event = reader->next(&data); event.kind != TESTEE_NONE;
             event = reader->next(&data)) {
            const bool is_message =
                event.kind == TESTEE_MESSAGE || event.kind == TESTEE_UNDOCUMENTED;
            if (event.kind == TESTEE_GARBAGE) {
                put_garbage(&events, &event.bytes);
            } else if (!is_message) {
                put_bytes(&events, names[event.kind], &event.bytes);
            } else if (!put(&events, names[event.kind], &event.bytes)) {
                put_bytes(&events, names[TESTEE_NONE],
                    &event.bytes); /* an unexpected event, which fails the comparison */
            }
        }
    }
    const struct testee_bytes pending = reader->pending();
    end_garbage(&events);
    json_close(writer, ']');
    json_key(writer, "pending");
    json_put_hex(writer, pending.bytes, pending.size);
}

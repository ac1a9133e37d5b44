/**
 * @file
 * Decoding of frames with a header, and their streams.
 */
#include "testing/testee/framed.h"

#include "testing/testee/message.h"

#include <string.h>

uint16_t framed_get_16(const uint8_t *bytes)
{
    return (uint16_t)(bytes[0] | bytes[1] << 8);
}

const char framed_undecided[] = "data:undecided";
const char framed_undocumented[] = "undocumented";

bool framed_agrees(const struct stagewire_layout *layout, const struct json_value *context)
{
    const struct stagewire_context *at = layout->contexts;
    for (; at != NULL && at->name != NULL; ++at) {
        const struct json_value *const value = json_get(context, at->name);
        if (value == NULL || !json_is(value, at->value)) {
            return false;
        }
    }
    return at != NULL;
}

bool framed_contradicts(const struct stagewire_layout *layout, const struct json_value *context)
{
    const struct stagewire_context *at = layout->contexts;
    for (; at != NULL && at->name != NULL; ++at) {
        const struct json_value *const value = json_get(context, at->name);
        if (value != NULL && !json_is(value, at->value)) {
            return true;
        }
    }
    return false;
}

/* Whether a key of a context, which its value follows, is one of those that select a layout. */
static bool is_known(const struct stagewire_layout *layout, const struct json_value *key)
{
    const struct stagewire_context *at = layout->contexts;
    while (at != NULL && at->name != NULL) {
        if (json_is(key, at->name) && json_is(key + 1, at->value)) {
            return true;
        }
        ++at;
    }
    return false;
}

bool framed_check_context(struct testee *testee)
{
    const struct json_value *const context = testee_object(testee, "context");
    for (const struct json_value *at = json_first(context); at != json_next(context);
         at = json_next(at + 1)) {
        const struct stagewire_layout *layout = testee_protocol.layouts;
        while (layout != testee_layouts_end() && !is_known(layout, at)) {
            ++layout;
        }
        if (layout == testee_layouts_end()) {
            return testee_refuse(testee, TESTEE_BAD_VALUE, "no layout depends on this context", at);
        }
    }
    return true;
}

/* A decoded frame. The layout is the one of the struct with its fields. */
struct reading {
    const char *message;
    const char *form;
    const struct stagewire_layout *layout; /* NULL if the message is undocumented */
    struct stagewire_envelope envelope;
};

static bool has_packet(const uint8_t *frame)
{
    return (frame[4] & FRAMED_DATA_FLAG) != 0;
}

static enum stagewire_verdict read_undocumented(
    const uint8_t *frame, size_t size, struct reading *reading)
{
    const size_t length = has_packet(frame) ? framed_get_16(&frame[2]) : 0U;
    reading->message = testee_protocol.framed->name(framed_get_16(frame));
    reading->form = framed_undocumented;
    reading->envelope.dest = frame[4] & FRAMED_HIGHEST_ADDRESS;
    reading->envelope.source = frame[5];
    if (reading->message == NULL) {
        return STAGEWIRE_UNKNOWN_MESSAGE;
    }
    if (size != FRAMED_HEADER + length) {
        return size < FRAMED_HEADER + length ? STAGEWIRE_TRUNCATED : STAGEWIRE_TRAILING;
    }
    return length > FRAMED_LONGEST_PACKET ? STAGEWIRE_BAD_LENGTH : STAGEWIRE_OK;
}

/* Whether a layout is better than another one if the bytes fit both: the context selects it, or it
 * is
   longer. */
static bool is_better(const struct stagewire_layout *layout, const struct stagewire_layout *than,
    const struct json_value *context)
{
    if (than == NULL || framed_agrees(than, context)) {
        return than == NULL;
    }
    return framed_agrees(layout, context) || layout->length > than->length;
}

/* Read a frame: try the decoders of all layouts. */
static enum stagewire_verdict read_frame(
    struct testee *testee, const uint8_t *frame, size_t size, struct reading *reading)
{
    const struct json_value *const context = testee_object(testee, "context");
    const struct stagewire_layout *best = NULL;
    enum stagewire_verdict refusal = STAGEWIRE_UNKNOWN_MESSAGE;
    memset(reading, 0, sizeof *reading);
    if (size < FRAMED_HEADER) {
        return STAGEWIRE_TRUNCATED;
    }
    for (const struct stagewire_layout *layout = testee_protocol.layouts;
         layout != testee_layouts_end(); ++layout) {
        const enum stagewire_verdict verdict = layout->decode(frame, size, testee->message, NULL);
        if (verdict == STAGEWIRE_OK && is_better(layout, best, context)) {
            best = layout;
        } else if (verdict != STAGEWIRE_UNKNOWN_MESSAGE) {
            refusal = verdict;
        }
    }
    if (best == NULL) {
        const bool no_layout = refusal == STAGEWIRE_UNKNOWN_MESSAGE;
        return no_layout ? read_undocumented(frame, size, reading) : refusal;
    }
    reading->message = best->message;
    reading->form =
        best->contexts == NULL || framed_agrees(best, context) ? best->form : framed_undecided;
    reading->layout = best;
    return best->decode(frame, size, testee->message, &reading->envelope);
}

static bool is_undecided(const struct reading *reading)
{
    return reading->form == framed_undecided;
}

/* The offset of a field in the payload. */
static size_t place(const struct stagewire_layout *layout, const struct stagewire_field *field)
{
    size_t at = 0;
    for (const struct stagewire_field *before = layout->fields; before != field; ++before) {
        at += before->wire_size;
    }
    return at;
}

bool framed_is_shared(const struct stagewire_layout *layout, const struct stagewire_field *field)
{
    for (const struct stagewire_layout *other = testee_protocol.layouts;
         other != testee_layouts_end(); ++other) {
        if (strcmp(other->message, layout->message) != 0 || other->contexts == NULL) {
            continue;
        }
        const struct stagewire_field *found = other->fields;
        const struct stagewire_field *const end = other->fields + other->field_count;
        while (found != end && strcmp(found->name, field->name) != 0) {
            ++found;
        }
        if (found == end || found->kind != field->kind || found->wire_size != field->wire_size
            || place(other, found) != place(layout, field)) {
            return false;
        }
    }
    return true;
}

static void write_shared(struct testee *testee, const struct stagewire_layout *layout)
{
    json_key(&testee->writer, "fields");
    json_open(&testee->writer, '{');
    for (size_t i = 0; i < layout->field_count; ++i) {
        if (framed_is_shared(layout, &layout->fields[i])) {
            message_write_field(testee, &layout->fields[i]);
        }
    }
    json_close(&testee->writer, '}');
}

/* Write the header parameters of an undocumented message; its packet is written as data. */
static void write_parameters(struct testee *testee, const uint8_t *frame)
{
    static const char *const names[] = {"param1", "param2"};
    json_key(&testee->writer, "fields");
    json_open(&testee->writer, '{');
    for (size_t i = 0; i < 2 && !has_packet(frame); ++i) {
        if (frame[2 + i] != 0) {
            json_key(&testee->writer, names[i]);
            json_put_unsigned(&testee->writer, frame[2 + i]);
        }
    }
    json_close(&testee->writer, '}');
}

static void write_reading(
    struct testee *testee, const struct reading *reading, const uint8_t *frame, size_t size)
{
    struct json_writer *const writer = &testee->writer;
    json_key(writer, "message");
    json_put_string(writer, reading->message);
    json_key(writer, "form");
    json_put_string(writer, reading->form);
    json_key(writer, "dest");
    json_put_unsigned(writer, reading->envelope.dest);
    json_key(writer, "source");
    json_put_unsigned(writer, reading->envelope.source);
    if (reading->layout == NULL) {
        write_parameters(testee, frame);
    } else if (is_undecided(reading)) {
        write_shared(testee, reading->layout);
    } else {
        message_write(testee, reading->layout);
    }
    if (reading->layout == NULL && !has_packet(frame)) {
        json_key(writer, "data");
        json_put_word(writer, "null");
    } else if (reading->layout == NULL || is_undecided(reading)) {
        json_key(writer, "data");
        json_put_hex(writer, &frame[FRAMED_HEADER], size - FRAMED_HEADER);
    } else if (reading->envelope.extra_size != 0) {
        json_key(writer, "extra");
        json_put_hex(writer, reading->envelope.extra, reading->envelope.extra_size);
    }
}

static void decode(struct testee *testee)
{
    struct reading reading;
    size_t size = 0;
    if (!framed_check_context(testee)) {
        return;
    }
    const uint8_t *const frame = json_bytes(testee_get(testee, "hex"), &size);
    if (!testee_passes(testee, read_frame(testee, frame, size, &reading), NULL)) {
        return;
    }
    testee_accept(testee);
    write_reading(testee, &reading, frame, size);
}

static bool put_frame(
    struct testee_events *events, const char *name, const struct testee_bytes *frame)
{
    struct reading reading;
    if (read_frame(events->testee, frame->bytes, frame->size, &reading) != STAGEWIRE_OK) {
        return false;
    }
    testee_open_event(events, name);
    write_reading(events->testee, &reading, frame->bytes, frame->size);
    json_close(&events->testee->writer, '}');
    return true;
}

static void stream(struct testee *testee)
{
    if (!framed_check_context(testee)) {
        return;
    }
    testee_protocol.framed->begin(testee_end_of(testee));
    testee_stream(testee, &testee_protocol.framed->parser, put_frame);
}

const struct testee_codec framed_codec = {decode, framed_encode, stream};

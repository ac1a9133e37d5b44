/**
 * @file
 * Encoding of frames with a header.
 */
#include "testing/testee/framed.h"

#include "testing/testee/message.h"

#include <string.h>

static void put_16(uint8_t *bytes, size_t value)
{
    bytes[0] = (uint8_t)(value & 0xFF);
    bytes[1] = (uint8_t)(value >> 8);
}

/* A frame under construction. */
struct draft {
    struct stagewire_envelope envelope;
    uint8_t bytes[FRAMED_HEADER + FRAMED_ROOM];
    size_t size;
};

/* The bytes under a key of the request; none if the key is missing. */
static const uint8_t *bytes_under(const struct testee *testee, const char *key, size_t *size)
{
    const struct json_value *const hex = testee_given(testee, key);
    *size = 0;
    return hex == NULL ? NULL : json_bytes(hex, size);
}

/* Encode the message with its layout, and the addresses and extra bytes of the draft. */
static bool encode_layout(
    struct testee *testee, const struct stagewire_layout *layout, struct draft *draft)
{
    enum stagewire_verdict verdict = layout->encode(
        testee->message, &draft->envelope, draft->bytes, sizeof draft->bytes, &draft->size, true);
    if (verdict == STAGEWIRE_BAD_LENGTH) {
        verdict = STAGEWIRE_BAD_VALUE; /* extra bytes, but no packet */
    }
    return testee_passes(testee, verdict, testee_get(testee, "message"));
}

/* Read receiver and sender of the frame. The encoder of the layout checks the receiver. */
static bool read_addresses(
    struct testee *testee, const struct stagewire_layout *layout, struct draft *draft)
{
    if (testee_get(testee, "dest") == NULL || testee_get(testee, "source") == NULL) {
        return testee_refuse(testee, TESTEE_MISSING_FIELD, "dest and source are required", NULL);
    }
    if (!message_read_byte(testee, "dest", &draft->envelope.dest)) {
        return false;
    }
    if (layout != NULL && !encode_layout(testee, layout, draft)) {
        return false;
    }
    if (layout == NULL && draft->envelope.dest > FRAMED_HIGHEST_ADDRESS) {
        return testee_passes(testee, STAGEWIRE_OUT_OF_RANGE, testee_get(testee, "dest"));
    }
    return message_read_byte(testee, "source", &draft->envelope.source);
}

static bool encode_message(
    struct testee *testee, const struct stagewire_layout *layout, struct draft *draft)
{
    /* The first error is reported, in the order of fields, receiver, sender, extra bytes. */
    if (!message_read(testee, layout) || !encode_layout(testee, layout, draft)
        || !read_addresses(testee, layout, draft)) {
        return false;
    }
    draft->envelope.extra = bytes_under(testee, "extra", &draft->envelope.extra_size);
    return encode_layout(testee, layout, draft);
}

/* Append bytes to the packet of a frame without a layout. */
static bool append(struct testee *testee, const uint8_t *bytes, size_t size, struct draft *draft)
{
    if (size > FRAMED_HEADER + FRAMED_LONGEST_PACKET - draft->size) {
        return testee_passes(testee, STAGEWIRE_NO_SPACE, testee_get(testee, "message"));
    }
    if (size != 0) {
        memcpy(&draft->bytes[draft->size], bytes, size);
        draft->size += size;
        put_16(&draft->bytes[2], draft->size - FRAMED_HEADER);
    }
    return true;
}

/* Begin a frame without a layout; parameters are the header's, or the length of a packet. */
static void begin_frame(struct draft *draft, uint16_t id, uint16_t parameters, bool has_packet)
{
    put_16(draft->bytes, id);
    put_16(&draft->bytes[2], parameters);
    draft->bytes[4] = (uint8_t)(draft->envelope.dest | (has_packet ? FRAMED_DATA_FLAG : 0U));
    draft->bytes[5] = draft->envelope.source;
    draft->size = FRAMED_HEADER;
}

/* Refuse fields that contradict the packet in the draft: encoding them changes it. */
static bool check_shared(
    struct testee *testee, const struct stagewire_layout *layout, const struct draft *draft)
{
    const struct json_value *const fields = testee_object(testee, "fields");
    uint8_t frame[FRAMED_HEADER + FRAMED_LONGEST_PACKET];
    size_t size = 0;
    enum stagewire_verdict verdict =
        layout->decode(draft->bytes, draft->size, testee->message, NULL);
    for (const struct json_value *at = json_first(fields); at != json_next(fields);
         at = json_next(at + 1)) {
        if (verdict == STAGEWIRE_OK) {
            verdict = message_set(message_field(layout, at), at + 1, testee->message);
        }
    }
    if (verdict == STAGEWIRE_OK) {
        verdict =
            layout->encode(testee->message, &draft->envelope, frame, sizeof frame, &size, false);
    }
    if (verdict != STAGEWIRE_OK || size != draft->size
        || memcmp(&frame[FRAMED_HEADER], &draft->bytes[FRAMED_HEADER], layout->length) != 0) {
        return testee_refuse(
            testee, TESTEE_BAD_VALUE, "a field contradicts data", NULL);
    }
    return true;
}

/* Make a message with an unknown layout from its packet; layout is any of the candidates. */
static bool encode_undecided(
    struct testee *testee, const struct stagewire_layout *layout, struct draft *draft)
{
    const struct json_value *const fields = testee_object(testee, "fields");
    const size_t length = layout->length;
    size_t size = 0;
    size_t extra_size = 0;
    const uint8_t *const data = bytes_under(testee, "data", &size);
    const uint8_t *const extra = bytes_under(testee, "extra", &extra_size);
    if (data != NULL && size < length) {
        return testee_refuse(
            testee, TESTEE_BAD_LENGTH, "data is shorter than the packet", NULL);
    }
    for (const struct json_value *at = json_first(fields); at != json_next(fields);
         at = json_next(at + 1)) {
        const struct stagewire_field *const field = message_field(layout, at);
        if (field == NULL || !framed_is_shared(layout, field)) {
            return testee_refuse(
                testee, TESTEE_UNKNOWN_FIELD, "not all layouts have this field", at);
        }
    }
    if (data == NULL) {
        return testee_refuse(testee, TESTEE_MISSING_FIELD,
            "data is required if there is no context", NULL);
    }
    begin_frame(draft, layout->id, layout->length, true);
    if (!append(testee, data, length, draft) || !check_shared(testee, layout, draft)
        || !read_addresses(testee, NULL, draft)) {
        return false;
    }
    begin_frame(draft, layout->id, layout->length, true);
    return append(testee, data, size, draft) && append(testee, extra, extra_size, draft);
}

/* Read a parameter of the header of an undocumented message. */
static bool read_parameter(struct testee *testee, const char *name, uint8_t *parameter, bool *given)
{
    const struct stagewire_field field = {
        .name = name, .size = sizeof *parameter, .kind = STAGEWIRE_UNSIGNED};
    const struct json_value *const value = json_get(testee_object(testee, "fields"), name);
    *given = value == NULL ? testee_get(testee, "data") != NULL : value->kind != JSON_NULL;
    return value == NULL || value->kind == JSON_NULL
        || testee_passes(testee, message_set(&field, value, parameter), value);
}

/* Make a message without a layout from its packet, or from the parameters of its header. */
static bool encode_undocumented(struct testee *testee, uint16_t id, struct draft *draft)
{
    const struct json_value *const fields = testee_object(testee, "fields");
    uint8_t parameters[2] = {0, 0};
    bool given[2] = {false, false};
    size_t size = 0;
    size_t extra_size = 0;
    const uint8_t *const data = bytes_under(testee, "data", &size);
    (void)bytes_under(testee, "extra", &extra_size);
    if (extra_size != 0) {
        return testee_refuse(
            testee, TESTEE_BAD_VALUE, "a message without a layout has no extra bytes", NULL);
    }
    if (data != NULL && json_first(fields) != json_next(fields)) {
        return testee_refuse(
            testee, TESTEE_BAD_VALUE, "give data or parameters, not both", NULL);
    }
    for (const struct json_value *at = json_first(fields); at != json_next(fields);
         at = json_next(at + 1)) {
        if (!json_is(at, "param1") && !json_is(at, "param2")) {
            return testee_refuse(
                testee, TESTEE_UNKNOWN_FIELD, "without a layout: param1 and param2, or data", at);
        }
    }
    if (size > FRAMED_LONGEST_PACKET) {
        return testee_passes(testee, STAGEWIRE_NO_SPACE, NULL);
    }
    if (!read_parameter(testee, "param1", &parameters[0], &given[0])
        || !read_parameter(testee, "param2", &parameters[1], &given[1])) {
        return false;
    }
    if (data == NULL && !given[0] && !given[1]) {
        return testee_refuse(testee, TESTEE_UNSUPPORTED,
            "the layout is not documented; give data", NULL);
    }
    if (!read_addresses(testee, NULL, draft)) {
        return false;
    }
    begin_frame(draft, id, framed_get_16(parameters), data != NULL);
    return data == NULL || append(testee, data, size, draft);
}

/* The layout that the message, the form and the context of a request select. */
struct choice {
    const struct stagewire_layout *layout; /* the selected layout, or NULL */
    const struct stagewire_layout *undecided; /* a layout that depends on a context, or NULL */
    const struct stagewire_layout *plain; /* the plain form, chosen between packets, or NULL */
    size_t layouts; /* number of layouts of the message in all forms */
    bool contradicts; /* whether form and context contradict each other */
};

static struct choice choose(const struct testee *testee)
{
    const struct json_value *const message = testee_get(testee, "message");
    const struct json_value *const form = testee_get(testee, "form");
    const struct json_value *const context = testee_object(testee, "context");
    struct choice choice = {NULL, NULL, NULL, 0, false};
    bool decided = false;
    bool has_header = false;
    for (const struct stagewire_layout *layout = testee_protocol.layouts;
         layout != testee_layouts_end(); ++layout) {
        if (!json_is(message, layout->message)) {
            continue;
        }
        ++choice.layouts;
        if (layout->contexts != NULL && choice.undecided == NULL) {
            choice.undecided = layout;
        }
        if (strcmp(layout->form, "data") == 0) {
            choice.plain = layout;
        }
        has_header = has_header || strcmp(layout->form, "header") == 0;
        if (form != NULL ? json_is(form, layout->form) : !decided) {
            choice.layout = layout;
            decided = framed_agrees(layout, context);
            choice.contradicts = form != NULL && framed_contradicts(layout, context);
        }
    }
    if (form == NULL && !decided && choice.layouts > 1) {
        choice.layout = has_header ? NULL : choice.plain;
    }
    return choice;
}

/* Find the id of a message without a layout; false if there is no such message. */
static bool find_undocumented(const struct json_value *message, uint16_t *id)
{
    size_t position = 0;
    while (testee_protocol.framed->id_at(position, id)) {
        const char *const name = testee_protocol.framed->name(*id);
        if (name != NULL && json_is(message, name)) {
            return true;
        }
        ++position;
    }
    return false;
}

static bool is_nameless(const struct json_value *message)
{
    for (const char *const *name = testee_protocol.framed->nameless; *name != NULL; ++name) {
        if (json_is(message, *name)) {
            return true;
        }
    }
    return false;
}

static bool refuse_form(struct testee *testee)
{
    return testee_refuse(testee, TESTEE_BAD_LENGTH, "the form is missing or unknown",
        testee_get(testee, "form"));
}

static bool encode_without_layout(struct testee *testee, struct draft *draft)
{
    const struct json_value *const message = testee_get(testee, "message");
    const struct json_value *const form = testee_get(testee, "form");
    uint16_t id = 0;
    if (find_undocumented(message, &id)) {
        return form == NULL || json_is(form, framed_undocumented)
            ? encode_undocumented(testee, id, draft)
            : refuse_form(testee);
    }
    if (is_nameless(message)) {
        return testee_refuse(
            testee, TESTEE_UNSUPPORTED, "the document gives the message no id", message);
    }
    return testee_refuse(testee, TESTEE_UNKNOWN_MESSAGE, "unknown message", message);
}

static bool encode_frame(struct testee *testee, struct draft *draft)
{
    const struct json_value *const form = testee_get(testee, "form");
    if (!framed_check_context(testee)) {
        return false;
    }
    const struct choice choice = choose(testee);
    if (choice.layouts == 0) {
        return encode_without_layout(testee, draft);
    }
    if (choice.contradicts) {
        return testee_refuse(testee, TESTEE_BAD_VALUE, "the form contradicts the context", form);
    }
    if (choice.layout != NULL) {
        return encode_message(testee, choice.layout, draft);
    }
    if (choice.undecided != NULL && form != NULL && json_is(form, framed_undecided)) {
        return encode_undecided(testee, choice.undecided, draft);
    }
    return refuse_form(testee);
}

void framed_encode(struct testee *testee)
{
    struct draft draft;
    memset(&draft, 0, sizeof draft);
    if (encode_frame(testee, &draft)) {
        testee_answer_bytes(testee, draft.bytes, draft.size);
    }
}

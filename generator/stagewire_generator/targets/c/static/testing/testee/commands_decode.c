/**
 * @file
 * Decoding of commands and replies, and their streams.
 */
#include "testing/testee/commands.h"

#include "testing/testee/message.h"

#include <string.h>

static const struct stagewire_layout *layout_of(const char *message, const char *form)
{
    const struct stagewire_layout *layout = testee_protocol.layouts;
    while (layout != testee_layouts_end()
        && (strcmp(layout->message, message) != 0 || strcmp(layout->form, form) != 0)) {
        ++layout;
    }
    return layout == testee_layouts_end() ? NULL : layout;
}

static bool is_setup(const struct stagewire_layout *layout)
{
    return strcmp(layout->kind, "setup") == 0;
}

static const char *form_of(const struct stagewire_envelope *envelope)
{
    if (envelope->size_slot == STAGEWIRE_SLOT_GIVEN) {
        return "request:with_size";
    }
    return envelope->size_slot == STAGEWIRE_SLOT_LEFT_OUT ? "request:without_size" : "request";
}

static void write_message(struct testee *testee, const struct stagewire_layout *layout,
    const struct stagewire_envelope *envelope)
{
    struct json_writer *const writer = &testee->writer;
    const bool is_reply = strcmp(layout->form, "reply") == 0;
    json_key(writer, "message");
    json_put_string(writer, layout->message);
    json_key(writer, "kind");
    json_put_string(writer, layout->kind);
    json_key(writer, "form");
    json_put_string(writer, is_reply ? layout->form : form_of(envelope));
    if (!is_reply && !is_setup(layout)) {
        json_key(writer, "axis");
        json_put_unsigned(writer, envelope->axis);
    }
    message_write(testee, layout);
    if (envelope->extra_size != 0) {
        json_key(writer, "extra");
        json_put_hex(writer, envelope->extra, envelope->extra_size);
    }
}

/* Read a command into the message of the testee; the package identifies it. */
static enum stagewire_verdict read_command(struct testee *testee, const struct testee_bytes *bytes,
    const struct stagewire_layout **layout, struct stagewire_envelope *envelope)
{
    const char *name = NULL;
    const enum stagewire_verdict verdict = testee_protocol.commands->identify(bytes, &name);
    if (verdict != STAGEWIRE_OK) {
        return verdict;
    }
    *layout = layout_of(name, "request");
    return (*layout)->decode(bytes->bytes, bytes->size, testee->message, envelope);
}

/* Find the reply to the command that the request names. */
static bool find_reply(struct testee *testee, const struct stagewire_layout **reply)
{
    const struct json_value *const command = testee_get(testee, "command");
    if (message_layout(command, "request") == NULL) {
        return testee_refuse(testee, TESTEE_UNKNOWN_MESSAGE, "unknown command", command);
    }
    *reply = message_layout(command, "reply");
    return *reply != NULL
        || testee_refuse(testee, TESTEE_BAD_LENGTH, "the command has no reply", command);
}

static void decode(struct testee *testee)
{
    const struct stagewire_layout *layout = NULL;
    struct stagewire_envelope envelope;
    struct testee_bytes bytes;
    enum stagewire_verdict verdict = STAGEWIRE_OK;
    const enum command_direction direction = command_direction_of(testee);
    const bool has_command = testee_get(testee, "command") != NULL;
    if (direction == COMMANDS_WRONG_DIRECTION) {
        return;
    }
    if (has_command != (direction == COMMANDS_REPLY)) {
        (void)testee_refuse(testee, TESTEE_BAD_REQUEST,
            "command is required for the direction reply, and not allowed otherwise", NULL);
        return;
    }
    memset(&envelope, 0, sizeof envelope);
    bytes.bytes = json_bytes(testee_get(testee, "hex"), &bytes.size);
    if (direction == COMMANDS_COMMAND) {
        verdict = read_command(testee, &bytes, &layout, &envelope);
    } else if (find_reply(testee, &layout)) {
        verdict = layout->decode(bytes.bytes, bytes.size, testee->message, &envelope);
    } else {
        return;
    }
    if (testee_passes(testee, verdict, NULL)) {
        testee_accept(testee);
        write_message(testee, layout, &envelope);
    }
}

static bool put_command(
    struct testee_events *events, const char *name, const struct testee_bytes *command)
{
    const struct stagewire_layout *layout = NULL;
    struct stagewire_envelope envelope;
    if (read_command(events->testee, command, &layout, &envelope) != STAGEWIRE_OK) {
        return false;
    }
    testee_open_event(events, name);
    write_message(events->testee, layout, &envelope);
    json_close(&events->testee->writer, '}');
    return true;
}

static bool put_reply(
    struct testee_events *events, const char *name, const struct testee_bytes *reply)
{
    const struct stagewire_layout *const layout =
        message_layout(testee_get(events->testee, "command"), "reply");
    struct stagewire_envelope envelope;
    if (layout == NULL
        || layout->decode(reply->bytes, reply->size, events->testee->message, &envelope)
            != STAGEWIRE_OK) {
        return false;
    }
    testee_open_event(events, name);
    write_message(events->testee, layout, &envelope);
    json_close(&events->testee->writer, '}');
    return true;
}

/* Send the command that the request names. Its data and its axis do not matter. */
static bool ask(struct testee *testee)
{
    const struct json_value *const command = testee_get(testee, "command");
    const struct stagewire_layout *const layout = message_layout(command, "request");
    const struct stagewire_envelope envelope = {.axis = testee_protocol.commands->axis};
    uint8_t bytes[COMMANDS_LONGEST];
    struct testee_bytes sent = {bytes, 0};
    if (layout == NULL) {
        return testee_refuse(testee, TESTEE_UNKNOWN_MESSAGE, "unknown command", command);
    }
    memset(testee->message, 0, layout->struct_size);
    const enum stagewire_verdict verdict =
        layout->encode(testee->message, &envelope, bytes, sizeof bytes, &sent.size, false);
    if (!testee_passes(testee, verdict, command)) {
        return false;
    }
    testee_protocol.commands->ask(&sent);
    return true;
}

static void stream(struct testee *testee)
{
    const bool at_host = testee_end_of(testee) == TESTEE_END_HOST;
    if (at_host != (testee_get(testee, "command") != NULL)) {
        (void)testee_refuse(testee, TESTEE_BAD_REQUEST,
            "command is required for the end host, and not allowed otherwise", NULL);
    } else if (!at_host) {
        testee_protocol.commands->begin();
        testee_stream(testee, &testee_protocol.commands->parser, put_command);
    } else if (ask(testee)) {
        testee_stream(testee, &testee_protocol.commands->replies, put_reply);
    }
}

const struct testee_codec command_codec = {decode, command_encode, stream};

/**
 * @file
 * Encoding of commands and replies.
 */
#include "testing/testee/commands.h"

#include "testing/testee/message.h"

#include <string.h>

static const struct {
    const char *form;
    enum stagewire_size_slot size_slot;
} forms[] = {
    {"request", STAGEWIRE_SLOT_AS_PRINTED},
    {"request:with_size", STAGEWIRE_SLOT_GIVEN},
    {"request:without_size", STAGEWIRE_SLOT_LEFT_OUT},
};

enum command_direction command_direction_of(struct testee *testee)
{
    const struct json_value *const direction = testee_get(testee, "direction");
    if (direction == NULL || json_is(direction, "command")) {
        return COMMANDS_COMMAND;
    }
    if (json_is(direction, "reply")) {
        return COMMANDS_REPLY;
    }
    (void)testee_refuse(
        testee, TESTEE_BAD_REQUEST, "direction must be command or reply", direction);
    return COMMANDS_WRONG_DIRECTION;
}

/* Find out whether the request is for a reply; form and direction must agree if both are given. */
static bool find_direction(struct testee *testee, bool *is_reply)
{
    const struct json_value *const form = testee_get(testee, "form");
    const enum command_direction direction = command_direction_of(testee);
    if (direction == COMMANDS_WRONG_DIRECTION) {
        return false;
    }
    *is_reply = form == NULL ? direction == COMMANDS_REPLY : json_is(form, "reply");
    return testee_get(testee, "direction") == NULL || *is_reply == (direction == COMMANDS_REPLY)
        || testee_refuse(
            testee, TESTEE_BAD_VALUE, "form and direction contradict each other", form);
}

/* Find the size slot of a form; false if the command has no such form. A command with data needs
 * the
   slot. The form that the document prints is always called "request". */
static bool find_size_slot(
    const struct stagewire_layout *layout, const struct json_value *form, uint8_t *size_slot)
{
    const bool is_printed = layout->message_size > COMMANDS_SLOTS;
    for (size_t i = 0; form != NULL && i < sizeof forms / sizeof *forms; ++i) {
        if (json_is(form, forms[i].form)) {
            *size_slot = (uint8_t)forms[i].size_slot;
        }
    }
    if (form == NULL || *size_slot == STAGEWIRE_SLOT_AS_PRINTED) {
        return form == NULL || json_is(form, forms[0].form);
    }
    return strcmp(layout->kind, "command") == 0 && layout->length == 0
        && is_printed == (*size_slot == STAGEWIRE_SLOT_LEFT_OUT);
}

/* Find the layout for the message, form and kind of the request. */
static bool find_layout(struct testee *testee, bool is_reply,
    const struct stagewire_layout **layout, uint8_t *size_slot)
{
    const struct json_value *const message = testee_get(testee, "message");
    const struct json_value *const kind = testee_get(testee, "kind");
    const struct stagewire_layout *const request = message_layout(message, "request");
    *layout = is_reply ? message_layout(message, "reply") : request;
    if (request == NULL) {
        return testee_refuse(testee, TESTEE_UNKNOWN_MESSAGE, "unknown command", message);
    }
    if (*layout == NULL
        || (!is_reply && !find_size_slot(request, testee_get(testee, "form"), size_slot))) {
        return testee_refuse(
            testee, TESTEE_BAD_LENGTH, "the command has no such form", testee_get(testee, "form"));
    }
    return kind == NULL || json_is(kind, request->kind)
        || testee_refuse(testee, TESTEE_BAD_VALUE, "the command has another kind", kind);
}

/* Refuse a key that only commands have; null, false and empty bytes are accepted. */
static bool check_absent(struct testee *testee, const char *key)
{
    const struct json_value *const value = testee_given(testee, key);
    return value == NULL || value->kind == JSON_FALSE || json_is(value, "")
        || testee_refuse(testee, TESTEE_BAD_VALUE, key, NULL);
}

/* A command or a reply under construction. */
struct draft {
    const struct stagewire_layout *layout;
    struct stagewire_envelope envelope;
    uint8_t bytes[COMMANDS_LONGEST];
    size_t size;
};

static enum stagewire_verdict encode_draft(struct testee *testee, struct draft *draft, bool checked)
{
    return draft->layout->encode(testee->message, &draft->envelope, draft->bytes,
        sizeof draft->bytes, &draft->size, checked);
}

static bool encode_reply(struct testee *testee, struct draft *draft)
{
    return message_read(testee, draft->layout)
        && testee_passes(testee, encode_draft(testee, draft, true), testee_get(testee, "message"))
        && check_absent(testee, "axis") && check_absent(testee, "extra")
        && check_absent(testee, "allow_dummy") && check_absent(testee, "refuse_prefix_bytes");
}

static bool encode_setup(struct testee *testee, struct draft *draft)
{
    if (!message_read(testee, draft->layout) || !check_absent(testee, "allow_dummy")
        || !check_absent(testee, "refuse_prefix_bytes") || !check_absent(testee, "extra")) {
        return false;
    }
    if (testee_given(testee, "axis") != NULL) {
        return testee_refuse(testee, TESTEE_BAD_VALUE, "a setup command has no axis", NULL);
    }
    return testee_passes(testee, encode_draft(testee, draft, true), testee_get(testee, "message"));
}

/* Encode the draft. That a command is a dummy is reported only if all other values are right. */
static bool try_command(struct testee *testee, struct draft *draft, bool *dummy)
{
    enum stagewire_verdict verdict = encode_draft(testee, draft, true);
    *dummy = verdict == STAGEWIRE_UNSUPPORTED;
    if (*dummy) {
        verdict = encode_draft(testee, draft, false);
    }
    if (verdict == STAGEWIRE_BAD_LENGTH && draft->envelope.extra_size != 0) {
        verdict = STAGEWIRE_BAD_VALUE; /* extra bytes with a terminator, or without a size slot */
    }
    return testee_passes(testee, verdict, testee_get(testee, "message"));
}

static bool encode_command(struct testee *testee, struct draft *draft)
{
    const struct json_value *const message = testee_get(testee, "message");
    const struct json_value *const extra = testee_get(testee, "extra");
    bool dummy = false;
    draft->envelope.axis = testee_protocol.commands->axis;
    /* The first error is reported, in the order of fields, axis, extra bytes. */
    if (!message_read(testee, draft->layout) || !try_command(testee, draft, &dummy)
        || !message_read_byte(testee, "axis", &draft->envelope.axis)
        || !try_command(testee, draft, &dummy)) {
        return false;
    }
    if (extra != NULL) {
        draft->envelope.extra = json_bytes(extra, &draft->envelope.extra_size);
    }
    if (!try_command(testee, draft, &dummy)) {
        return false;
    }
    if (dummy && !testee_is_set(testee, "allow_dummy")) {
        return testee_passes(testee, STAGEWIRE_UNSUPPORTED, message);
    }
    const struct testee_bytes command = {draft->bytes, draft->size};
    if (testee_is_set(testee, "refuse_prefix_bytes")
        && testee_protocol.commands->holds_setup(&command)) {
        return testee_refuse(
            testee, TESTEE_OUT_OF_RANGE, "the command contains a setup command", message);
    }
    return true;
}

void command_encode(struct testee *testee)
{
    struct draft draft;
    bool is_reply = false;
    bool encoded = false;
    memset(&draft, 0, sizeof draft);
    if (!find_direction(testee, &is_reply)
        || !find_layout(testee, is_reply, &draft.layout, &draft.envelope.size_slot)) {
        return;
    }
    if (is_reply) {
        encoded = encode_reply(testee, &draft);
    } else if (strcmp(draft.layout->kind, "setup") == 0) {
        encoded = encode_setup(testee, &draft);
    } else {
        encoded = encode_command(testee, &draft);
    }
    if (encoded) {
        testee_answer_bytes(testee, draft.bytes, draft.size);
    }
}

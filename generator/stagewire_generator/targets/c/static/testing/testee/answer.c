/**
 * @file
 * Access to requests, and answers to them.
 */
#include "testing/testee/testee.h"

#include <string.h>

enum { SHOWN = 60 }; /* bytes of a value shown in an error */

static const char *const refusals[] = {
    [TESTEE_TRUNCATED] = "truncated",
    [TESTEE_TRAILING] = "trailing",
    [TESTEE_BAD_LENGTH] = "bad_length",
    [TESTEE_UNKNOWN_MESSAGE] = "unknown_message",
    [TESTEE_UNKNOWN_FIELD] = "unknown_field",
    [TESTEE_MISSING_FIELD] = "missing_field",
    [TESTEE_OUT_OF_RANGE] = "out_of_range",
    [TESTEE_BAD_VALUE] = "bad_value",
    [TESTEE_BAD_REQUEST] = "bad_request",
    [TESTEE_UNSUPPORTED] = "unsupported",
};

static const struct {
    enum testee_refusal refusal;
    const char *text;
} verdicts[] = {
    [STAGEWIRE_TRUNCATED] = {TESTEE_TRUNCATED, "the message is incomplete"},
    [STAGEWIRE_TRAILING] = {TESTEE_TRAILING, "bytes follow the message"},
    [STAGEWIRE_BAD_LENGTH] = {TESTEE_BAD_LENGTH, "the message has no form of this length"},
    [STAGEWIRE_UNKNOWN_MESSAGE] = {TESTEE_UNKNOWN_MESSAGE, "unknown message id"},
    [STAGEWIRE_OUT_OF_RANGE] = {TESTEE_OUT_OF_RANGE, "a value is out of range"},
    [STAGEWIRE_BAD_VALUE] = {TESTEE_BAD_VALUE, "a value has the wrong type"},
    [STAGEWIRE_NO_SPACE] = {TESTEE_OUT_OF_RANGE, "the message is too long"},
    [STAGEWIRE_UNSUPPORTED] = {TESTEE_UNSUPPORTED, "the document says not to use this command"},
};

const struct stagewire_layout *testee_layouts_end(void)
{
    return testee_protocol.layouts + testee_protocol.layout_count;
}

const struct json_value *testee_get(const struct testee *testee, const char *key)
{
    return json_get(testee->request, key);
}

const struct json_value *testee_given(const struct testee *testee, const char *key)
{
    const struct json_value *const value = testee_get(testee, key);
    return value == NULL || value->kind == JSON_NULL ? NULL : value;
}

const struct json_value *testee_object(const struct testee *testee, const char *key)
{
    static const struct json_value empty = {JSON_OBJECT, 1, NULL, 0};
    const struct json_value *const value = testee_get(testee, key);
    return value == NULL ? &empty : value;
}

bool testee_is_set(const struct testee *testee, const char *key)
{
    const struct json_value *const value = testee_get(testee, key);
    return value != NULL && value->kind == JSON_TRUE;
}

static void open_answer(struct testee *testee, const char *ok)
{
    struct json_writer *const writer = &testee->writer;
    json_open(writer, '{');
    json_key(writer, "id");
    if (testee->id == NULL) {
        json_put_word(writer, "null");
    } else {
        json_put_value(writer, testee->id);
    }
    json_key(writer, "ok");
    json_put_word(writer, ok);
}

bool testee_refuse(struct testee *testee, enum testee_refusal refusal, const char *text,
    const struct json_value *about)
{
    struct json_writer *const writer = &testee->writer;
    open_answer(testee, "false");
    json_key(writer, "error");
    json_put_string(writer, refusals[refusal]);
    json_key(writer, "detail");
    json_open_text(writer);
    json_put_utf_8_piece(writer, text, strlen(text));
    if (about != NULL && about->size > 0) {
        json_put_utf_8_piece(writer, ": ", 2);
        json_put_utf_8_piece(writer, about->text, about->size < SHOWN ? about->size : SHOWN);
    }
    json_close_text(writer);
    return false;
}

bool testee_passes(
    struct testee *testee, enum stagewire_verdict verdict, const struct json_value *about)
{
    return verdict == STAGEWIRE_OK
        || testee_refuse(testee, verdicts[verdict].refusal, verdicts[verdict].text, about);
}

void testee_accept(struct testee *testee)
{
    open_answer(testee, "true");
}

void testee_answer_bytes(struct testee *testee, const uint8_t *bytes, size_t size)
{
    testee_accept(testee);
    json_key(&testee->writer, "hex");
    json_put_hex(&testee->writer, bytes, size);
}

/**
 * @file
 * The main program of the testee: reads requests line by line and answers them.
 */
#include "testing/testee/testee.h"

#include "testing/testee/request.h"

#include <stdlib.h>

#ifndef STAGEWIRE_VERSION
/** Version that the testee reports; set it in the build. */
#define STAGEWIRE_VERSION "unversioned"
#endif

enum { MAXIMUM_LINE = 16 * 1024 * 1024 }; /* bytes, including the line end */

struct line {
    char *text;
    size_t size;
    size_t room;
    bool too_long;
};

static bool add_to_line(struct line *line, char character)
{
    if (line->size == line->room) {
        const size_t room = line->room * 2 + 256;
        char *const text = realloc(line->text, room);
        if (text == NULL) {
            return false;
        }
        line->text = text;
        line->room = room;
    }
    line->text[line->size++] = character;
    return true;
}

/* Read the next line with its end. The rest of a line that is too long is dropped. */
static bool read_line(struct line *line)
{
    int character = getc(stdin);
    line->size = 0;
    line->too_long = false;
    if (character == EOF) {
        return false;
    }
    for (; character != EOF; character = getc(stdin)) {
        line->too_long =
            line->too_long || line->size == MAXIMUM_LINE || !add_to_line(line, (char)character);
        if (character == '\n') {
            break;
        }
    }
    return true;
}

static void hello(struct testee *testee)
{
    struct json_writer *const writer = &testee->writer;
    testee_accept(testee);
    json_key(writer, "testee");
    json_put_integer(writer, 1);
    json_key(writer, "implementation");
    json_put_string(writer, "stagewire-c");
    json_key(writer, "version");
    json_put_string(writer, STAGEWIRE_VERSION);
    json_key(writer, "protocols");
    json_open(writer, '[');
    json_put_string(writer, testee_protocol.name);
    json_close(writer, ']');
    json_key(writer, "operations");
    json_open(writer, '[');
    for (size_t i = 0; i < OPERATIONS; ++i) {
        json_put_string(writer, operation_names[i].name);
    }
    json_close(writer, ']');
}

static void answer_request(struct testee *testee)
{
    enum operation operation = HELLO;
    if (!check_request(testee, &operation)) {
        return;
    }
    switch (operation) {
    case DECODE:
        testee_protocol.codec->decode(testee);
        break;
    case ENCODE:
        testee_protocol.codec->encode(testee);
        break;
    case STREAM:
        testee_protocol.codec->stream(testee);
        break;
    case HELLO:
    default:
        hello(testee);
        break;
    }
}

static void answer_line(struct testee *testee, struct json *json, const struct line *line)
{
    testee->id = NULL;
    testee->request = NULL;
    if (line->too_long) {
        (void)testee_refuse(testee, TESTEE_BAD_REQUEST, "the line is too long", NULL);
        return;
    }
    if (!json_read(json, line->text, line->size)) {
        (void)testee_refuse(testee, TESTEE_BAD_REQUEST, json->problem, NULL);
        return;
    }
    testee->request = json->values;
    const struct json_value *const id = testee_get(testee, "id");
    if (testee->request->kind != JSON_OBJECT) {
        (void)testee_refuse(testee, TESTEE_BAD_REQUEST, "a request must be a JSON object", NULL);
    } else if (id == NULL || (id->kind != JSON_INTEGER && id->kind != JSON_TEXT)) {
        (void)testee_refuse(testee, TESTEE_BAD_REQUEST, "id must be an integer or a string", id);
    } else {
        testee->id = id;
        answer_request(testee);
    }
}

/* Allocate room for the largest C struct of the protocol. */
static void *new_message(void)
{
    size_t size = 1;
    for (size_t i = 0; i < testee_protocol.layout_count; ++i) {
        const size_t needed = testee_protocol.layouts[i].struct_size;
        size = needed > size ? needed : size;
    }
    return malloc(size);
}

int main(void)
{
    struct testee testee = {.writer = {.file = stdout}, .message = new_message()};
    struct json json = {.values = NULL};
    struct line line = {.text = NULL};
    while (testee.message != NULL && !testee.writer.failed && read_line(&line)) {
        answer_line(&testee, &json, &line);
        json_close(&testee.writer, '}');
        json_end_line(&testee.writer);
    }
    const bool served = testee.message != NULL && !testee.writer.failed;
    json_free(&json);
    free(line.text);
    free(testee.message);
    return served ? EXIT_SUCCESS : EXIT_FAILURE;
}

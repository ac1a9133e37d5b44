/**
 * @file
 * JSON writer of the testee: writes value by value, in ASCII.
 */
#ifndef STAGEWIRE_TESTING_TESTEE_JSON_WRITER_H
#define STAGEWIRE_TESTING_TESTEE_JSON_WRITER_H

#include "testing/testee/json.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

/** Writes one JSON text per line and sets the commas. Initialise it with zeros, except file. */
struct json_writer {
    FILE *file;
    bool separate; /**< Whether the next value needs a comma before it. */
    bool failed; /**< Whether a write failed. */
};

void json_open(struct json_writer *writer, char bracket);
void json_close(struct json_writer *writer, char bracket);
void json_key(struct json_writer *writer, const char *key);

void json_put_word(struct json_writer *writer, const char *word); /**< true, false, null */
void json_put_integer(struct json_writer *writer, int64_t value);
void json_put_unsigned(struct json_writer *writer, uint64_t value);
void json_put_string(struct json_writer *writer, const char *text);
void json_put_hex(struct json_writer *writer, const uint8_t *bytes, size_t size);

/** Write a text or an integer as it was read. */
void json_put_value(struct json_writer *writer, const struct json_value *value);

/** Write a text in pieces: open it, put pieces of any kind, close it. */
void json_open_text(struct json_writer *writer);
void json_put_utf_8_piece(struct json_writer *writer, const char *text, size_t size);
void json_put_latin_1_piece(struct json_writer *writer, const uint8_t *text, size_t size);
void json_put_hex_piece(struct json_writer *writer, const uint8_t *bytes, size_t size);
void json_close_text(struct json_writer *writer);

/** End the line and flush it: the client waits for it. */
void json_end_line(struct json_writer *writer);

#endif

/**
 * @file
 * The JSON writer.
 */
#include "testing/testee/json_writer.h"

#include <inttypes.h>
#include <string.h>

static const char hex_digits[] = "0123456789abcdef";

static void put(struct json_writer *writer, char character)
{
    if (putc(character, writer->file) == EOF) {
        writer->failed = true;
    }
}

static void put_plain(struct json_writer *writer, const char *text, size_t size)
{
    if (fwrite(text, 1, size, writer->file) != size) {
        writer->failed = true;
    }
}

static void begin(struct json_writer *writer)
{
    if (writer->separate) {
        put(writer, ',');
    }
    writer->separate = true;
}

/* All characters outside ASCII are escaped, so lone surrogates can be written. */
static void put_character(struct json_writer *writer, uint32_t code)
{
    if (code >= 0x10000) { /* a surrogate pair */
        put_character(writer, 0xD800 + ((code - 0x10000) >> 10));
        put_character(writer, 0xDC00 + ((code - 0x10000) & 0x3FF));
    } else if (code == '"' || code == '\\') {
        put(writer, '\\');
        put(writer, (char)code);
    } else if (code >= 0x20 && code < 0x7F) {
        put(writer, (char)code);
    } else {
        const uint8_t unit[] = {(uint8_t)(code >> 8), (uint8_t)(code & 0xFF)};
        put_plain(writer, "\\u", 2);
        json_put_hex_piece(writer, unit, sizeof unit);
    }
}

void json_open(struct json_writer *writer, char bracket)
{
    begin(writer);
    put(writer, bracket);
    writer->separate = false;
}

void json_close(struct json_writer *writer, char bracket)
{
    put(writer, bracket);
    writer->separate = true;
}

void json_key(struct json_writer *writer, const char *key)
{
    json_put_string(writer, key);
    put(writer, ':');
    writer->separate = false;
}

void json_put_word(struct json_writer *writer, const char *word)
{
    begin(writer);
    put_plain(writer, word, strlen(word));
}

void json_put_integer(struct json_writer *writer, int64_t value)
{
    begin(writer);
    if (fprintf(writer->file, "%" PRId64, value) < 0) {
        writer->failed = true;
    }
}

void json_put_unsigned(struct json_writer *writer, uint64_t value)
{
    begin(writer);
    if (fprintf(writer->file, "%" PRIu64, value) < 0) {
        writer->failed = true;
    }
}

void json_put_string(struct json_writer *writer, const char *text)
{
    json_open_text(writer);
    json_put_utf_8_piece(writer, text, strlen(text));
    json_close_text(writer);
}

void json_put_hex(struct json_writer *writer, const uint8_t *bytes, size_t size)
{
    json_open_text(writer);
    json_put_hex_piece(writer, bytes, size);
    json_close_text(writer);
}

void json_put_value(struct json_writer *writer, const struct json_value *value)
{
    if (value->kind == JSON_TEXT) {
        json_open_text(writer);
        json_put_utf_8_piece(writer, value->text, value->size);
        json_close_text(writer);
        return;
    }
    begin(writer);
    put_plain(writer, value->text, value->size);
}

void json_open_text(struct json_writer *writer)
{
    begin(writer);
    put(writer, '"');
}

/* The text may be cut off: an incomplete character at its end is left out. */
void json_put_utf_8_piece(struct json_writer *writer, const char *text, size_t size)
{
    for (size_t i = 0; i < size;) {
        const unsigned char first = (unsigned char)text[i];
        const size_t length = first < 0xC0 ? 1 : (first < 0xE0 ? 2 : (first < 0xF0 ? 3 : 4));
        if (length > size - i) {
            return;
        }
        uint32_t code = length == 1 ? first : first & (0x7FU >> length);
        for (size_t k = 1; k < length; ++k) {
            code = (code << 6) | ((unsigned char)text[i + k] & 0x3FU);
        }
        put_character(writer, code);
        i += length;
    }
}

void json_put_latin_1_piece(struct json_writer *writer, const uint8_t *text, size_t size)
{
    for (size_t i = 0; i < size; ++i) {
        put_character(writer, text[i]);
    }
}

void json_put_hex_piece(struct json_writer *writer, const uint8_t *bytes, size_t size)
{
    for (size_t i = 0; i < size; ++i) {
        put(writer, hex_digits[bytes[i] >> 4]);
        put(writer, hex_digits[bytes[i] & 15]);
    }
}

void json_close_text(struct json_writer *writer)
{
    put(writer, '"');
}

void json_end_line(struct json_writer *writer)
{
    put(writer, '\n');
    writer->separate = false;
    if (fflush(writer->file) == EOF) {
        writer->failed = true;
    }
}

/**
 * @file
 * The JSON reader.
 */
#include "testing/testee/json.h"

#include "testing/testee/json_text.h"

#include <stdlib.h>
#include <string.h>

struct reader {
    struct json *json;
    char *next;
    char *end;
    uint32_t depth;
    size_t open[JSON_MAXIMUM_DEPTH]; /* positions of the open lists and objects */
};

static bool fail(struct reader *reader, const char *problem)
{
    reader->json->problem = problem;
    return false;
}

static bool is_digit(char character)
{
    return character >= '0' && character <= '9';
}

/* The next character; NUL at the end of the text. */
static char peek(const struct reader *reader)
{
    if (reader->next == reader->end) {
        return '\0';
    }
    return *reader->next;
}

static bool take(struct reader *reader, char wanted)
{
    if (reader->next == reader->end || *reader->next != wanted) {
        return false;
    }
    ++reader->next;
    return true;
}

static void skip_space(struct reader *reader)
{
    while (take(reader, ' ') || take(reader, '\t') || take(reader, '\n') || take(reader, '\r')) {}
}

static bool add(struct reader *reader, enum json_kind kind)
{
    struct json *const json = reader->json;
    if (json->count == json->room) {
        const size_t room = json->room + json->room / 2 + 64;
        struct json_value *const values = realloc(json->values, room * sizeof *values);
        if (values == NULL) {
            return fail(reader, "out of memory");
        }
        json->values = values;
        json->room = room;
    }
    struct json_value *const value = &json->values[json->count++];
    value->kind = kind;
    value->span = 1;
    value->text = reader->next;
    value->size = 0;
    return true;
}

static struct json_value *last(const struct reader *reader)
{
    return &reader->json->values[reader->json->count - 1];
}

static bool is_utf_8(struct reader *reader)
{
    char *const start = reader->next;
    while (reader->next < reader->end) {
        const size_t size = json_character_size(reader->next, (size_t)(reader->end - reader->next));
        if (size == 0) {
            return fail(reader, "not UTF-8");
        }
        reader->next += size;
    }
    reader->next = start;
    return true;
}

static bool read_text(struct reader *reader)
{
    if (!take(reader, '"')) {
        return fail(reader, "expected a string");
    }
    if (!add(reader, JSON_TEXT)) {
        return false;
    }
    char *const text = reader->next;
    char *to = text;
    while (!take(reader, '"')) {
        if (reader->next == reader->end || (unsigned char)*reader->next < 0x20) {
            return fail(reader, "unterminated string or control character");
        }
        if (take(reader, '\\')) {
            const char *const end = json_read_escape(reader->next, reader->end, &to);
            if (end == NULL) {
                return fail(reader, "invalid escape");
            }
            reader->next += end - reader->next;
        } else {
            *to++ = *reader->next++;
        }
    }
    last(reader)->size = (size_t)(to - text);
    return true;
}

static size_t skip_digits(struct reader *reader)
{
    const char *const start = reader->next;
    while (is_digit(peek(reader))) {
        ++reader->next;
    }
    return (size_t)(reader->next - start);
}

static bool read_number(struct reader *reader)
{
    if (!add(reader, JSON_INTEGER)) {
        return false;
    }
    struct json_value *const value = last(reader);
    (void)take(reader, '-');
    const bool zero = peek(reader) == '0';
    const size_t digits = skip_digits(reader);
    if (digits == 0 || (zero && digits > 1)) {
        return fail(reader, "expected a value");
    }
    if (take(reader, '.')) {
        value->kind = JSON_REAL;
        if (skip_digits(reader) == 0) {
            return fail(reader, "expected digits after the decimal point");
        }
    }
    if (take(reader, 'e') || take(reader, 'E')) {
        value->kind = JSON_REAL;
        if (!take(reader, '+')) {
            (void)take(reader, '-');
        }
        if (skip_digits(reader) == 0) {
            return fail(reader, "expected digits in the exponent");
        }
    }
    if (value->kind == JSON_INTEGER && digits > JSON_MAXIMUM_DIGITS) {
        return fail(reader, "integer with too many digits");
    }
    value->size = (size_t)(reader->next - value->text);
    return true;
}

static bool read_word(struct reader *reader)
{
    static const struct {
        const char *word;
        enum json_kind kind;
    } words[] = {
        {"null", JSON_NULL},
        {"false", JSON_FALSE},
        {"true", JSON_TRUE},
    };
    for (size_t i = 0; i < sizeof words / sizeof *words; ++i) {
        const size_t size = strlen(words[i].word);
        if ((size_t)(reader->end - reader->next) >= size
            && memcmp(reader->next, words[i].word, size) == 0) {
            if (!add(reader, words[i].kind)) {
                return false;
            }
            reader->next += size;
            return true;
        }
    }
    return fail(reader, "expected a value");
}

static bool open_holder(struct reader *reader, enum json_kind kind)
{
    if (reader->depth == JSON_MAXIMUM_DEPTH) {
        return fail(reader, "nested too deeply");
    }
    if (!add(reader, kind)) {
        return false;
    }
    reader->open[reader->depth++] = reader->json->count - 1;
    ++reader->next;
    return true;
}

static bool read_value(struct reader *reader, bool *opened)
{
    const char first = peek(reader);
    *opened = first == '[' || first == '{';
    if (*opened) {
        return open_holder(reader, first == '[' ? JSON_LIST : JSON_OBJECT);
    }
    if (first == '"') {
        return read_text(reader);
    }
    return first == '-' || is_digit(first) ? read_number(reader) : read_word(reader);
}

/* The innermost open list or object, or NULL. */
static struct json_value *innermost(const struct reader *reader)
{
    return reader->depth == 0 ? NULL : &reader->json->values[reader->open[reader->depth - 1]];
}

static bool read_key(struct reader *reader)
{
    if (!read_text(reader)) {
        return false;
    }
    skip_space(reader);
    if (!take(reader, ':')) {
        return fail(reader, "expected a colon");
    }
    skip_space(reader);
    return true;
}

struct key {
    const char *text;
    size_t size;
};

/* NOLINTNEXTLINE(bugprone-easily-swappable-parameters): the signature is required by qsort */
static int compare_keys(const void *left, const void *right)
{
    const struct key *const a = left;
    const struct key *const b = right;
    if (a->size != b->size) {
        return a->size < b->size ? -1 : 1;
    }
    return memcmp(a->text, b->text, a->size);
}

/* Refuse duplicate keys. Sorting finds them quickly, even among millions of keys. */
static bool check_keys(struct reader *reader, const struct json_value *object)
{
    const struct json_value *const end = json_next(object);
    struct key *const keys = malloc(object->span * sizeof *keys);
    if (keys == NULL) {
        return fail(reader, "out of memory");
    }
    size_t count = 0;
    for (const struct json_value *key = json_first(object); key != end; key = json_next(key + 1)) {
        keys[count].text = key->text;
        keys[count++].size = key->size;
    }
    qsort(keys, count, sizeof *keys, compare_keys);
    bool once = true;
    for (size_t i = 1; once && i < count; ++i) {
        once = compare_keys(&keys[i - 1], &keys[i]) != 0;
    }
    free(keys);
    return once || fail(reader, "duplicate key in an object");
}

static bool close_holder(struct reader *reader)
{
    struct json_value *const holder = innermost(reader);
    holder->span = (uint32_t)(reader->json->count - reader->open[--reader->depth]);
    ++reader->next;
    return holder->kind != JSON_OBJECT || check_keys(reader, holder);
}

static bool read_all(struct reader *reader)
{
    bool opened = false; /* a list or object was just opened: its end may follow */
    bool after = false; /* a value was just read: a comma or an end must follow */
    do {
        skip_space(reader);
        const struct json_value *const holder = innermost(reader);
        const bool in_object = holder != NULL && holder->kind == JSON_OBJECT;
        if ((opened || after) && peek(reader) == (in_object ? '}' : ']')) {
            if (!close_holder(reader)) {
                return false;
            }
            opened = false;
            after = true;
        } else if (after) {
            if (!take(reader, ',')) {
                return fail(reader, "expected a comma or the end of the list or object");
            }
            after = false;
        } else {
            if ((in_object && !read_key(reader)) || !read_value(reader, &opened)) {
                return false;
            }
            after = !opened;
        }
    } while (reader->depth > 0 || !after);
    skip_space(reader);
    return reader->next == reader->end || fail(reader, "extra text after the value");
}

bool json_read(struct json *json, char *text, size_t size)
{
    struct reader reader;
    reader.json = json;
    reader.next = text;
    reader.end = text + size;
    reader.depth = 0;
    json->count = 0;
    json->problem = NULL;
    if (size > UINT32_MAX) { /* spans have 32 bits */
        return fail(&reader, "too long");
    }
    return is_utf_8(&reader) && read_all(&reader);
}

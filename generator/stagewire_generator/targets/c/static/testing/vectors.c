/**
 * @file vectors.c
 * Runs worked examples and cases with the functions of their layouts.
 */
#include "testing/vectors.h"

/* Content of buffers before a call, to detect writes; an unusual value for a field. */
#define UNTOUCHED 0xA5U
#define MOST_EVENTS 16

static void fill(uint8_t *bytes, size_t size)
{
    /* volatile: otherwise compilers may call memset, which a chip may lack */
    volatile uint8_t *to = bytes;

    for (size_t i = 0; i < size; ++i) {
        to[i] = UNTOUCHED;
    }
}

static bool untouched(const uint8_t *bytes, size_t size)
{
    size_t i = 0;

    while (i < size && bytes[i] == UNTOUCHED) {
        ++i;
    }
    return i == size;
}

static bool same_bytes(const uint8_t *left, const uint8_t *right, size_t size)
{
    size_t i = 0;

    while (i < size && left[i] == right[i]) {
        ++i;
    }
    return i == size;
}

static bool same_text(const char *left, const char *right)
{
    while (*left != '\0' && *left == *right) {
        ++left;
        ++right;
    }
    return *left == *right;
}

/* Sets the place of the next check, unless a check has already failed. */
static void look_at(struct stagewire_finding *finding, const char *where)
{
    if (finding->outcome != STAGEWIRE_FAILED) {
        finding->where = where;
    }
}

/* Records a failure unless right is true. Returns right. */
static bool expect(struct stagewire_finding *finding, bool right, const char *what)
{
    if (!right && finding->outcome != STAGEWIRE_FAILED) {
        finding->outcome = STAGEWIRE_FAILED;
        finding->what = what;
    }
    return right;
}

static void check_encode(const struct stagewire_layout *layout,
    const struct stagewire_vector *vector, struct stagewire_finding *finding)
{
    const bool checked = vector->check != STAGEWIRE_CARRIES;
    const bool accepted = vector->verdict == STAGEWIRE_OK;
    /* exactly the room needed; encoding writes a size slot before removing it */
    const bool shrinks = vector->envelope.size_slot == STAGEWIRE_SLOT_LEFT_OUT;
    const size_t room = (size_t)vector->size + (shrinks ? 1U : 0U);
    uint8_t made[STAGEWIRE_LARGEST];
    size_t size = 0;
    enum stagewire_verdict verdict = STAGEWIRE_OK;

    fill(made, sizeof made);
    if (!expect(finding, room <= sizeof made, "longer than STAGEWIRE_LARGEST")) {
        return;
    }
    verdict = layout->encode(
        vector->values, &vector->envelope, made, accepted ? room : sizeof made, &size, checked);
    if (verdict != vector->verdict) {
        expect(finding, !accepted, "encoding failed");
        expect(finding, false, "encoding succeeded, or failed with another error");
    } else if (accepted) {
        expect(finding, size == vector->size, "encoded with another size");
        expect(finding, same_bytes(made, vector->bytes, vector->size), "encoded to other bytes");
        expect(finding, untouched(&made[room], sizeof made - room), "wrote past the buffer");
    } else if (vector->envelope.extra_size == 0) { /* extra bytes are appended after encoding */
        expect(finding, untouched(made, sizeof made), "encoding failed, but wrote bytes");
    }
}

static void check_difference(const struct stagewire_layout *layout,
    const struct stagewire_vector *vector, struct stagewire_finding *finding)
{
    uint8_t made[STAGEWIRE_LARGEST];
    size_t size = 0;
    const enum stagewire_verdict verdict =
        layout->encode(vector->values, &vector->envelope, made, sizeof made, &size, false);

    expect(finding, verdict == STAGEWIRE_OK, "encoding failed");
    expect(finding, size != vector->size || !same_bytes(made, vector->bytes, size),
        "encoded to the wrong bytes of the document");
}

static void check_envelope(const struct stagewire_envelope *from,
    const struct stagewire_envelope *wanted, struct stagewire_finding *finding)
{
    expect(finding, from->dest == wanted->dest, "decoded another destination");
    expect(finding, from->source == wanted->source, "decoded another source");
    expect(finding, from->axis == wanted->axis, "decoded another axis");
    expect(finding, from->address == wanted->address, "decoded another address");
    expect(finding, from->size_slot == wanted->size_slot, "decoded another form of the size slot");
    if (expect(finding, from->extra_size == wanted->extra_size, "decoded other extra bytes")) {
        expect(finding, same_bytes(from->extra, wanted->extra, wanted->extra_size),
            "decoded other extra bytes");
    }
}

static bool same_field(
    const struct stagewire_field *field, const uint8_t *left, const uint8_t *right)
{
    if (field->kind == STAGEWIRE_UNSIGNED_ARRAY || field->kind == STAGEWIRE_SIGNED_ARRAY) {
        const struct stagewire_array *const a = (const struct stagewire_array *)(const void *)left;
        const struct stagewire_array *const b = (const struct stagewire_array *)(const void *)right;
        return a->count == b->count && same_bytes(a->bytes, b->bytes, a->count * field->wire_size);
    }
    return same_bytes(left, right, field->size);
}

static void check_decode(const struct stagewire_layout *layout,
    const struct stagewire_vector *vector, struct stagewire_finding *finding)
{
    const uint8_t *const wanted = vector->values;
    struct stagewire_envelope from = {0};
    uint64_t room[STAGEWIRE_LARGEST / sizeof(uint64_t)]; /* aligned for every member */
    uint8_t *const message = (uint8_t *)room;
    enum stagewire_verdict verdict = STAGEWIRE_OK;

    fill(message, sizeof room);
    if (!expect(finding, layout->struct_size <= sizeof room, "larger than STAGEWIRE_LARGEST")) {
        return;
    }
    verdict = layout->decode(vector->bytes, vector->size, message, &from);
    if (!expect(finding, verdict == STAGEWIRE_OK, "decoding failed")) {
        return;
    }
    check_envelope(&from, &vector->envelope, finding);
    expect(finding, untouched(&message[layout->struct_size], sizeof room - layout->struct_size),
        "wrote past the struct");
    for (size_t i = 0; i < layout->field_count; ++i) {
        const struct stagewire_field *const field = &layout->fields[i];
        look_at(finding, field->name);
        expect(finding, same_field(field, &message[field->offset], &wanted[field->offset]),
            "decoded another value");
    }
}

static void check_refusals(const struct stagewire_layout *first,
    const struct stagewire_vector *vector, struct stagewire_finding *finding)
{
    uint64_t room[STAGEWIRE_LARGEST / sizeof(uint64_t)];
    uint8_t *const message = (uint8_t *)room;

    fill(message, sizeof room);
    for (size_t i = 0; i < vector->layout_count; ++i) {
        const struct stagewire_layout *const layout = &first[i];
        if (vector->layout_count > 1 && same_text(layout->form, "reply")) {
            continue; /* a reply has only data, so any bytes of this length can be a reply */
        }
        look_at(finding, layout->message);
        if (expect(
                finding, layout->struct_size <= sizeof room, "larger than STAGEWIRE_LARGEST")) {
            expect(finding,
                layout->decode(vector->bytes, vector->size, message, NULL) == vector->verdict,
                "decoding succeeded, or failed with another error");
            expect(finding, untouched(message, sizeof room), "decoding failed, but wrote values");
        }
    }
}

static void check_events(const struct stagewire_suite *suite,
    const struct stagewire_vector *vector, struct stagewire_finding *finding)
{
    if (expect(finding, suite->cut != NULL, "needs a parser")) {
        uint8_t events[MOST_EVENTS];
        const size_t count = suite->cut(vector->bytes, vector->size, events, sizeof events);
        if (expect(finding, count == vector->event_count, "parsed into more or fewer events")) {
            expect(finding, same_bytes(events, vector->events, count), "parsed into other events");
        }
    }
}

static void check_lack(const struct stagewire_suite *suite,
    const struct stagewire_vector *vector, struct stagewire_finding *finding)
{
    for (size_t i = 0; i < suite->layout_count; ++i) {
        const struct stagewire_layout *const layout = &suite->layouts[i];
        const bool in_form = vector->text == NULL || same_text(layout->form, vector->text);
        expect(finding, !in_form || !same_text(layout->message, vector->message),
            "has a layout");
    }
}

/* Checks a vector that is neither encoded nor decoded. */
static void check_other(const struct stagewire_suite *suite,
    const struct stagewire_vector *vector, struct stagewire_finding *finding)
{
    switch (vector->check) {
    case STAGEWIRE_CONVERTS:
        expect(finding, suite->convert != NULL && suite->convert(vector->values),
            "converted to other counts");
        break;
    case STAGEWIRE_CUTS:
        check_events(suite, vector, finding);
        break;
    case STAGEWIRE_LACKS:
        look_at(finding, vector->message);
        check_lack(suite, vector, finding);
        break;
    case STAGEWIRE_HOLDS:
        expect(finding, vector->holds, "differs from the document");
        break;
    case STAGEWIRE_NOTES:
        finding->outcome = STAGEWIRE_NOTED;
        finding->what = vector->text;
        break;
    default:
        expect(finding, false, "unknown kind of vector");
        break;
    }
}

static void check(const struct stagewire_suite *suite,
    const struct stagewire_vector *vector, struct stagewire_finding *finding)
{
    const struct stagewire_layout *const layout = &suite->layouts[vector->layout];

    look_at(finding, layout->message);
    switch (vector->check) {
    case STAGEWIRE_REPRODUCES:
    case STAGEWIRE_CARRIES:
        check_encode(layout, vector, finding);
        check_decode(layout, vector, finding);
        break;
    case STAGEWIRE_ENCODES:
        check_encode(layout, vector, finding);
        break;
    case STAGEWIRE_DECODES:
        check_decode(layout, vector, finding);
        break;
    case STAGEWIRE_REFUSES:
        check_refusals(layout, vector, finding);
        break;
    case STAGEWIRE_DIFFERS:
        check_difference(layout, vector, finding);
        break;
    default:
        look_at(finding, NULL);
        check_other(suite, vector, finding);
        break;
    }
}

void stagewire_note_event(uint8_t event, uint8_t *events, size_t cap, size_t *count)
{
    const bool known = *count != 0 && *count <= cap;
    const uint8_t last = known ? events[*count - 1] : STAGEWIRE_EVENT_PENDING;

    if (event != STAGEWIRE_EVENT_GARBAGE || last != STAGEWIRE_EVENT_GARBAGE) {
        if (*count < cap) {
            events[*count] = event;
        }
        ++*count;
    }
}

size_t stagewire_run(const struct stagewire_suite *suite, stagewire_report report, void *user)
{
    size_t failed = 0;
    size_t i = 0;

    while (i < suite->vector_count) {
        struct stagewire_finding finding = {suite->vectors[i].id, STAGEWIRE_PASSED, NULL, NULL};
        do {
            check(suite, &suite->vectors[i], &finding);
            ++i;
        } while (i < suite->vector_count && same_text(suite->vectors[i].id, finding.id));
        if (finding.outcome == STAGEWIRE_FAILED) {
            ++failed;
        } else {
            finding.where = NULL;
        }
        if (report != NULL) {
            report(user, &finding);
        }
    }
    return failed;
}

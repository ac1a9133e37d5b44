/* The events of a parsed stream, with consecutive garbage joined. */
#ifndef FUZZ_EVENTS_H
#define FUZZ_EVENTS_H

#include "check.h"

struct event {
    unsigned kind;
    size_t size;
};

struct events {
    const uint8_t *stream;
    size_t size;
    size_t taken; /* bytes of the stream that are part of an event */
    size_t count;
    struct event list[ROOM];
};

static void begin(struct events *events, const uint8_t *stream, size_t size)
{
    CHECK(size <= ROOM);
    events->stream = stream;
    events->size = size;
    events->taken = 0;
    events->count = 0;
}

/* Adds an event, and checks that its bytes are the next ones of the stream. */
static void take(struct events *events, unsigned kind, int is_garbage, const uint8_t *bytes, size_t size)
{
    struct event *last = events->count > 0 ? &events->list[events->count - 1] : NULL;
    CHECK(size > 0 && size <= events->size - events->taken);
    CHECK(memcmp(bytes, events->stream + events->taken, size) == 0);
    events->taken += size;
    if (is_garbage && last != NULL && last->kind == kind) {
        last->size += size;
        return;
    }
    events->list[events->count].kind = kind;
    events->list[events->count].size = size;
    events->count += 1;
}

/* Checks that the pending bytes are those that are not part of an event. */
static void end(const struct events *events, const uint8_t *pending, size_t size)
{
    CHECK(size == events->size - events->taken);
    CHECK(size == 0 || memcmp(pending, events->stream + events->taken, size) == 0);
}

static void same(const struct events *one, const struct events *other)
{
    CHECK(one->count == other->count);
    for (size_t i = 0; i < one->count; ++i) {
        CHECK(one->list[i].kind == other->list[i].kind);
        CHECK(one->list[i].size == other->list[i].size);
    }
}

/* Returns the size of the next chunk: everything, one byte, or a pseudo-random size. */
static size_t chunk(uint32_t *draw, size_t left)
{
    size_t size = left;
    if (*draw == 1) {
        size = 1;
    } else if (*draw != 0) {
        *draw = *draw * 1664525U + 1013904223U;
        size = 1 + (*draw >> 24) % 32U;
    }
    return size < left ? size : left;
}

/* How often each kind of event occurred: a run without a message proves nothing. */
enum { KINDS = 16 };
static unsigned long seen[KINDS];
static const char *const *names_of_seen;

static void print_seen(void)
{
    for (size_t kind = 1; kind < KINDS && names_of_seen[kind] != NULL; ++kind) {
        fprintf(stderr, "seen: %s %lu\n", names_of_seen[kind], seen[kind]);
    }
}

static void count(const struct events *events)
{
    for (size_t i = 0; i < events->count; ++i) {
        seen[events->list[i].kind] += 1;
    }
}

static void print_at_end(const char *const *names)
{
    names_of_seen = names;
    CHECK(atexit(print_seen) == 0);
}

#endif

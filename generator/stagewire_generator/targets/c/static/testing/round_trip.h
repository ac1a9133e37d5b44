/**
 * @file round_trip.h
 * What the typed tests of all packages have in common.
 */
#ifndef STAGEWIRE_TESTING_ROUND_TRIP_H
#define STAGEWIRE_TESTING_ROUND_TRIP_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/** Counts a failure into `failed` unless the condition holds, and tells of it. */
#define CHECK(condition) \
    do { \
        if (!(condition)) { \
            ++failed; \
            stagewire_failed(__func__, #condition); \
        } \
    } while (false)

/** Checks that text or bytes of `message` came back as they were in `content`. */
#define CHECK_SAME(member) \
    CHECK(stagewire_same(message.member, sizeof(message.member), content->member))

/** The members of a content. */
#define CONTENT(...) \
    { \
        __VA_ARGS__ \
    }

/** Hears of what failed, in the test of which layout. Every program brings its own. */
void stagewire_failed(const char *layout, const char *condition);

/** Returns whether bytes are the same. */
static inline bool stagewire_same(const void *left, size_t size, const void *right)
{
    const uint8_t *const a = (const uint8_t *)left;
    const uint8_t *const b = (const uint8_t *)right;
    size_t i = 0;

    while (i < size && a[i] == b[i]) {
        ++i;
    }
    return i == size;
}

#endif

/**
 * @file round_trip.h
 * Macros and functions that the round trips of all packages share.
 */
#ifndef STAGEWIRE_TESTING_ROUND_TRIP_H
#define STAGEWIRE_TESTING_ROUND_TRIP_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/** Counts a failure in `failed` and reports it, unless the condition holds. */
#define CHECK(condition) \
    do { \
        if (!(condition)) { \
            ++failed; \
            stagewire_failed(__func__, #condition); \
        } \
    } while (false)

/** Checks that text or bytes in `message` are equal to those in `content`. */
#define CHECK_SAME(member) \
    CHECK(stagewire_same(message.member, sizeof(message.member), content->member))

/** Checks that an array in `message` is equal to that in `content`; its integers have `bytes` bytes. */
#define CHECK_ARRAY(member, bytes_each) \
    CHECK(message.member.count == content->member.count \
        && stagewire_same(message.member.bytes, message.member.count * (bytes_each), \
            content->member.bytes))

/** The initialiser of a content. */
#define CONTENT(...) \
    { \
        __VA_ARGS__ \
    }

/** Reports a failed condition in the test of a layout. Every program defines this function. */
void stagewire_failed(const char *layout, const char *condition);

/** Returns whether bytes are equal. */
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

/* Shared by the fuzz targets: a check that optimised builds keep, and buffers that detect reads past the end. */
#ifndef FUZZ_CHECK_H
#define FUZZ_CHECK_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define CHECK(condition) \
    do { \
        if (!(condition)) { \
            fprintf(stderr, "%s:%d: check failed: %s\n", __FILE__, __LINE__, #condition); \
            abort(); \
        } \
    } while (0)

/* Longer than any message of any protocol. */
enum { ROOM = 5120 };

/* Returns the last size bytes of the room, so that the sanitizer detects a read of one byte too many. The start depends
 * on the size, so words are sometimes at odd addresses. */
static uint8_t *at_the_end_of(uint8_t *room, size_t size)
{
    CHECK(size <= ROOM);
    return room + (ROOM - size);
}

#endif

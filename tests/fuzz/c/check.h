/* What the fuzz targets share: a check that stays in an optimised build, and memory that ends where it should. */
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
            fprintf(stderr, "%s:%d: not so: %s\n", __FILE__, __LINE__, #condition); \
            abort(); \
        } \
    } while (0)

/* Longer than any message of any protocol. */
enum { ROOM = 1024 };

/* Returns where size bytes end exactly where the memory does: the sanitizer sees a single byte too much. Where
 * they begin depends on the size, so that words stand at odd addresses, too. */
static uint8_t *at_the_end_of(uint8_t *room, size_t size)
{
    CHECK(size <= ROOM);
    return room + (ROOM - size);
}

#endif

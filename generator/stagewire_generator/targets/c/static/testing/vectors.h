/**
 * @file vectors.h
 * Worked examples and cases as data, and what runs them, on a host or on the chip itself.
 *
 * Nothing here allocates, prints or writes to a global. A program calls stagewire_run() with a
 * suite of a package, such as apt_examples of stagewire_apt/testing/vectors.h, and hears of every
 * example through a callback.
 */
#ifndef STAGEWIRE_TESTING_VECTORS_H
#define STAGEWIRE_TESTING_VECTORS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "testing/layout.h"

/** Bytes of the largest message, and of the largest struct, that the runner has room for. */
#ifndef STAGEWIRE_LARGEST
#define STAGEWIRE_LARGEST 512
#endif

/** What a vector asks for. */
enum stagewire_check {
    STAGEWIRE_REPRODUCES, /**< the values encode to the bytes, and the bytes decode to the values */
    STAGEWIRE_ENCODES, /**< the values encode to the bytes, or are refused with the verdict */
    STAGEWIRE_CARRIES, /**< the same without range checks, and back */
    STAGEWIRE_DECODES, /**< the bytes decode to the values */
    STAGEWIRE_REFUSES, /**< every layout that could be meant refuses the bytes with the verdict */
    STAGEWIRE_DIFFERS, /**< the values encode, and not to these bytes */
    STAGEWIRE_CONVERTS, /**< the value in a unit is that many counts */
    STAGEWIRE_CUTS, /**< the parser of the package cuts the bytes into the events */
    STAGEWIRE_LACKS, /**< the package has no layout of the message, in the form if one is given */
    STAGEWIRE_HOLDS, /**< a constant of the headers is what the document says */
    STAGEWIRE_NOTES /**< nothing that these programs can check; the text says why */
};

/** What a parser makes of a stream, by the words of the testee protocol. */
enum stagewire_event {
    STAGEWIRE_EVENT_MESSAGE,
    STAGEWIRE_EVENT_UNDOCUMENTED,
    STAGEWIRE_EVENT_UNKNOWN,
    STAGEWIRE_EVENT_BAD_LENGTH,
    STAGEWIRE_EVENT_GARBAGE,
    STAGEWIRE_EVENT_PENDING /**< what waits for more bytes at the end */
};

/** One thing to be checked. Those with the same id stand side by side, and are one example. */
struct stagewire_vector {
    const char *id;
    enum stagewire_check check;
    enum stagewire_verdict verdict;
    uint16_t layout; /**< index of the layout; of LACKS nothing */
    uint16_t layout_count; /**< of REFUSES: how many layouts from there on could be meant */
    struct stagewire_envelope envelope;
    const void *values; /**< the C struct of the layout, if it has one; of CONVERTS what is asked */
    const uint8_t *bytes;
    uint16_t size;
    uint8_t event_count;
    bool holds;
    const uint8_t *events; /**< of CUTS: each one of enum stagewire_event, garbage joined */
    const char *message; /**< of LACKS: its name */
    const char *text; /**< of LACKS: a form or NULL; of NOTES: why */
};

/** The members of the envelope of a vector. */
#define STAGEWIRE_ENVELOPE(...) \
    .envelope = { \
        __VA_ARGS__}
/** The struct of a layout as the values of a vector: its type, then its members. */
#define STAGEWIRE_VALUES(type, ...) \
    .values = &(const type) \
    { \
        __VA_ARGS__ \
    }
/** Bytes, and their number. */
#define STAGEWIRE_BYTES(...) \
    .bytes = (const uint8_t[]){__VA_ARGS__}, .size = sizeof((const uint8_t[]){__VA_ARGS__})
/** Events, and their number. */
#define STAGEWIRE_EVENTS(...) \
    .events = (const uint8_t[]){__VA_ARGS__}, .event_count = sizeof((const uint8_t[]){__VA_ARGS__})

/** Vectors of one package, and the layouts that they speak of. */
struct stagewire_suite {
    const char *name;
    const struct stagewire_layout *layouts;
    const struct stagewire_vector *vectors;
    size_t layout_count;
    size_t vector_count;
    /** Converts what it is asked to; returns whether the counts are right. NULL if nothing asks. */
    bool (*convert)(const void *conversion);
    /** Cuts what came to a device into events, at most cap; returns how many. NULL as above. */
    size_t (*cut)(const uint8_t *bytes, size_t size, uint8_t *events, size_t cap);
};

/** What an example came to. */
enum stagewire_outcome {
    STAGEWIRE_PASSED,
    STAGEWIRE_FAILED,
    STAGEWIRE_NOTED
};

/** What was found of one example. */
struct stagewire_finding {
    const char *id;
    enum stagewire_outcome outcome;
    const char *what; /**< what is wrong, or why nothing was checked; else NULL */
    const char *where; /**< the field or the message that is wrong, if it is one; else NULL */
};

/** Called with each finding, in the order of the suite. */
typedef void (*stagewire_report)(void *user, const struct stagewire_finding *finding);

#ifdef __cplusplus
extern "C" {
#endif

/** For cut(): notes an event where there is room; garbage behind garbage is the same event. */
void stagewire_note_event(uint8_t event, uint8_t *events, size_t cap, size_t *count);

/** Runs a suite; returns how many of its examples failed. report may be NULL. */
size_t stagewire_run(const struct stagewire_suite *suite, stagewire_report report, void *user);

#ifdef __cplusplus
}
#endif

#endif

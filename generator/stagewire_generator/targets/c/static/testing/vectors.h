/**
 * @file vectors.h
 * Worked examples and cases as data, and the runner, for a host or for the chip itself.
 *
 * A program calls stagewire_run() with a suite of a package, such as apt_examples of
 * stagewire_apt/testing/vectors.h. A callback receives the result of each example. The runner does
 * not allocate memory, print, or write to globals.
 */
#ifndef STAGEWIRE_TESTING_VECTORS_H
#define STAGEWIRE_TESTING_VECTORS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "testing/layout.h"

/** Size of the largest message and the largest struct that the runner supports, in bytes. */
#ifndef STAGEWIRE_LARGEST
#define STAGEWIRE_LARGEST 512
#endif

/** The check of a vector. */
enum stagewire_check {
    STAGEWIRE_REPRODUCES, /**< the values encode to the bytes, and the bytes decode to the values */
    STAGEWIRE_ENCODES, /**< the values encode to the bytes, or encoding fails with the verdict */
    STAGEWIRE_CARRIES, /**< as STAGEWIRE_REPRODUCES, but without range checks */
    STAGEWIRE_DECODES, /**< the bytes decode to the values */
    STAGEWIRE_REFUSES, /**< decoding fails with the verdict, for every possible layout */
    STAGEWIRE_DIFFERS, /**< the values encode to other bytes */
    STAGEWIRE_CONVERTS, /**< the value in a unit converts to the counts */
    STAGEWIRE_CUTS, /**< the parser of the package produces the events */
    STAGEWIRE_LACKS, /**< the package has no layout of the message, or not in the given form */
    STAGEWIRE_HOLDS, /**< a constant of the headers agrees with the document */
    STAGEWIRE_NOTES /**< not checked; the text gives the reason */
};

/** Event of a parser; corresponds to the events of the testee protocol. */
enum stagewire_event {
    STAGEWIRE_EVENT_MESSAGE,
    STAGEWIRE_EVENT_UNDOCUMENTED,
    STAGEWIRE_EVENT_UNKNOWN,
    STAGEWIRE_EVENT_BAD_LENGTH,
    STAGEWIRE_EVENT_GARBAGE,
    STAGEWIRE_EVENT_PENDING /**< pending bytes at the end of the stream */
};

/** A check. Adjacent vectors with the same id are one example. */
struct stagewire_vector {
    const char *id;
    enum stagewire_check check;
    enum stagewire_verdict verdict;
    uint16_t layout; /**< index of the layout; unused for LACKS */
    uint16_t layout_count; /**< for REFUSES: number of possible layouts, from that index */
    struct stagewire_envelope envelope;
    const void *values; /**< the C struct of the layout, or NULL; for CONVERTS the conversion */
    const uint8_t *bytes;
    uint16_t size;
    uint8_t event_count;
    bool holds;
    const uint8_t *events; /**< for CUTS: values of enum stagewire_event, adjacent garbage joined */
    const char *message; /**< for LACKS: name of the message */
    const char *text; /**< for LACKS: a form or NULL; for NOTES: the reason */
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
/** Bytes and their number. */
#define STAGEWIRE_BYTES(...) \
    .bytes = (const uint8_t[]){__VA_ARGS__}, .size = sizeof((const uint8_t[]){__VA_ARGS__})
/** Events and their number. */
#define STAGEWIRE_EVENTS(...) \
    .events = (const uint8_t[]){__VA_ARGS__}, .event_count = sizeof((const uint8_t[]){__VA_ARGS__})

/** Vectors of a package, and its layouts. */
struct stagewire_suite {
    const char *name;
    const struct stagewire_layout *layouts;
    const struct stagewire_vector *vectors;
    size_t layout_count;
    size_t vector_count;
    /** Performs a conversion; returns whether the counts are right. NULL if no vector needs it. */
    bool (*convert)(const void *conversion);
    /** Parses bytes received by a device; returns the number of events. NULL if not needed. */
    size_t (*cut)(const uint8_t *bytes, size_t size, uint8_t *events, size_t cap);
};

/** Outcome of an example. */
enum stagewire_outcome {
    STAGEWIRE_PASSED,
    STAGEWIRE_FAILED,
    STAGEWIRE_NOTED
};

/** Result of an example. */
struct stagewire_finding {
    const char *id;
    enum stagewire_outcome outcome;
    const char *what; /**< the failure, or the reason why nothing was checked; else NULL */
    const char *where; /**< the field or message that failed; else NULL */
};

/** Receives each result, in the order of the suite. */
typedef void (*stagewire_report)(void *user, const struct stagewire_finding *finding);

#ifdef __cplusplus
extern "C" {
#endif

/** For cut(): adds an event if there is room; joins adjacent garbage. */
void stagewire_note_event(uint8_t event, uint8_t *events, size_t cap, size_t *count);

/** Runs a suite; returns the number of failed examples. report may be NULL. */
size_t stagewire_run(const struct stagewire_suite *suite, stagewire_report report, void *user);

#ifdef __cplusplus
}
#endif

#endif

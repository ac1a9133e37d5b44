/**
 * @file
 * Protocols of packets: start bytes, a length, an id, a payload, and perhaps an address.
 */
#ifndef STAGEWIRE_TESTING_TESTEE_PACKETS_H
#define STAGEWIRE_TESTING_TESTEE_PACKETS_H

#include "testing/testee/testee.h"

/** The parts of such a package that its layouts do not contain. */
struct packet_package {
    /** Buffer for the longest packet, and its size. */
    uint8_t *room;
    size_t longest;
    /** Check that bytes are exactly one packet with a known layout. */
    enum stagewire_verdict (*identify)(const struct testee_bytes *packet);
    /** Messages that the document names without an id; NULL after the last one. */
    const char *const *nameless;
    /** Begin a stream. */
    void (*begin)(void);
    struct testee_reader parser;
};

/** Decoder and encoder of such protocols. */
extern const struct testee_codec packet_codec;

#endif

/**
 * @file
 * Protocols of packets: start bytes, a length, an id, a payload, and perhaps an address.
 */
#ifndef STAGEWIRE_TESTING_TESTEE_PACKETS_H
#define STAGEWIRE_TESTING_TESTEE_PACKETS_H

#include "testing/testee/testee.h"

/** What the package of such a protocol knows and its layouts do not say. */
struct packet_package {
    /** Room for the longest packet, and its bytes. */
    uint8_t *room;
    size_t longest;
    /** Say whether bytes are exactly one packet of a known layout. */
    enum stagewire_verdict (*identify)(const struct testee_bytes *packet);
    /** Messages that the document names without an id; NULL behind the last one. */
    const char *const *nameless;
    /** Begin a stream. */
    void (*begin)(void);
    struct testee_reader parser;
};

/** How such a protocol is decoded and encoded. */
extern const struct testee_codec packet_codec;

#endif

/*
 * The reference for the generated C: frames overlaid with packed structs, as programs for one kind of
 * machine often do. Do not copy this: it depends on byte order, alignment and a compiler extension.
 */
#ifndef PACKED_H
#define PACKED_H

#include <stdint.h>

#define PACKED __attribute__((packed))

struct PACKED packed_header {
    uint16_t id;
    uint16_t length;
    uint8_t dest;
    uint8_t source;
};

struct PACKED packed_status {
    struct packed_header header;
    uint16_t chan_ident;
    int32_t position;
    int16_t velocity;
    uint16_t reserved;
    uint32_t status_bits;
};

#endif

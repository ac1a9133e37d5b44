/*
 * Read a stream with the parser and the accessors, or with a hand-written loop over packed structs. Both
 * receive the whole stream in one piece, read the id of every message, and add up the fields of the
 * status. Valgrind counts their instructions.
 *
 *     stream FILE by_parser
 *     stream FILE by_hand
 */
#include "packed.h"
#include "stagewire_apt/stagewire_apt.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct totals {
    uint64_t channels;
    uint64_t positions;
    uint64_t velocities;
    uint64_t bits;
    uint64_t completed;
    uint64_t homed;
    uint64_t infos;
    uint64_t parameters;
    uint64_t others;
} totals;

__attribute__((noinline)) void by_hand(const uint8_t *data, size_t size, totals *sum)
{
    while (size >= sizeof(struct packed_header)) {
        const struct packed_header *header = (const void *)data;
        size_t whole = sizeof *header;
        if ((header->dest & APT_DATA_FLAG) != 0U) {
            whole += header->length;
        }
        if (size < whole) {
            break;
        }
        switch (header->id) {
        case APT_MOT_GET_DCSTATUSUPDATE_ID: {
            const struct packed_status *status = (const void *)data;
            if (whole < sizeof *status) {
                ++sum->others;
                break;
            }
            sum->channels += status->chan_ident;
            sum->positions += (uint32_t)status->position;
            sum->velocities += (uint16_t)status->velocity;
            sum->bits ^= status->status_bits;
            break;
        }
        case APT_MOT_MOVE_COMPLETED_ID:
            ++sum->completed;
            break;
        case APT_MOT_MOVE_HOMED_ID:
            ++sum->homed;
            break;
        case APT_HW_GET_INFO_ID:
            ++sum->infos;
            break;
        case APT_MOT_GET_VELPARAMS_ID:
            ++sum->parameters;
            break;
        default:
            ++sum->others;
            break;
        }
        data += whole;
        size -= whole;
    }
}

__attribute__((noinline)) void by_parser(
    const uint8_t *data, size_t size, totals *sum, apt_parser *parser)
{
    apt_event event;
    while (apt_parser_next(parser, &data, &size, &event) != APT_EVENT_NONE) {
        if (event.kind != APT_EVENT_MESSAGE) {
            continue;
        }
        switch (apt_id_of(event.bytes)) {
        case APT_MOT_GET_DCSTATUSUPDATE_ID: {
            apt_mot_get_dcstatusupdate status;
            if (apt_mot_get_dcstatusupdate_decode(event.bytes, event.size, &status) != APT_OK) {
                ++sum->others;
                break;
            }
            sum->channels += status.chan_ident;
            sum->positions += (uint32_t)status.position;
            sum->velocities += (uint16_t)status.velocity;
            sum->bits ^= status.status_bits;
            break;
        }
        case APT_MOT_MOVE_COMPLETED_ID:
            ++sum->completed;
            break;
        case APT_MOT_MOVE_HOMED_ID:
            ++sum->homed;
            break;
        case APT_HW_GET_INFO_ID:
            ++sum->infos;
            break;
        case APT_MOT_GET_VELPARAMS_ID:
            ++sum->parameters;
            break;
        default:
            ++sum->others;
            break;
        }
    }
}

static uint8_t *read_all(const char *path, size_t *size)
{
    FILE *file = fopen(path, "rb");
    uint8_t *bytes = NULL;
    long end;
    if (file == NULL || fseek(file, 0L, SEEK_END) != 0 || (end = ftell(file)) < 0) {
        exit(2);
    }
    *size = (size_t)end;
    bytes = malloc(*size + 1U);
    rewind(file);
    if (bytes == NULL || fread(bytes, 1U, *size, file) != *size) {
        exit(2);
    }
    fclose(file);
    return bytes;
}

int main(int argc, char **argv)
{
    static apt_parser parser;
    static totals sum;
    size_t size = 0U;
    uint8_t *bytes;
    if (argc != 3) {
        return 2;
    }
    bytes = read_all(argv[1], &size);
    apt_parser_init(&parser, APT_END_HOST);
    if (strcmp(argv[2], "by_hand") == 0) {
        by_hand(bytes, size, &sum);
    } else {
        by_parser(bytes, size, &sum, &parser);
    }
    printf("%" PRIu64 " %" PRIu64 " %" PRIu64 " %" PRIu64 " %" PRIu64 " %" PRIu64 " %" PRIu64,
        sum.channels, sum.positions, sum.velocities, sum.bits, sum.completed, sum.homed, sum.infos);
    printf(" %" PRIu64 " %" PRIu64 "\n", sum.parameters, sum.others);
    free(bytes);
    return 0;
}

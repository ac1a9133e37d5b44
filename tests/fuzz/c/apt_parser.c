/* The frame parser: any chunking gives the same events, and no byte is lost or invented.
 *
 * The first byte of an input chooses the end that the parser is for, the second the sizes of the chunks, and the third
 * where the parser gives up. */
#include "events.h"

#include "stagewire_apt/parser.h"
#include "stagewire_apt/testing/layouts.h"

static const char *const names[KINDS] = {
    [APT_EVENT_MESSAGE] = "message",
    [APT_EVENT_UNDOCUMENTED] = "undocumented",
    [APT_EVENT_UNKNOWN] = "unknown",
    [APT_EVENT_BAD_LENGTH] = "bad_length",
    [APT_EVENT_GARBAGE] = "garbage",
};

static const apt_end ends[] = {APT_END_NONE, APT_END_HOST, APT_END_DEVICE};

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* Checks that a layout with the id of the message decodes it. */
static void decodes(const uint8_t *bytes, size_t size)
{
    uint64_t message[ROOM / sizeof(uint64_t)];
    const unsigned id = bytes[0] | (unsigned)bytes[1] << 8;
    size_t low = 0;
    size_t high = apt_layout_count;
    while (low < high) {
        const size_t middle = (low + high) / 2;
        if (apt_layouts[middle].id < id) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    for (; low < apt_layout_count && apt_layouts[low].id == id; ++low) {
        if (apt_layouts[low].decode(bytes, size, message, NULL) == STAGEWIRE_OK) {
            return;
        }
    }
    CHECK(!"no layout decodes this message");
}

static void take_event(struct events *events, const apt_event *event)
{
    take(events, event->kind, event->kind == APT_EVENT_GARBAGE, event->bytes, event->size);
    if (event->kind == APT_EVENT_MESSAGE) {
        decodes(event->bytes, event->size);
    }
}

static void parse(struct events *events, apt_end receiver, uint32_t draw, size_t give_up_at)
{
    static uint8_t room[ROOM];
    apt_parser parser;
    apt_event event;
    size_t pending = 0;
    size_t given = 0;
    apt_parser_init(&parser, receiver);
    while (given < events->size) {
        const size_t until = given < give_up_at && give_up_at < events->size ? give_up_at : events->size;
        size_t left = chunk(&draw, until - given);
        const uint8_t *data = at_the_end_of(room, left);
        memcpy(at_the_end_of(room, left), events->stream + given, left);
        given += left;
        while (apt_parser_next(&parser, &data, &left, &event) != APT_EVENT_NONE) {
            take_event(events, &event);
        }
        CHECK(left == 0);
        if (given == give_up_at || given == events->size) {
            const uint8_t *waiting = apt_parser_pending(&parser, &pending);
            CHECK(pending == given - events->taken);
            CHECK(pending == 0 || memcmp(waiting, events->stream + events->taken, pending) == 0);
            while (apt_parser_abandon(&parser, &event) != APT_EVENT_NONE) {
                take_event(events, &event);
            }
            CHECK(events->taken == given);
        }
    }
    (void)apt_parser_pending(&parser, &pending);
    CHECK(pending == 0);
}

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
    (void)argc;
    (void)argv;
    print_at_end(names);
    return 0;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct events at_once;
    static struct events in_pieces;
    if (size < 4 || size > ROOM) {
        return 0;
    }
    const apt_end receiver = ends[data[0] % 3];
    const uint32_t draw = 1U + data[1];
    const size_t give_up_at = 2U * data[2];
    begin(&at_once, data + 3, size - 3);
    parse(&at_once, receiver, 0, give_up_at);
    begin(&in_pieces, data + 3, size - 3);
    parse(&in_pieces, receiver, 1, give_up_at);
    same(&at_once, &in_pieces);
    begin(&in_pieces, data + 3, size - 3);
    parse(&in_pieces, receiver, draw, give_up_at);
    same(&at_once, &in_pieces);
    count(&at_once);
    return 0;
}

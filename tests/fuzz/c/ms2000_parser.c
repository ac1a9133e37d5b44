/* The command parser and the reply decoder: any chunking gives the same events, and no byte is lost or invented. A
 * message of the parser is also a command on its own, and every reply belongs to a request.
 *
 * The first byte of an input chooses the sizes of the chunks, the second when the host abandons a reply. */
#include "events.h"

#include "stagewire_ms2000/parser.h"
#include "stagewire_ms2000/replies.h"
#include "stagewire_ms2000/testing/layouts.h"

static const char *const names[KINDS] = {
    [MS2000_EVENT_MESSAGE] = "message",
    [MS2000_EVENT_UNKNOWN] = "unknown",
    [MS2000_EVENT_BAD_LENGTH] = "bad_length",
    [MS2000_EVENT_GARBAGE] = "garbage",
};

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* Checks that the table has the message, and that exactly one layout of a command decodes it. */
static void decodes(const uint8_t *bytes, size_t size)
{
    uint64_t message[ROOM / sizeof(uint64_t)];
    const ms2000_entry *entry = NULL;
    size_t fitting = 0;
    CHECK(ms2000_identify_command(bytes, size, &entry) == MS2000_OK);
    CHECK(entry == ms2000_entry_of(bytes));
    for (size_t i = 0; i < ms2000_layout_count; ++i) {
        const struct stagewire_layout *layout = &ms2000_layouts[i];
        const bool may_be = layout->id == bytes[1] && strcmp(layout->form, "reply") != 0;
        fitting += may_be && layout->decode(bytes, size, message, NULL) == STAGEWIRE_OK;
    }
    CHECK(fitting == 1);
}

static size_t give(uint8_t *room, const struct events *events, size_t given, uint32_t *draw)
{
    const size_t size = chunk(draw, events->size - given);
    memcpy(at_the_end_of(room, size), events->stream + given, size);
    return size;
}

static void parse(struct events *events, uint32_t draw)
{
    static uint8_t room[ROOM];
    ms2000_parser parser;
    ms2000_event event;
    size_t pending = 0;
    ms2000_parser_init(&parser);
    for (size_t given = 0; given < events->size;) {
        size_t left = give(room, events, given, &draw);
        const uint8_t *data = at_the_end_of(room, left);
        given += left;
        while (ms2000_parser_next(&parser, &data, &left, &event) != MS2000_EVENT_NONE) {
            take(events, event.kind, event.kind == MS2000_EVENT_GARBAGE, event.bytes, event.size);
            if (event.kind == MS2000_EVENT_MESSAGE) {
                decodes(event.bytes, event.size);
            }
        }
        CHECK(left == 0);
    }
    const uint8_t *waiting = ms2000_parser_pending(&parser, &pending);
    end(events, waiting, pending);
}

/* Sends the next command of the table that has a reply, and checks that it is refused while another is outstanding. */
static void ask(ms2000_replies *replies, size_t from)
{
    const bool must_wait = ms2000_replies_poisoned(replies) || ms2000_replies_outstanding(replies);
    for (size_t i = 0; i < ms2000_table_count; ++i) {
        const ms2000_entry *entry = &ms2000_table[(from + i) % ms2000_table_count];
        const uint8_t question[] = {0x18, entry->id, MS2000_TERMINATOR};
        if (entry->kind == MS2000_KIND_COMMAND && entry->length == 0 && entry->reply_length != 0) {
            CHECK((ms2000_replies_sent(replies, question, sizeof question) == MS2000_OK) == !must_wait);
            CHECK(ms2000_replies_outstanding(replies) || ms2000_replies_poisoned(replies));
            return;
        }
    }
}

/* Decodes the bytes of a controller while a host sends requests as often as allowed; the events are the replies. */
static void answer(struct events *events, uint32_t draw, size_t give_up_at)
{
    static uint8_t room[ROOM];
    ms2000_replies replies;
    ms2000_event event;
    size_t pending = 0;
    ms2000_replies_init(&replies);
    for (size_t given = 0; given < events->size;) {
        ask(&replies, given);
        size_t left = give(room, events, given, &draw);
        const uint8_t *data = at_the_end_of(room, left);
        given += left;
        while (ms2000_replies_next(&replies, &data, &left, &event) != MS2000_EVENT_NONE) {
            CHECK(event.kind == MS2000_EVENT_MESSAGE || event.kind == MS2000_EVENT_GARBAGE);
            CHECK(event.kind != MS2000_EVENT_MESSAGE || !ms2000_replies_outstanding(&replies));
            take(events, event.kind, event.kind == MS2000_EVENT_GARBAGE, event.bytes, event.size);
        }
        CHECK(left == 0);
        if (given >= give_up_at) {
            if (ms2000_replies_abandon(&replies, &event) != MS2000_EVENT_NONE) {
                CHECK(event.kind == MS2000_EVENT_GARBAGE && ms2000_replies_poisoned(&replies));
                take(events, event.kind, 1, event.bytes, event.size);
            }
            ms2000_replies_drained(&replies);
            CHECK(!ms2000_replies_poisoned(&replies) && !ms2000_replies_outstanding(&replies));
        }
    }
    const uint8_t *waiting = ms2000_replies_pending(&replies, &pending);
    end(events, waiting, pending);
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
    if (size < 3 || size > ROOM) {
        return 0;
    }
    begin(&at_once, data + 2, size - 2);
    parse(&at_once, 0);
    begin(&in_pieces, data + 2, size - 2);
    parse(&in_pieces, 1);
    same(&at_once, &in_pieces);
    begin(&in_pieces, data + 2, size - 2);
    parse(&in_pieces, 1U + data[0]);
    same(&at_once, &in_pieces);
    count(&at_once);
    begin(&in_pieces, data + 2, size - 2);
    answer(&in_pieces, 1U + data[0], 2U * data[1]);
    return 0;
}

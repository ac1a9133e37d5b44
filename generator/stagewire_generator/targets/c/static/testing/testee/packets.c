/**
 * @file
 * Packets: decoding, encoding, and their streams.
 */
#include "testing/testee/packets.h"

#include "testing/testee/message.h"

#include <string.h>

static bool has_address(void)
{
    return testee_protocol.framing == TESTEE_ADDRESSED_PACKET;
}

/* Read a packet into the message of the testee. Only one layout of a message accepts it. */
static enum stagewire_verdict read_packet(struct testee *testee, const struct testee_bytes *packet,
    const struct stagewire_layout **found, struct stagewire_envelope *envelope)
{
    const enum stagewire_verdict verdict = testee_protocol.packets->identify(packet);
    const struct stagewire_layout *layout = testee_protocol.layouts;
    if (verdict != STAGEWIRE_OK) {
        return verdict;
    }
    while (layout != testee_layouts_end()
        && layout->decode(packet->bytes, packet->size, testee->message, envelope) != STAGEWIRE_OK) {
        ++layout;
    }
    *found = layout;
    return layout != testee_layouts_end() ? STAGEWIRE_OK : STAGEWIRE_UNSUPPORTED;
}

static void write_packet(struct testee *testee, const struct stagewire_layout *layout,
    const struct stagewire_envelope *envelope)
{
    struct json_writer *const writer = &testee->writer;
    json_key(writer, "message");
    json_put_string(writer, layout->message);
    json_key(writer, "form");
    json_put_string(writer, layout->form);
    if (has_address()) {
        json_key(writer, "address");
        json_put_unsigned(writer, envelope->address);
    }
    message_write(testee, layout);
    if (envelope->extra_size != 0) {
        json_key(writer, "extra");
        json_put_hex(writer, envelope->extra, envelope->extra_size);
    }
}

static void decode(struct testee *testee)
{
    const struct stagewire_layout *layout = NULL;
    struct stagewire_envelope envelope;
    struct testee_bytes packet;
    memset(&envelope, 0, sizeof envelope);
    packet.bytes = json_bytes(testee_get(testee, "hex"), &packet.size);
    if (testee_passes(testee, read_packet(testee, &packet, &layout, &envelope), NULL)) {
        testee_accept(testee);
        write_packet(testee, layout, &envelope);
    }
}

static bool put_packet(
    struct testee_events *events, const char *name, const struct testee_bytes *packet)
{
    const struct stagewire_layout *layout = NULL;
    struct stagewire_envelope envelope;
    if (read_packet(events->testee, packet, &layout, &envelope) != STAGEWIRE_OK) {
        return false;
    }
    testee_open_event(events, name);
    write_packet(events->testee, layout, &envelope);
    json_close(&events->testee->writer, '}');
    return true;
}

static void stream(struct testee *testee)
{
    testee_protocol.packets->begin();
    testee_stream(testee, &testee_protocol.packets->parser, put_packet);
}

static bool is_nameless(const struct json_value *message)
{
    for (const char *const *name = testee_protocol.packets->nameless; *name != NULL; ++name) {
        if (json_is(message, *name)) {
            return true;
        }
    }
    return false;
}

/* Find the layout of the form in the request, or the only layout if there is no form. */
static bool find_layout(struct testee *testee, const struct stagewire_layout **found)
{
    const struct json_value *const message = testee_get(testee, "message");
    const struct json_value *const form = testee_get(testee, "form");
    size_t layouts = 0;
    size_t meant = 0;
    for (const struct stagewire_layout *layout = testee_protocol.layouts;
         layout != testee_layouts_end(); ++layout) {
        if (json_is(message, layout->message)) {
            ++layouts;
            if (form == NULL || json_is(form, layout->form)) {
                ++meant;
                *found = layout;
            }
        }
    }
    if (layouts == 0 && is_nameless(message)) {
        return testee_refuse(
            testee, TESTEE_UNSUPPORTED, "the document gives the message no id", message);
    }
    if (layouts == 0) {
        return testee_refuse(testee, TESTEE_UNKNOWN_MESSAGE, "unknown message", message);
    }
    return meant == 1
        || testee_refuse(
            testee, TESTEE_BAD_LENGTH, "the form is missing or unknown", form);
}

static bool encode_layout(struct testee *testee, const struct stagewire_layout *layout,
    const struct stagewire_envelope *envelope, size_t *size)
{
    const struct packet_package *const package = testee_protocol.packets;
    const enum stagewire_verdict verdict =
        layout->encode(testee->message, envelope, package->room, package->longest, size, true);
    return testee_passes(testee, verdict, testee_get(testee, "message"));
}

/* Read the address, which is required if packets have one. */
static bool read_address(struct testee *testee, uint32_t *address)
{
    static const struct stagewire_field field = {
        .name = "address", .size = sizeof *address, .kind = STAGEWIRE_UNSIGNED};
    const struct json_value *const value = testee_get(testee, field.name);
    if (!has_address()) {
        return true;
    }
    if (value == NULL) {
        return testee_refuse(testee, TESTEE_MISSING_FIELD, field.name, NULL);
    }
    return testee_passes(testee, message_set(&field, value, address), value);
}

static void encode(struct testee *testee)
{
    const struct stagewire_layout *layout = NULL;
    const struct json_value *const extra = testee_get(testee, "extra");
    struct stagewire_envelope envelope;
    size_t size = 0;
    memset(&envelope, 0, sizeof envelope);
    /* The first error is reported, in the order of fields, address, extra bytes. */
    if (!find_layout(testee, &layout) || !message_read(testee, layout)
        || !encode_layout(testee, layout, &envelope, &size)
        || !read_address(testee, &envelope.address)
        || !encode_layout(testee, layout, &envelope, &size)) {
        return;
    }
    if (extra != NULL) {
        envelope.extra = json_bytes(extra, &envelope.extra_size);
    }
    if (encode_layout(testee, layout, &envelope, &size)) {
        testee_answer_bytes(testee, testee_protocol.packets->room, size);
    }
}

const struct testee_codec packet_codec = {decode, encode, stream};

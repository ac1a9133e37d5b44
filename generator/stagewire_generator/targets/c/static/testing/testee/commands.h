/**
 * @file
 * Protocols of commands: an axis, a byte, a size slot, and replies that only the command explains.
 */
#ifndef STAGEWIRE_TESTING_TESTEE_COMMANDS_H
#define STAGEWIRE_TESTING_TESTEE_COMMANDS_H

#include "testing/testee/testee.h"

enum {
    COMMANDS_SLOTS = 3, /**< Bytes before the data: axis, byte of the command, size slot. */
    COMMANDS_LONGEST = 259
};

/** What the package of such a protocol knows and its layouts do not say. */
struct command_package {
    /** An axis that a command may be for. */
    uint8_t axis;
    /** Say whether bytes are exactly one command; set the name of the command if they are. */
    enum stagewire_verdict (*identify)(const struct testee_bytes *bytes, const char **name);
    /** Whether the bytes of a command hold those of a setup command. */
    bool (*holds_setup)(const struct testee_bytes *command);
    /** Begin a stream of commands. */
    void (*begin)(void);
    struct testee_reader parser;
    /** Begin a stream of replies, with this command outstanding. */
    void (*ask)(const struct testee_bytes *command);
    struct testee_reader replies;
};

/** How such a protocol is decoded and encoded. */
extern const struct testee_codec command_codec;

/** What a request is about. */
enum command_direction {
    COMMANDS_WRONG_DIRECTION,
    COMMANDS_COMMAND,
    COMMANDS_REPLY
};

/** Which direction the request gives; refuses it when that is none. */
enum command_direction command_direction_of(struct testee *testee);

/** Answer with the bytes of the command or reply that the request describes. */
void command_encode(struct testee *testee);

#endif

/**
 * @file
 * Protocols of commands with an axis, a command byte and a size slot, and replies without a frame.
 */
#ifndef STAGEWIRE_TESTING_TESTEE_COMMANDS_H
#define STAGEWIRE_TESTING_TESTEE_COMMANDS_H

#include "testing/testee/testee.h"

enum {
    COMMANDS_SLOTS = 3, /**< Bytes before the data: axis, command byte, size slot. */
    COMMANDS_LONGEST = 259
};

/** The parts of such a package that its layouts do not contain. */
struct command_package {
    /** A valid axis. */
    uint8_t axis;
    /** Check that bytes are exactly one command; set the name of the command if they are. */
    enum stagewire_verdict (*identify)(const struct testee_bytes *bytes, const char **name);
    /** Whether a command contains the bytes of a setup command. */
    bool (*holds_setup)(const struct testee_bytes *command);
    /** Begin a stream of commands. */
    void (*begin)(void);
    struct testee_reader parser;
    /** Begin a stream of replies with this command outstanding. */
    void (*ask)(const struct testee_bytes *command);
    struct testee_reader replies;
};

/** Decoder and encoder of such protocols. */
extern const struct testee_codec command_codec;

/** Direction of a request. */
enum command_direction {
    COMMANDS_WRONG_DIRECTION,
    COMMANDS_COMMAND,
    COMMANDS_REPLY
};

/** Return the direction of the request; answer with an error if it is invalid. */
enum command_direction command_direction_of(struct testee *testee);

/** Answer with the bytes of the command or reply that the request describes. */
void command_encode(struct testee *testee);

#endif

/**
 * @file
 * The shape of requests: which keys they have, and what these hold.
 */
#ifndef STAGEWIRE_TESTING_TESTEE_REQUEST_H
#define STAGEWIRE_TESTING_TESTEE_REQUEST_H

#include "testing/testee/testee.h"

/** What is asked. */
enum operation {
    HELLO = 1,
    DECODE = 2,
    ENCODE = 4,
    STREAM = 8
};

enum {
    OPERATIONS = 4
};

/** The names of all operations. */
extern const struct operation_name {
    const char *name;
    enum operation operation;
} operation_names[OPERATIONS];

/** Whether the protocol that a request names is the one of this program. */
bool is_our_protocol(const struct testee *testee);

/**
 * Check the shape of the request, values of fields and addresses apart.
 *
 * @return false when it was refused.
 */
bool check_request(struct testee *testee, enum operation *operation);

#endif

/**
 * @file
 * The form of requests: their keys, and the types of values.
 */
#ifndef STAGEWIRE_TESTING_TESTEE_REQUEST_H
#define STAGEWIRE_TESTING_TESTEE_REQUEST_H

#include "testing/testee/testee.h"

/** Operation of a request. */
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

/** Whether the request names the protocol of this program. */
bool is_our_protocol(const struct testee *testee);

/**
 * Check the form of the request, but not the values of fields and addresses.
 *
 * @return false if the request was refused.
 */
bool check_request(struct testee *testee, enum operation *operation);

#endif

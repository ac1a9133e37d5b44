/* A serial port of a computer, with timeouts, for any protocol. */
#ifndef SERIAL_H
#define SERIAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <termios.h>

/** Return the time of a monotonic clock in milliseconds. */
int64_t serial_now(void);

/** A port. */
struct serial {
    int file;
};

/** Open a port in raw mode; print an error and return false if that fails. */
bool serial_open(struct serial *port, const char *name, speed_t speed);

/** Send all bytes; print an error and return false if that fails. */
bool serial_send(const struct serial *port, const uint8_t *bytes, size_t size);

/** Wait for bytes until a time of serial_now(); print an error and return 0 if none arrive. */
size_t serial_receive(const struct serial *port, int64_t until, uint8_t *bytes, size_t cap);

#endif

/* A serial port of a computer, with time limits; whatever the protocol. */
#ifndef SERIAL_H
#define SERIAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <termios.h>

/** Return the milliseconds of a clock that only goes forward. */
int64_t serial_now(void);

/** A port. */
struct serial {
    int file;
};

/** Open a port for bytes as they are; say so if that fails. */
bool serial_open(struct serial *port, const char *name, speed_t speed);

/** Send bytes, all of them; say so if that fails. */
bool serial_send(const struct serial *port, const uint8_t *bytes, size_t size);

/** Take what comes until a time of serial_now(); return 0, and say so, if nothing does. */
size_t serial_receive(const struct serial *port, int64_t until, uint8_t *bytes, size_t cap);

#endif

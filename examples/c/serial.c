/* A POSIX serial port. */
#include "serial.h"

#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <time.h>
#include <unistd.h>

int64_t serial_now(void)
{
    struct timespec now = {0, 0};

    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return ((int64_t)now.tv_sec * 1000) + (now.tv_nsec / 1000000);
}

bool serial_open(struct serial *port, const char *name, speed_t speed)
{
    struct termios raw;

    port->file = open(name, O_RDWR | O_NOCTTY);
    if (port->file >= 0 && tcgetattr(port->file, &raw) == 0) {
        raw.c_iflag = 0U;
        raw.c_oflag = 0U;
        raw.c_lflag = 0U;
        raw.c_cflag = CS8 | CREAD | CLOCAL;
        raw.c_cc[VMIN] = 1U;
        raw.c_cc[VTIME] = 0U;
        if (cfsetispeed(&raw, speed) == 0 && cfsetospeed(&raw, speed) == 0
            && tcsetattr(port->file, TCSAFLUSH, &raw) == 0) {
            return true;
        }
    }
    perror(name);
    return false;
}

bool serial_send(const struct serial *port, const uint8_t *bytes, size_t size)
{
    while (size > 0U) {
        const ssize_t written = write(port->file, bytes, size);

        if (written <= 0) {
            perror("send");
            return false;
        }
        bytes += written;
        size -= (size_t)written;
    }
    return true;
}

size_t serial_receive(const struct serial *port, int64_t until, uint8_t *bytes, size_t cap)
{
    struct pollfd ready = {port->file, POLLIN, 0};
    const int64_t remaining = until - serial_now();
    ssize_t size;

    if (remaining <= 0 || poll(&ready, 1U, (int)remaining) <= 0) {
        (void)fprintf(stderr, "timeout: no reply\n");
        return 0U;
    }
    size = read(port->file, bytes, cap);
    if (size <= 0) {
        (void)fprintf(stderr, "the port was closed\n");
        return 0U;
    }
    return (size_t)size;
}

/*
 * A controller on a pseudo-terminal, which a host uses like a serial port.
 *
 *     kdc101 LINK [EEPROM]
 *
 * LINK becomes the name of the port. It is an error if it already exists: another controller may be using
 * it. EEPROM is the file that keeps saved settings; without it, they are lost at the end. Stop the
 * controller with an interrupt.
 */
#include "firmware.h"
#include "unit.h"

#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

static int port = -1;
static const char *eeprom; /* the name of the file; NULL: none */
static volatile sig_atomic_t ended = 0;

static void end(int signal_number)
{
    (void)signal_number;
    ended = 1;
}

size_t firmware_read(uint8_t *bytes, size_t cap)
{
    const ssize_t size = read(port, bytes, cap);
    return size > 0 ? (size_t)size : 0U;
}

void firmware_write(const uint8_t *bytes, size_t size)
{
    while (size > 0U) {
        const ssize_t written = write(port, bytes, size);
        if (written <= 0) {
            return; /* no host is connected; a serial line would also lose the bytes */
        }
        bytes += written;
        size -= (size_t)written;
    }
}

uint32_t firmware_cycles(void)
{
    struct timespec now;
    uint64_t microseconds;

    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    microseconds = (uint64_t)now.tv_sec * 1000000U + (uint64_t)now.tv_nsec / 1000U;
    return (uint32_t)(microseconds * UNIT.cycles / 1024000U);
}

bool firmware_load(size_t at, uint8_t *bytes, size_t size)
{
    const int file = eeprom == NULL ? -1 : open(eeprom, O_RDONLY);
    bool done;

    if (file < 0) {
        return false;
    }
    done = pread(file, bytes, size, (off_t)at) == (ssize_t)size;
    (void)close(file);
    return done;
}

void firmware_save(size_t at, const uint8_t *bytes, size_t size)
{
    const int file = eeprom == NULL ? -1 : open(eeprom, O_WRONLY | O_CREAT, 0666);

    if (eeprom != NULL && (file < 0 || pwrite(file, bytes, size, (off_t)at) != (ssize_t)size)) {
        perror(eeprom);
    }
    if (file >= 0) {
        (void)close(file);
    }
}

void firmware_outputs(uint8_t bits)
{
    (void)bits; /* a computer has none */
}

void firmware_lamp(bool lit)
{
    (void)lit;
}

/* Open a pseudo-terminal in raw mode. Its other end stays open, like a connected cable. */
static bool open_port(const char *link)
{
    struct termios raw;
    int other;

    port = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
    if (port < 0 || grantpt(port) != 0 || unlockpt(port) != 0) {
        return false;
    }
    other = open(ptsname(port), O_RDWR | O_NOCTTY);
    if (other < 0 || tcgetattr(other, &raw) != 0) {
        return false;
    }
    raw.c_iflag = 0U;
    raw.c_oflag = 0U;
    raw.c_lflag = 0U;
    return tcsetattr(other, TCSANOW, &raw) == 0 && symlink(ptsname(port), link) == 0;
}

int main(int argc, char **argv)
{
    const struct timespec nap = {0, 1000000};
    const struct sigaction action = {.sa_handler = end};
    static struct firmware controller;

    if (argc != 2 && argc != 3) {
        (void)fprintf(stderr, "usage: %s LINK [EEPROM]\n", argv[0]);
        return 2;
    }
    eeprom = argv[2];
    if (sigaction(SIGINT, &action, NULL) != 0 || sigaction(SIGTERM, &action, NULL) != 0) {
        perror("signals");
        return 1;
    }
    if (!open_port(argv[1])) {
        perror(argv[1]);
        return 1;
    }
    firmware_init(&controller);
    while (ended == 0) {
        firmware_poll(&controller);
        (void)nanosleep(&nap, NULL);
    }
    return unlink(argv[1]) == 0 ? 0 : 1;
}

/* The controller of examples/c as a library in stepped time: its owner moves the clock. */
#include "firmware.h"

#include <string.h>

#define MOST 4096U
#define STEP 10U /* cycles between two calls of the loop: about 1 ms */

static struct firmware controller;
static uint32_t cycles;
static uint8_t to_device[MOST];
static size_t received;
static uint8_t to_host[MOST];
static size_t sent;

size_t firmware_read(uint8_t *bytes, size_t cap)
{
    const size_t size = received < cap ? received : cap;
    memcpy(bytes, to_device, size);
    received -= size;
    memmove(to_device, to_device + size, received);
    return size;
}

void firmware_write(const uint8_t *bytes, size_t size)
{
    if (sent + size <= MOST) {
        memcpy(to_host + sent, bytes, size);
        sent += size;
    }
}

uint32_t firmware_cycles(void)
{
    return cycles;
}

void stepped_begin(void);
int stepped_write(const uint8_t *bytes, size_t size);
size_t stepped_read(uint32_t until, uint8_t *bytes);
uint32_t stepped_cycles(void);

void stepped_begin(void)
{
    cycles = UINT32_MAX - 100000U; /* the counter wraps around after ten seconds */
    received = 0U;
    sent = 0U;
    firmware_init(&controller);
}

uint32_t stepped_cycles(void)
{
    return cycles;
}

int stepped_write(const uint8_t *bytes, size_t size)
{
    if (received + size > MOST) {
        return 0;
    }
    memcpy(to_device + received, bytes, size);
    received += size;
    return 1;
}

/* Run until there is output or the time has come; return the size of the output. */
size_t stepped_read(uint32_t until, uint8_t *bytes)
{
    size_t size;

    while (sent == 0U && cycles != until) {
        const uint32_t left = until - cycles;
        cycles += left < STEP ? left : STEP;
        firmware_poll(&controller);
    }
    size = sent;
    memcpy(bytes, to_host, size);
    sent = 0U;
    return size;
}

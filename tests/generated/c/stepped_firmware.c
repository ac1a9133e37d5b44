/* A controller of examples/c as a library in stepped time: its owner moves the clock. */
#include "firmware.h"
#include "unit.h"

#include <string.h>

#define MOST 4096U
#define STEP ((UNIT.cycles + 512U) / 1024U) /* cycles between two calls of the loop: about 1 ms */

static struct firmware controller;
static uint32_t cycles;
static uint8_t to_device[MOST];
static size_t received;
static uint8_t to_host[MOST];
static size_t sent;
static uint8_t eeprom[MOST]; /* its power-on state is that of a new chip: no valid frame */
static uint8_t outputs;
static bool lit;

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

bool firmware_load(size_t at, uint8_t *bytes, size_t size)
{
    memcpy(bytes, eeprom + at, size);
    return true;
}

void firmware_save(size_t at, const uint8_t *bytes, size_t size)
{
    memcpy(eeprom + at, bytes, size);
}

void firmware_outputs(uint8_t bits)
{
    outputs = bits;
}

void firmware_lamp(bool is_lit)
{
    lit = is_lit;
}

void stepped_begin(void);
int stepped_write(const uint8_t *bytes, size_t size);
size_t stepped_read(uint32_t until, uint8_t *bytes);
uint32_t stepped_cycles(void);
uint32_t stepped_rate(void);
int stepped_lamp(void);
int stepped_outputs(void);

void stepped_begin(void)
{
    cycles = UINT32_MAX - 10U * UNIT.cycles; /* the counter wraps around after ten seconds */
    received = 0U;
    sent = 0U;
    firmware_init(&controller);
}

uint32_t stepped_cycles(void)
{
    return cycles;
}

/* Return the number of cycles in 1.024 s. */
uint32_t stepped_rate(void)
{
    return UNIT.cycles;
}

int stepped_lamp(void)
{
    return lit;
}

int stepped_outputs(void)
{
    return outputs;
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

/* Communication of a program on the chip with the emulator that runs it. */
#ifndef SEMIHOSTING_H
#define SEMIHOSTING_H

#include <stdint.h>

/* Writes a zero-terminated text to the console of the emulator. */
void semihosting_write(const char *text);

/* Writes a number in decimal digits. */
void semihosting_write_number(uint32_t number);

/* Stops the emulator with exit status 0 for success, or 1. */
_Noreturn void semihosting_exit(int failed);

#endif

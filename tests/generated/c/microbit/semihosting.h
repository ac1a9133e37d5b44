/* What a program on the chip says to the emulator that runs it. */
#ifndef SEMIHOSTING_H
#define SEMIHOSTING_H

#include <stdint.h>

/* Writes a text that ends with a zero to the console of the emulator. */
void semihosting_write(const char *text);

/* Writes a number in decimal digits. */
void semihosting_write_number(uint32_t number);

/* Ends the emulator: its exit status is 0 if all went well, otherwise 1. */
_Noreturn void semihosting_exit(int failed);

#endif

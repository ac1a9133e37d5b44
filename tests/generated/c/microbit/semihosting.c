#include "semihosting.h"

/* Operations and reasons of Arm's semihosting interface, version 2. */
#define SYS_WRITE0 0x04U
#define SYS_EXIT 0x18U
#define ADP_STOPPED_RUN_TIME_ERROR 0x20023U
#define ADP_STOPPED_APPLICATION_EXIT 0x20026U

static void call(uint32_t operation, uintptr_t argument)
{
    register uint32_t r0 __asm__("r0") = operation;
    register uintptr_t r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab"
                     : "+r"(r0)
                     : "r"(r1)
                     : "memory");
}

void semihosting_write(const char *text)
{
    call(SYS_WRITE0, (uintptr_t)text);
}

void semihosting_write_number(uint32_t number)
{
    char text[11];
    char *first = &text[sizeof text - 1U];
    *first = '\0';
    do {
        --first;
        *first = (char)('0' + (char)(number % 10U));
        number /= 10U;
    } while (number != 0U);
    semihosting_write(first);
}

_Noreturn void semihosting_exit(int failed)
{
    call(SYS_EXIT, failed ? ADP_STOPPED_RUN_TIME_ERROR : ADP_STOPPED_APPLICATION_EXIT);
    for (;;) {
    }
}

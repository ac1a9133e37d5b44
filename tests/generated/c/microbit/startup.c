/* Vector table and start of a Cortex-M0; there is no .data to copy and no .bss to clear. */
#include "semihosting.h"

int main(void);
void reset(void);

extern uint32_t stack_top;

void reset(void)
{
    semihosting_exit(main());
}

/* The handler for all faults, such as a jump to an address without code. */
static void fault(void)
{
    semihosting_write("hard fault\n");
    semihosting_exit(1);
}

struct vectors {
    uint32_t *stack;
    void (*handlers[15])(void);
};

/* Reset, NMI, hard fault; no other exceptions can occur here. */
__attribute__((section(".vectors"), used)) static const struct vectors vectors = {
    &stack_top, {reset, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault}};

/* Vector table and start of a Cortex-M0; there is no .data to copy and no .bss to clear. */
#include "semihosting.h"

int main(void);
void reset(void);

extern uint32_t stack_top;

void reset(void)
{
    semihosting_exit(main());
}

/* Whatever goes wrong on the chip ends here, such as a jump to where no code is. */
static void fault(void)
{
    semihosting_write("hard fault\n");
    semihosting_exit(1);
}

struct vectors {
    uint32_t *stack;
    void (*handlers[15])(void);
};

/* Reset, NMI, hard fault; none of the others can happen here. */
__attribute__((section(".vectors"), used)) static const struct vectors vectors = {
    &stack_top, {reset, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault}};

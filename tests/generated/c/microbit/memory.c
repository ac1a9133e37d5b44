/* The four functions that gcc may call implicitly. Only test programs need them, not the headers. */
#include <stddef.h>

void *memcpy(void *restrict to, const void *restrict from, size_t size);
void *memmove(void *to, const void *from, size_t size);
void *memset(void *at, int value, size_t size);
int memcmp(const void *left, const void *right, size_t size);

void *memmove(void *to, const void *from, size_t size)
{
    unsigned char *target = to;
    const unsigned char *source = from;
    if (target < source) {
        for (size_t i = 0; i < size; ++i) {
            target[i] = source[i];
        }
    } else {
        for (size_t i = size; i > 0; --i) {
            target[i - 1] = source[i - 1];
        }
    }
    return to;
}

void *memcpy(void *restrict to, const void *restrict from, size_t size)
{
    return memmove(to, from, size);
}

void *memset(void *at, int value, size_t size)
{
    unsigned char *target = at;
    for (size_t i = 0; i < size; ++i) {
        target[i] = (unsigned char)value;
    }
    return at;
}

int memcmp(const void *left, const void *right, size_t size)
{
    const unsigned char *a = left;
    const unsigned char *b = right;
    for (size_t i = 0; i < size; ++i) {
        if (a[i] != b[i]) {
            return a[i] < b[i] ? -1 : 1;
        }
    }
    return 0;
}

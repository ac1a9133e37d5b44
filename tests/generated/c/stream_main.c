/*
 * The parser of one package as a program: reads blocks from standard input and writes events.
 *
 * Compile with -DPARSER='"stagewire_apt/parser.h"' and -DPREFIX=apt. Each request begins with a letter:
 *
 *     i END                 initialise the parser for this end of the line (one byte); answers 'i'
 *     f SIZE BYTES          feed a block; SIZE has four bytes, the least significant first
 *     a                     abandon the pending frame
 *     p                     answers 'p' with the pending bytes
 *     w                     answers 'w' with the number of basic blocks executed since 'i' (eight bytes), counted
 *                           if the source was compiled with -fsanitize-coverage=trace-pc
 *
 * An answer is a byte (the kind of an event, or the letter of the request), a byte that is 1 if the bytes
 * are in the block and not copied, the number of bytes (four bytes), and the bytes.
 */
#include PARSER

#include <stdio.h>
#include <stdlib.h>

#define JOIN(prefix, name) prefix##_##name
#define NAME_OF(prefix, name) JOIN(prefix, name)
#define NAME(name) NAME_OF(PREFIX, name)

struct block {
    uint8_t *bytes;
    size_t size;
};

static NAME(parser) parser;
static uint64_t work;

/* gcc -fsanitize-coverage=trace-pc calls this in every basic block. */
void __sanitizer_cov_trace_pc(void);

void __sanitizer_cov_trace_pc(void)
{
    ++work;
}

static void put(int what, const struct block *in, const uint8_t *bytes, size_t size)
{
    const bool in_place = in->size != 0U && bytes >= in->bytes && bytes < &in->bytes[in->size];
    int i;
    putchar(what);
    putchar(in_place);
    for (i = 0; i < 32; i += 8) {
        putchar((int)(size >> i & 0xFFU));
    }
    fwrite(bytes, 1U, size, stdout);
}

/* Read a block into memory of exactly its size, so that a sanitizer detects reads past its end. */
static struct block read_block(void)
{
    struct block block = {NULL, 0U};
    int i;
    for (i = 0; i < 32; i += 8) {
        block.size |= (size_t)(getchar() & 0xFF) << i;
    }
    block.bytes = malloc(block.size + (block.size == 0U));
    if (block.bytes == NULL || fread(block.bytes, 1U, block.size, stdin) != block.size) {
        exit(2);
    }
    return block;
}

static void take(struct block block)
{
    const uint8_t *data = block.bytes;
    size_t size = block.size;
    NAME(event)
    event;
    while (NAME(parser_next)(&parser, &data, &size, &event) != 0) {
        put((int)event.kind, &block, event.bytes, event.size);
    }
    if (event.kind != 0 || size != 0U || data != &block.bytes[block.size]) {
        exit(3);
    }
    free(block.bytes);
}

static void give_up(void)
{
    const struct block none = {NULL, 0U};
    NAME(event)
    event;
    while (NAME(parser_abandon)(&parser, &event) != 0) {
        put((int)event.kind, &none, event.bytes, event.size);
    }
    if (event.kind != 0) {
        exit(3);
    }
}

static void put_work(void)
{
    const struct block none = {NULL, 0U};
    const uint64_t done = work;
    uint8_t bytes[8];
    size_t i;
    for (i = 0U; i < sizeof bytes; ++i) {
        bytes[i] = (uint8_t)(done >> (8U * i) & 0xFFU);
    }
    put('w', &none, bytes, sizeof bytes);
}

int main(void)
{
    const struct block none = {NULL, 0U};
    const uint8_t *bytes = NULL;
    size_t size = 0U;
    int asked;
    while ((asked = getchar()) != EOF) {
        switch (asked) {
        case 'i':
            NAME(parser_init)
            (&parser, (NAME(end))getchar());
            work = 0U;
            put(asked, &none, (const uint8_t *)"", 0U);
            break;
        case 'f':
            take(read_block());
            break;
        case 'a':
            give_up();
            break;
        case 'p':
            bytes = NAME(parser_pending)(&parser, &size);
            put(asked, &none, bytes, size);
            break;
        case 'w':
            put_work();
            break;
        default:
            return 2;
        }
    }
    return 0;
}

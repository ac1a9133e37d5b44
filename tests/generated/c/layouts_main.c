/* Prints the layouts of one package (LAYOUTS and COUNT of LAYOUTS_H), one line per layout and per field. */
#include <inttypes.h>
#include <stdio.h>

#include LAYOUTS_H

static void print_field(const struct stagewire_field *field)
{
    static const char *const kinds[] = {"unsigned", "signed", "text", "bytes", "unsigned array", "signed array"};

    printf("field\t%s\t%d\t%s\t%d\t%d\t%" PRId64 "\t%" PRId64 "\t%" PRId64 "\n", field->name, field->wire_size,
        kinds[field->kind], field->optional, field->unnamed, field->constant, field->minimum, field->maximum);
}

int main(void)
{
    for (size_t i = 0; i < COUNT; ++i) {
        const struct stagewire_layout *const layout = &LAYOUTS[i];
        printf("layout\t%s\t%s\t%s\t%d\t%s\t%s\t%d\t%d\n", layout->message, layout->form, layout->kind, layout->id,
            layout->contexts == NULL ? "-" : layout->contexts->name,
            layout->contexts == NULL ? "-" : layout->contexts->value, layout->length, layout->message_size);
        for (size_t j = 0; j < layout->field_count; ++j) {
            print_field(&layout->fields[j]);
        }
    }
    return 0;
}

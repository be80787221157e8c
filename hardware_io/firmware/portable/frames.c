#include "frames.h"

#include "crc32.h"

#define HEADER 6U
#define CHECKSUM 4U
#define COMMAND_FIELDS 4U
#define ENTRY 5U

static uint16_t read_u16(const uint8_t *bytes)
{
    return (uint16_t)(bytes[0] | ((uint16_t)bytes[1] << 8));
}

static uint32_t read_u32(const uint8_t *bytes)
{
    return read_u16(bytes) | ((uint32_t)read_u16(bytes + 2) << 16);
}

static uint8_t *write_u16(uint8_t *bytes, uint16_t value)
{
    bytes[0] = (uint8_t)(value & 0xFFU);
    bytes[1] = (uint8_t)(value >> 8);
    return bytes + 2;
}

static uint8_t *write_u32(uint8_t *bytes, uint32_t value)
{
    return write_u16(write_u16(bytes, (uint16_t)(value & 0xFFFFU)), (uint16_t)(value >> 16));
}

static bool names_twice(const struct frame *frame, uint8_t count)
{
    for (uint8_t k = 0; k < count; k++) {
        if (frame->entries[k].robot == frame->entries[count].robot) {
            return true;
        }
    }
    return false;
}

static bool read_command(const uint8_t *body, uint8_t length, struct frame *frame)
{
    if (length < COMMAND_FIELDS) {
        return false;
    }
    frame->form = body[0];
    frame->count = body[1];
    frame->age = read_u16(body + 2);
    if ((frame->form > (uint8_t)FORM_TWIST) || (frame->count == 0U) ||
        (frame->count > FRAME_MOST_ENTRIES) ||
        (length != (COMMAND_FIELDS + (ENTRY * frame->count)))) {
        return false;
    }
    const uint8_t *at = body + COMMAND_FIELDS;
    for (uint8_t k = 0; k < frame->count; k++) {
        frame->entries[k].robot = at[0];
        frame->entries[k].first = (int16_t)read_u16(at + 1);
        frame->entries[k].second = (int16_t)read_u16(at + 3);
        if ((at[0] == FRAME_EVERYONE) || names_twice(frame, k)) {
            return false;
        }
        at += ENTRY;
    }
    return true;
}

bool frame_decode(const uint8_t *bytes, uint8_t length, struct frame *frame)
{
    if ((length < (HEADER + CHECKSUM)) || (length > FRAME_MOST_BYTES) || (bytes[0] != FRAME_MARK)) {
        return false;
    }
    const uint8_t checked = (uint8_t)(length - CHECKSUM);
    if (read_u32(bytes + checked) != crc32_of(bytes, checked)) {
        return false;
    }
    const uint8_t *body = bytes + HEADER;
    const uint8_t rest = (uint8_t)(checked - HEADER);
    frame->kind = bytes[1];
    frame->session = read_u16(bytes + 2);
    frame->sequence = read_u16(bytes + 4);
    switch (frame->kind) {
    case FRAME_COMMAND:
        return read_command(body, rest, frame);
    case FRAME_HEARTBEAT:
        return rest == 0U;
    case FRAME_STOP:
    case FRAME_ARM:
        if (rest != 1U) {
            return false;
        }
        frame->robot = body[0];
        return true;
    default:
        return false;
    }
}

static uint8_t *write_header(uint8_t *bytes, uint8_t kind, uint16_t session, uint16_t sequence)
{
    bytes[0] = FRAME_MARK;
    bytes[1] = kind;
    return write_u16(write_u16(bytes + 2, session), sequence);
}

static uint8_t seal(uint8_t *bytes, const uint8_t *end)
{
    const uint8_t checked = (uint8_t)(end - bytes);
    (void)write_u32(bytes + checked, crc32_of(bytes, checked));
    return (uint8_t)(checked + CHECKSUM);
}

uint8_t frame_encode_telemetry(const struct telemetry *telemetry, uint8_t *bytes)
{
    uint8_t *at = write_header(bytes, FRAME_TELEMETRY, telemetry->session, telemetry->sequence);
    at[0] = telemetry->robot;
    at[1] = telemetry->state;
    at[2] = telemetry->flags;
    at = write_u16(at + 3, telemetry->last_sequence);
    at = write_u16(at, telemetry->hold);
    for (uint8_t k = 0; k < 2U; k++) {
        at = write_u32(at, (uint32_t)telemetry->counts[k]);
    }
    for (uint8_t k = 0; k < 2U; k++) {
        at = write_u16(at, (uint16_t)telemetry->speeds[k]);
    }
    for (uint8_t k = 0; k < 4U; k++) {
        at = write_u16(at, telemetry->ranges[k]);
    }
    at = write_u16(at, telemetry->battery);
    at = write_u16(at, telemetry->taken);
    at = write_u16(at, telemetry->refused);
    return seal(bytes, at);
}

uint8_t frame_encode_acknowledgement(const struct acknowledgement *answer, uint8_t *bytes)
{
    uint8_t *at =
        write_header(bytes, FRAME_ACKNOWLEDGEMENT, answer->session, answer->sequence);
    at[0] = answer->robot;
    at[1] = answer->kind;
    at = write_u16(at + 2, answer->acknowledged);
    at[0] = answer->state;
    return seal(bytes, at + 1);
}

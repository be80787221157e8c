#include "xbee.h"

#define START 0x7EU
#define ESCAPE 0x7DU
#define FLIPPED 0x20U
#define SEND_64 0x00U
#define RECEIVE_64 0x80U

enum { WAITING = 0, LENGTH_HIGH, LENGTH_LOW, DATA, CHECKSUM };

bool xbee_take(struct xbee_parser *parser, uint8_t byte)
{
    if (byte == START) {
        parser->state = LENGTH_HIGH;
        parser->escaped = false;
        return false;
    }
    if (parser->state == (uint8_t)WAITING) {
        return false;
    }
    if (byte == ESCAPE) {
        parser->escaped = true;
        return false;
    }
    if (parser->escaped) {
        byte ^= FLIPPED;
        parser->escaped = false;
    }
    switch (parser->state) {
    case LENGTH_HIGH:
        parser->state = (byte == 0U) ? (uint8_t)LENGTH_LOW : (uint8_t)WAITING;
        return false;
    case LENGTH_LOW:
        parser->length = byte;
        parser->taken = 0;
        parser->sum = 0;
        parser->state =
            ((byte > 0U) && (byte <= XBEE_MOST_DATA)) ? (uint8_t)DATA : (uint8_t)WAITING;
        return false;
    case DATA:
        parser->data[parser->taken] = byte;
        parser->taken++;
        parser->sum = (uint8_t)(parser->sum + byte);
        if (parser->taken == parser->length) {
            parser->state = CHECKSUM;
        }
        return false;
    default:
        parser->state = WAITING;
        return (uint8_t)(parser->sum + byte) == 0xFFU;
    }
}

bool xbee_received(const struct xbee_parser *parser, const uint8_t **source,
                   const uint8_t **payload, uint8_t *length)
{
    if ((parser->data[0] != RECEIVE_64) || (parser->length <= XBEE_RECEIVE_HEADER)) {
        return false;
    }
    *source = parser->data + 1;
    *payload = parser->data + XBEE_RECEIVE_HEADER;
    *length = (uint8_t)(parser->length - XBEE_RECEIVE_HEADER);
    return true;
}

static uint8_t *put(uint8_t *at, uint8_t byte)
{
    if ((byte == START) || (byte == ESCAPE) || (byte == 0x11U) || (byte == 0x13U)) {
        at[0] = ESCAPE;
        at[1] = byte ^ FLIPPED;
        return at + 2;
    }
    at[0] = byte;
    return at + 1;
}

uint8_t xbee_send_request(const uint8_t *address, const uint8_t *payload, uint8_t length,
                          uint8_t *serial)
{
    uint8_t *at = serial;
    uint8_t sum = 0;
    at[0] = START;
    at = put(at + 1, 0);
    at = put(at, (uint8_t)(XBEE_RECEIVE_HEADER + length));
    at = put(at, SEND_64);
    at = put(at, 0); /* frame id 0: no status report */
    for (uint8_t k = 0; k < XBEE_ADDRESS; k++) {
        at = put(at, address[k]);
        sum = (uint8_t)(sum + address[k]);
    }
    at = put(at, 0); /* options: acknowledged by the other module */
    for (uint8_t k = 0; k < length; k++) {
        at = put(at, payload[k]);
        sum = (uint8_t)(sum + payload[k]);
    }
    at = put(at, (uint8_t)(0xFFU - sum));
    return (uint8_t)(at - serial);
}

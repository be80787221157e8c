/* The serial side of an XBee module in API mode 2 (escaped): 0x7E, length, data, checksum. In this
 * mode 0x7E only ever begins a frame, so that lost bytes cost one frame and no more. */
#ifndef XBEE_H
#define XBEE_H

#include <stdbool.h>
#include <stdint.h>

#define XBEE_ADDRESS 8U
#define XBEE_RECEIVE_HEADER 11U
#define XBEE_MOST_DATA 111U
/* Of a whole frame with 100 bytes of payload, every byte after the first escaped. */
#define XBEE_MOST_SERIAL 231U

struct xbee_parser {
    uint8_t state;
    bool escaped;
    uint8_t length;
    uint8_t taken;
    uint8_t sum;
    uint8_t data[XBEE_MOST_DATA];
};

/* Take a byte from the module; true when it ends a frame whose checksum is right. */
bool xbee_take(struct xbee_parser *parser, uint8_t byte);

/* After that: whether the frame is a received packet (0x80, 64-bit source address). If so,
 * `source`, of XBEE_ADDRESS bytes, and `payload` point into the parser. */
bool xbee_received(const struct xbee_parser *parser, const uint8_t **source,
                   const uint8_t **payload, uint8_t *length);

/* Write the request (0x00) to send a payload to a 64-bit address, without a status report, into
 * XBEE_MOST_SERIAL bytes; returns its length. */
uint8_t xbee_send_request(const uint8_t *address, const uint8_t *payload, uint8_t length,
                          uint8_t *serial);

#endif

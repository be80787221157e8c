/* USART0 to the XBee module: 57600 baud, 8N1, both ways by interrupt. */
#ifndef UART_H
#define UART_H

#include <stdbool.h>
#include <stdint.h>

void uart_start(void);

/* Next byte received, if there is one. */
bool uart_take(uint8_t *byte);

bool uart_waits(void);

/* Queue bytes to send; all or, where there is no room, none. */
void uart_send(const uint8_t *bytes, uint8_t length);

#endif

#include "uart.h"

#include <avr/interrupt.h>
#include <avr/io.h>

/* Twice 256 bytes: indices go round by themselves. */
static volatile uint8_t received[256];
static volatile uint8_t received_head;
static volatile uint8_t received_tail;
static volatile uint8_t sent[256];
static volatile uint8_t sent_head;
static volatile uint8_t sent_tail;

ISR(USART0_RX_vect)
{
    const uint8_t byte = UDR0;
    const uint8_t next = (uint8_t)(received_head + 1U);
    if (next != received_tail) {
        received[received_head] = byte;
        received_head = next;
    }
}

ISR(USART0_UDRE_vect)
{
    if (sent_head == sent_tail) {
        UCSR0B &= (uint8_t)~_BV(UDRIE0);
    } else {
        UDR0 = sent[sent_tail];
        sent_tail++;
    }
}

void uart_start(void)
{
    UCSR0A = (uint8_t)_BV(U2X0);
    UCSR0C = (uint8_t)(_BV(UCSZ01) | _BV(UCSZ00));
    UBRR0 = 34; /* 57143 baud with double speed, 0.8% slow */
    UCSR0B = (uint8_t)(_BV(RXCIE0) | _BV(RXEN0) | _BV(TXEN0));
}

bool uart_waits(void)
{
    return received_head != received_tail;
}

bool uart_take(uint8_t *byte)
{
    if (received_head == received_tail) {
        return false;
    }
    *byte = received[received_tail];
    received_tail++;
    return true;
}

void uart_send(const uint8_t *bytes, uint8_t length)
{
    const uint8_t room = (uint8_t)(255 - (uint8_t)(sent_head - sent_tail));
    if (length > room) {
        return;
    }
    for (uint8_t k = 0; k < length; k++) {
        sent[sent_head] = bytes[k];
        sent_head++;
    }
    UCSR0B |= (uint8_t)_BV(UDRIE0);
}

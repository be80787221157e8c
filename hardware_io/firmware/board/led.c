#include "led.h"

#include <avr/io.h>

void led_start(void)
{
    led_set(false);
    DDRB |= (uint8_t)_BV(PB7);
}

void led_set(bool lit)
{
    if (lit) {
        PORTB |= (uint8_t)_BV(PB7);
    } else {
        PORTB &= (uint8_t)~_BV(PB7);
    }
}

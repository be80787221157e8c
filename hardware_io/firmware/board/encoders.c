#include "encoders.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <stdbool.h>
#include <util/atomic.h>

static volatile int32_t left;
static volatile int32_t right;

/* Forward, B follows A: after an edge of A the two differ. */
ISR(INT4_vect)
{
    const bool a = (PINE & _BV(PE4)) != 0;
    const bool b = (PINA & _BV(PA0)) != 0;
    left += (a != b) ? 1 : -1;
}

ISR(INT5_vect)
{
    const bool a = (PINE & _BV(PE5)) != 0;
    const bool b = (PINA & _BV(PA1)) != 0;
    right += (a != b) ? 1 : -1;
}

void encoders_start(void)
{
    PORTE |= (uint8_t)(_BV(PE4) | _BV(PE5));
    PORTA |= (uint8_t)(_BV(PA0) | _BV(PA1));
    EICRB = (uint8_t)(_BV(ISC40) | _BV(ISC50));
    EIFR = (uint8_t)(_BV(INTF4) | _BV(INTF5));
    EIMSK |= (uint8_t)(_BV(INT4) | _BV(INT5));
}

void encoders_read(int32_t counts[2])
{
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        counts[0] = left;
        counts[1] = right;
    }
}

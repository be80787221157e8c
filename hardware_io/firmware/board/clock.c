#include "clock.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <util/atomic.h>

#include "robot.h"

#define COUNTS_PER_MS (F_CPU / 64UL / 1000UL)

static volatile uint16_t ticks;
static volatile uint8_t waiting;

ISR(TIMER3_COMPA_vect)
{
    ticks++;
    waiting++;
}

void clock_start(void)
{
    OCR3A = (uint16_t)((COUNTS_PER_MS * TICK_MS) - 1U);
    TCCR3A = 0;
    TCCR3B = (uint8_t)(_BV(WGM32) | _BV(CS31) | _BV(CS30));
    TIMSK3 = (uint8_t)_BV(OCIE3A);
}

bool clock_tick_waits(void)
{
    return waiting != 0U;
}

bool clock_take_tick(void)
{
    bool taken = false;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        if (waiting != 0U) {
            waiting--;
            taken = true;
        }
    }
    return taken;
}

uint16_t clock_ms(void)
{
    uint16_t whole = 0;
    uint16_t part = 0;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        whole = ticks;
        part = TCNT3;
        if ((TIFR3 & _BV(OCF3A)) != 0U) { /* the tick of this round is still to be counted */
            whole++;
            part = 0;
        }
    }
    return (uint16_t)((whole * TICK_MS) + (part / COUNTS_PER_MS));
}

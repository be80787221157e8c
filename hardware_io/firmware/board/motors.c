#include "motors.h"

#include <avr/io.h>

#include "portable/speed_loop.h"

#define LEFT_AHEAD ((uint8_t)_BV(PA2))
#define LEFT_BACK ((uint8_t)_BV(PA3))
#define RIGHT_AHEAD ((uint8_t)_BV(PA4))
#define RIGHT_BACK ((uint8_t)_BV(PA5))
#define STANDBY ((uint8_t)_BV(PA6))
#define DIRECTIONS ((uint8_t)(LEFT_AHEAD | LEFT_BACK | RIGHT_AHEAD | RIGHT_BACK))

void motors_start(void)
{
    PORTB &= (uint8_t) ~(_BV(PB5) | _BV(PB6));
    DDRB |= (uint8_t)(_BV(PB5) | _BV(PB6));
    PORTA &= (uint8_t) ~(DIRECTIONS | STANDBY);
    DDRA |= (uint8_t)(DIRECTIONS | STANDBY);
    ICR1 = (uint16_t)(DUTY_TOP - 1);
    TCCR1A = (uint8_t)_BV(WGM11);
    TCCR1B = (uint8_t)(_BV(WGM13) | _BV(WGM12) | _BV(CS10));
    motors_set(0, 0);
    PORTA |= STANDBY;
}

void motors_set(int16_t left, int16_t right)
{
    uint8_t control = (uint8_t)_BV(WGM11);
    uint8_t directions = 0;
    /* A compare value of 0 would still give a spike in every period: without power the pin is
     * taken from the timer, and stays low. */
    if (left != 0) {
        control |= (uint8_t)_BV(COM1A1);
        directions = (uint8_t)(directions | ((left > 0) ? LEFT_AHEAD : LEFT_BACK));
        OCR1A = (uint16_t)(((left > 0) ? left : -left) - 1);
    } else {
        directions = LEFT_AHEAD | LEFT_BACK;
    }
    if (right != 0) {
        control |= (uint8_t)_BV(COM1B1);
        directions = (uint8_t)(directions | ((right > 0) ? RIGHT_AHEAD : RIGHT_BACK));
        OCR1B = (uint16_t)(((right > 0) ? right : -right) - 1);
    } else {
        directions = (uint8_t)(directions | RIGHT_AHEAD | RIGHT_BACK);
    }
    TCCR1A = control;
    PORTA = (uint8_t)((PORTA & (uint8_t)~DIRECTIONS) | directions);
}

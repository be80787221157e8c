#include "analog.h"

#include <avr/io.h>

#include "robot.h"

#define CHANNELS 5U
#define BATTERY 4U

static uint16_t readings[CHANNELS];
static uint8_t channel;

static void begin(void)
{
    ADMUX = (uint8_t)(_BV(REFS0) | channel);
    ADCSRA |= (uint8_t)_BV(ADSC);
}

void analog_start(void)
{
    /* 125 kHz: a conversion takes a tenth of a millisecond. */
    ADCSRA = (uint8_t)(_BV(ADEN) | _BV(ADPS2) | _BV(ADPS1) | _BV(ADPS0));
    begin();
}

void analog_step(void)
{
    if ((ADCSRA & _BV(ADSC)) != 0U) {
        return;
    }
    readings[channel] = ADC;
    channel = (uint8_t)((channel + 1U) % CHANNELS);
    begin();
}

uint16_t analog_range(uint8_t sensor)
{
    const int16_t reading = (int16_t)readings[sensor] - IR_OFFSET;
    if (reading <= 0) {
        return IR_REACH;
    }
    const int32_t range = ((IR_SLOPE + (reading / 2)) / reading) - IR_RECESS;
    if (range < 0) {
        return 0;
    }
    return (range > IR_REACH) ? IR_REACH : (uint16_t)range;
}

uint16_t analog_battery(void)
{
    return (uint16_t)(((uint32_t)readings[BATTERY] * 625UL) / 64UL);
}

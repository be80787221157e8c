/* The converter: infrared sensors on ADC0 to ADC3 (A0 to A3), the battery's divider on ADC4. */
#ifndef ANALOG_H
#define ANALOG_H

#include <stdint.h>

void analog_start(void);

/* Take the reading that is ready and start the next channel's; call it once a tick. */
void analog_step(void);

/* Free way before a sensor [mm], IR_REACH at most; sensors 0 to 3 from left to right. */
uint16_t analog_range(uint8_t sensor);

/* [mV]. */
uint16_t analog_battery(void);

#endif

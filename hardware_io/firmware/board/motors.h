/* Two motors on a TB6612FNG: PWM at 20 kHz from timer 1 (left OC1A = D11, right OC1B = D12),
 * direction on PA2, PA3 (D24, D25) and PA4, PA5 (D26, D27), standby on PA6 (D28). */
#ifndef MOTORS_H
#define MOTORS_H

#include <stdint.h>

void motors_start(void);

/* Power from -DUTY_TOP to DUTY_TOP; at zero the driver shorts the motor, which brakes it. */
void motors_set(int16_t left, int16_t right);

#endif

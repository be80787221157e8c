/* Quadrature encoders: channel A of the left wheel on INT4 (D2) and of the right on INT5 (D3),
 * channel B on PA0 (D22) and PA1 (D23). Both edges of A are counted. */
#ifndef ENCODERS_H
#define ENCODERS_H

#include <stdint.h>

void encoders_start(void);

/* Counts since the start; forward is positive. */
void encoders_read(int32_t counts[2]);

#endif

/* The board's own lamp, on PB7 (D13). */
#ifndef LED_H
#define LED_H

#include <stdbool.h>

void led_start(void);

void led_set(bool lit);

#endif

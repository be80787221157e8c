/* The robot: hears frames, follows the fresh ones, reports, and stops where it hears nothing. */
#include <avr/eeprom.h>
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/wdt.h>

#include "board/analog.h"
#include "board/clock.h"
#include "board/led.h"
#include "board/uart.h"
#include "portable/beacon.h"
#include "portable/frames.h"
#include "portable/link.h"
#include "portable/xbee.h"
#include "report.h"
#include "robot.h"
#include "wheels.h"

static struct link radio;
static struct motion motion;
static struct xbee_parser parser;

/* EEPROM byte 0, so that one program serves all robots; 255 is a blank byte. */
static uint8_t robot_id(void)
{
    const uint8_t id = eeprom_read_byte((const uint8_t *)0);
    return (id == 0xFFU) ? (uint8_t)ROBOT_ID : id;
}

static void hear(uint8_t byte)
{
    static struct frame frame;
    const uint8_t *source;
    const uint8_t *payload;
    uint8_t length;
    if (!xbee_take(&parser, byte) || !xbee_received(&parser, &source, &payload, &length)) {
        return;
    }
    if (!frame_decode(payload, length, &frame)) {
        link_refuse(&radio);
    } else if (link_take(&radio, &frame, clock_ms())) {
        if (frame.kind == (uint8_t)FRAME_ARM) {
            wheels_release(&motion);
        }
        /* Whoever arms or stops the robot is the one to report to. */
        report_to(source);
        report_acknowledgement(&radio, &frame);
    } else {
        /* Nothing to answer. */
    }
}

static void tick(void)
{
    static uint16_t since_report;
    int16_t speeds[2];
    const uint16_t now = clock_ms();
    link_tick(&radio, now);
    link_wheel_speeds(&radio, speeds);
    wheels_step(speeds, &motion);
    led_set(beacon_lit(radio.state, wheels_are_cut_off(&motion), now));
    analog_step();
    since_report += TICK_MS;
    if (since_report >= TELEMETRY_PERIOD_MS) {
        since_report = 0;
        report_telemetry(&radio, &motion, now);
    }
}

int main(void)
{
    if ((MCUSR & _BV(WDRF)) != 0U) {
        motion.flags |= FLAG_WATCHDOG_RESET;
    }
    MCUSR = 0;
    wdt_enable(WDTO_60MS);
    led_start();
    wheels_start();
    link_reset(&radio, robot_id());
    analog_start();
    uart_start();
    clock_start();
    SMCR = 0; /* sleep is idle: everything but the processor goes on */
    for (;;) {
        uint8_t byte;
        sei();
        if (uart_take(&byte)) {
            hear(byte);
        }
        /* Only here is the watchdog fed: ticks must come and bytes must not crowd them out. */
        if (clock_take_tick()) {
            wdt_reset();
            tick();
        }
        cli();
        if (!clock_tick_waits() && !uart_waits()) {
            sleep_enable();
            sei(); /* takes effect after the next instruction: no interrupt comes in between */
            sleep_cpu();
            sleep_disable();
        }
    }
}

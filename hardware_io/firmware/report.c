#include "report.h"

#include <string.h>

#include "board/analog.h"
#include "board/uart.h"
#include "portable/xbee.h"
#include "robot.h"

/* Where reports go: at first to all. */
static uint8_t station[XBEE_ADDRESS] = {0, 0, 0, 0, 0, 0, 0xFF, 0xFF};

static uint16_t sequence;

void report_to(const uint8_t *address)
{
    (void)memcpy(station, address, XBEE_ADDRESS);
}

static void transmit(const uint8_t *payload, uint8_t length)
{
    static uint8_t serial[XBEE_MOST_SERIAL];
    uart_send(serial, xbee_send_request(station, payload, length, serial));
    sequence++;
}

void report_telemetry(const struct link *link, const struct motion *motion, uint16_t now)
{
    struct telemetry telemetry = {0};
    uint8_t payload[FRAME_MOST_BYTES];
    telemetry.session = link->session;
    telemetry.sequence = sequence;
    telemetry.robot = link->robot;
    telemetry.state = link->state;
    telemetry.last_sequence = link->sequence;
    telemetry.hold = (uint16_t)(now - link->heard);
    telemetry.battery = analog_battery();
    telemetry.flags = motion->flags;
    if (telemetry.battery < LOW_BATTERY_MV) {
        telemetry.flags |= FLAG_LOW_BATTERY;
    }
    for (uint8_t k = 0; k < 2U; k++) {
        telemetry.counts[k] = motion->counts[k];
        telemetry.speeds[k] = motion->speeds[k];
    }
    for (uint8_t k = 0; k < 4U; k++) {
        telemetry.ranges[k] = analog_range(k);
    }
    telemetry.taken = link->taken;
    telemetry.refused = link->refused;
    transmit(payload, frame_encode_telemetry(&telemetry, payload));
}

void report_acknowledgement(const struct link *link, const struct frame *frame)
{
    struct acknowledgement answer = {0};
    uint8_t payload[FRAME_MOST_BYTES];
    answer.session = frame->session;
    answer.sequence = sequence;
    answer.robot = link->robot;
    answer.kind = frame->kind;
    answer.acknowledged = frame->sequence;
    answer.state = link->state;
    transmit(payload, frame_encode_acknowledgement(&answer, payload));
}

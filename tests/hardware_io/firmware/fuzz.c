/* fuzz COUNT SEED: feeds noise, damaged and stale frames to the firmware's receiving side, from the
 * serial byte to the wheels' speeds, and aborts if any of it moves the robot or changes whom it
 * listens to. In between, good frames must still be taken. Damaged frames that happen to be whole
 * again are left out. Prints how many frames of each sort were fed. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "portable/crc32.h"
#include "portable/frames.h"
#include "portable/link.h"
#include "portable/xbee.h"

#define ROBOT 3
#define SESSION 0xBEEF

static uint64_t seed;
static struct link radio;
static struct xbee_parser parser;
static uint16_t now = 60000; /* goes round early */
static uint16_t sequence = 65000;
/* The last command that was damaged on the line. Cut short, it may be completed by what follows. */
static uint8_t whole[128];
static int whole_length;

#define CHECK(fact)                                              \
    do {                                                         \
        if (!(fact)) {                                           \
            fprintf(stderr, "line %d: " #fact "\n", __LINE__);   \
            abort();                                             \
        }                                                        \
    } while (0)

static uint32_t draw(uint32_t below)
{
    seed ^= seed << 13;
    seed ^= seed >> 7;
    seed ^= seed << 17;
    return (uint32_t)(seed >> 32) % below;
}

static int make_frame(uint8_t *at, uint8_t kind, uint16_t session, uint16_t number,
                      const uint8_t *body, int length)
{
    const uint8_t header[6] = {FRAME_MARK, kind, session & 255, session >> 8,
                               number & 255, number >> 8};
    memcpy(at, header, 6);
    if (length > 0) {
        memcpy(at + 6, body, (size_t)length);
    }
    const uint32_t crc = crc32_of(at, (uint8_t)(6 + length));
    for (int k = 0; k < 4; k++) {
        at[6 + length + k] = (uint8_t)(crc >> (8 * k));
    }
    return 10 + length;
}

/* Full speed for this robot, among others. */
static int make_command(uint8_t *at, uint16_t session, uint16_t number)
{
    const uint8_t count = (uint8_t)(1 + draw(6));
    uint8_t body[4 + 5 * 6] = {(uint8_t)draw(2), count, 10, 0};
    const uint8_t mine = (uint8_t)draw(count);
    for (uint8_t k = 0; k < count; k++) {
        const uint8_t entry[5] = {k == mine ? ROBOT : 10 + k, 0x2C, 1, 0, 0};
        memcpy(body + 4 + 5 * k, entry, 5);
    }
    return make_frame(at, FRAME_COMMAND, session, number, body, 4 + 5 * count);
}

/* The serial bytes of a received packet. */
static int wrap(uint8_t *serial, const uint8_t *payload, int length)
{
    uint8_t data[160] = {0x80, 0, 0x13, 0xA2, 0, 0x40, 0, 0, 0, 40, 2};
    uint8_t plain[170];
    uint8_t sum = 0xFF;
    int out = 0;
    memcpy(data + 11, payload, (size_t)length);
    plain[0] = 0;
    plain[1] = (uint8_t)(11 + length);
    memcpy(plain + 2, data, (size_t)(11 + length));
    for (int k = 0; k < 11 + length; k++) {
        sum = (uint8_t)(sum - data[k]);
    }
    plain[13 + length] = sum;
    serial[out++] = 0x7E;
    for (int k = 0; k < 14 + length; k++) {
        if (plain[k] == 0x7E || plain[k] == 0x7D || plain[k] == 0x11 || plain[k] == 0x13) {
            serial[out++] = 0x7D;
            serial[out++] = plain[k] ^ 0x20;
        } else {
            serial[out++] = plain[k];
        }
    }
    return out;
}

static int damage(uint8_t *bytes, int length, int room)
{
    for (int times = 1 + (int)draw(4); times > 0; times--) {
        const int at = (int)draw((uint32_t)length);
        switch (draw(5)) {
        case 0:
            bytes[at] ^= (uint8_t)(1U << draw(8));
            break;
        case 1:
            bytes[at] = (uint8_t)draw(256);
            break;
        case 2:
            length = at > 0 ? at : 1;
            break;
        case 3:
            if (length < room) {
                memmove(bytes + at + 1, bytes + at, (size_t)(length - at));
                bytes[at] = (uint8_t)draw(256);
                length++;
            }
            break;
        default:
            bytes[at] = bytes[draw((uint32_t)length)];
            break;
        }
    }
    return length;
}

/* Feed serial bytes; a payload that is whole again is passed over. */
static void feed(const uint8_t *serial, int length)
{
    static struct frame frame;
    const uint8_t *source;
    const uint8_t *payload;
    uint8_t size;
    for (int k = 0; k < length; k++) {
        if (!xbee_take(&parser, serial[k]) || !xbee_received(&parser, &source, &payload, &size)) {
            continue;
        }
        if (size == whole_length && memcmp(payload, whole, size) == 0) {
            continue;
        }
        if (!frame_decode(payload, size, &frame)) {
            link_refuse(&radio);
        } else {
            (void)link_take(&radio, &frame, now);
        }
    }
}

static void feed_frame(const uint8_t *payload, int length)
{
    uint8_t serial[400];
    feed(serial, wrap(serial, payload, length));
}

static bool moves(void)
{
    int16_t speeds[2];
    link_wheel_speeds(&radio, speeds);
    return speeds[0] != 0 || speeds[1] != 0;
}

/* Good frames are taken, and the robot stops when they end. */
static void drive_and_stop(void)
{
    uint8_t payload[128];
    const uint8_t everyone = FRAME_EVERYONE;
    if (draw(2)) {
        feed_frame(payload, make_frame(payload, FRAME_STOP, SESSION, ++sequence, &everyone, 1));
        CHECK(radio.state == LINK_STOPPED);
        feed_frame(payload, make_command(payload, SESSION, ++sequence));
        CHECK(!moves());
        feed_frame(payload, make_frame(payload, FRAME_ARM, SESSION, ++sequence, &everyone, 1));
        CHECK(radio.state == LINK_IDLE);
    }
    feed_frame(payload, make_command(payload, SESSION, ++sequence));
    CHECK(radio.state == LINK_DRIVING && moves());
    now = (uint16_t)(now + 200);
    link_tick(&radio, now);
    CHECK(radio.state == LINK_LOST && !moves());
    feed_frame(payload, make_frame(payload, FRAME_HEARTBEAT, SESSION, ++sequence, NULL, 0));
    link_tick(&radio, now);
    CHECK(radio.state == LINK_IDLE && !moves());
}

int main(int argc, char **argv)
{
    long fed[6] = {0};
    const uint8_t everyone = FRAME_EVERYONE;
    uint8_t payload[128], serial[400], intact[128];
    CHECK(argc == 3);
    seed = 0x9E3779B97F4A7C15ULL + strtoull(argv[2], NULL, 10);
    link_reset(&radio, ROBOT);
    feed_frame(payload, make_frame(payload, FRAME_ARM, SESSION, sequence, &everyone, 1));
    CHECK(radio.state == LINK_IDLE);
    for (long n = 0, end = strtol(argv[1], NULL, 10); n < end; n++) {
        if (n % 1000 == 0) {
            drive_and_stop();
        }
        const uint16_t taken = radio.taken;
        const uint32_t sort = draw(6);
        int length;
        fed[sort]++;
        switch (sort) {
        case 0: /* noise on the line */
            length = (int)draw(160);
            for (int k = 0; k < length; k++) {
                serial[k] = draw(8) ? (uint8_t)draw(256) : 0x7E;
            }
            feed(serial, length);
            break;
        case 1: /* noise in a packet */
            length = (int)draw(111);
            for (int k = 0; k < length; k++) {
                payload[k] = (uint8_t)draw(256);
            }
            feed_frame(payload, length);
            break;
        case 2: /* a command that would be taken, damaged in the air */
            length = make_command(payload, SESSION, (uint16_t)(sequence + 1 + draw(1000)));
            memcpy(intact, payload, (size_t)length);
            const int left = damage(payload, length, 111);
            if (left != length || memcmp(payload, intact, (size_t)length) != 0) {
                feed_frame(payload, left);
            }
            break;
        case 3: /* one damaged on the line */
            whole_length = make_command(whole, SESSION, (uint16_t)(sequence + 1 + draw(1000)));
            feed(serial, damage(serial, wrap(serial, whole, whole_length), 399));
            break;
        case 4: /* an old one, or the last once more */
            feed_frame(payload,
                       make_command(payload, SESSION, (uint16_t)(sequence - draw(0x8000))));
            break;
        default: /* another work station's */
            feed_frame(payload,
                       make_command(payload, (uint16_t)(SESSION + 1 + draw(65535)),
                                    (uint16_t)draw(65536)));
            break;
        }
        CHECK(!moves());
        CHECK(radio.session == SESSION && radio.sequence == sequence && radio.taken == taken);
        CHECK(radio.state == LINK_IDLE || radio.state == LINK_LOST);
        now = (uint16_t)(now + draw(30));
        link_tick(&radio, now);
    }
    drive_and_stop();
    for (int k = 0; k < 6; k++) {
        printf("%ld\n", fed[k]);
    }
    return 0;
}

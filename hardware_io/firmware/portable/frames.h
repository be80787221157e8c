/* Frames between work station and robots; hardware_io/kinds/xbee_frames.py tells their layout. */
#ifndef FRAMES_H
#define FRAMES_H

#include <stdbool.h>
#include <stdint.h>

#define FRAME_MARK 0x51U
#define FRAME_EVERYONE 255U
#define FRAME_MOST_ENTRIES 16U
#define FRAME_MOST_BYTES 100U

enum frame_kind {
    FRAME_COMMAND = 1,
    FRAME_HEARTBEAT = 2,
    FRAME_STOP = 3,
    FRAME_ARM = 4,
    FRAME_TELEMETRY = 5,
    FRAME_ACKNOWLEDGEMENT = 6
};

enum frame_form { FORM_WHEELS = 0, FORM_TWIST = 1 };

/* Command to one robot: [mm/s] and [mm/s], or [mm/s] and [mrad/s]. */
struct frame_entry {
    uint8_t robot;
    int16_t first;
    int16_t second;
};

/* A frame to robots; which of the later fields hold depends on the kind. */
struct frame {
    uint8_t kind;
    uint16_t session;
    uint16_t sequence;
    uint8_t robot; /* of stop and arm */
    uint8_t form;  /* from here on: of commands */
    uint8_t count;
    uint16_t age;
    struct frame_entry entries[FRAME_MOST_ENTRIES];
};

struct telemetry {
    uint16_t session;
    uint16_t sequence;
    uint8_t robot;
    uint8_t state;
    uint8_t flags;
    uint16_t last_sequence;
    uint16_t hold;
    int32_t counts[2];
    int16_t speeds[2];
    uint16_t ranges[4];
    uint16_t battery;
    uint16_t taken;
    uint16_t refused;
};

struct acknowledgement {
    uint16_t session;
    uint16_t sequence;
    uint8_t robot;
    uint8_t kind;
    uint16_t acknowledged;
    uint8_t state;
};

/* Whether the bytes are a command, a heartbeat, a stop or an arm; if not, `frame` means nothing. */
bool frame_decode(const uint8_t *bytes, uint8_t length, struct frame *frame);

/* Write a frame to the work station, into FRAME_MOST_BYTES; returns its length. */
uint8_t frame_encode_telemetry(const struct telemetry *telemetry, uint8_t *bytes);
uint8_t frame_encode_acknowledgement(const struct acknowledgement *answer, uint8_t *bytes);

#endif

// Generated from firmware/messages.toml by firmware/generate_messages.py: edit the table, not this.
#pragma once
#include <stdint.h>

#define PROTOCOL_VERSION 1
#define BAUD 115200u
#define FRAME_BYTES_MAX 48
#define FRAME_GAP_MS 20
#define SEQUENCE_WINDOW 16
#define CHANNELS_MAX 4
#define COUNT_SCALE 64
#define SUPPLY_SCALE 16
#define ADC_FULL_SCALE 1024
#define SENSOR_LOW_COUNTS 41
#define SENSOR_HIGH_COUNTS 982
#define TRIP_SAMPLES 3
#define HANG_MS 30
#define DEFAULT_PRESSURE_LOW_COUNTS 266
#define DEFAULT_PRESSURE_HIGH_COUNTS 758
#define DEFAULT_PULSE_MS 5000
#define DEFAULT_SILENCE_MS 400
#define DEFAULT_CHANNELS 2

// What the pump does; forward presses fluid into the right chamber
enum Direction : int8_t {
  DIRECTION_REVERSE = -1,  // into the left chamber
  DIRECTION_OFF = 0,  // stopped
  DIRECTION_FORWARD = 1,  // into the right chamber
};

// What became of a command
enum Status : uint8_t {
  STATUS_OK = 0,  // executed
  STATUS_OUT_OF_RANGE = 1,  // a field is outside its range or outside the limits in force; nothing was done
  STATUS_BUSY = 2,  // a pulse is still running; nothing was done
  STATUS_FAULT_LATCHED = 3,  // a fault is latched and this direction would not relieve it; nothing was done
  STATUS_UNKNOWN = 4,  // this firmware does not know the message; nothing was done
  STATUS_NO_SESSION = 5,  // the board started anew; say hello first
  STATUS_STALE_SEQUENCE = 6,  // the sequence number is outside the window: a late duplicate; nothing was done
  STATUS_CONDITION_PERSISTS = 7,  // the cause of the fault is still there; nothing was cleared
};

// Why the pump was stopped; a bit stays set until it is cleared
enum Fault : uint16_t {
  FAULT_OVER_PRESSURE = 1,  // a branch is above its upper limit
  FAULT_UNDER_PRESSURE = 2,  // a branch is below its lower limit
  FAULT_SENSOR_LOW = 4,  // a sensor reads below 0.2 V: open wire or short to ground
  FAULT_SENSOR_HIGH = 8,  // a sensor reads above 4.8 V: saturated or short to the supply
  FAULT_SILENCE = 16,  // the pump ran and no valid frame came for the silence limit
  FAULT_HUNG_LOOP = 32,  // the board's main loop hung; it was stopped and the watchdog restarted it
  FAULT_RESET_WHILE_PUMPING = 64,  // the board restarted while the pump ran: power dip, reset button or watchdog
};

// Why a pulse ended
enum EndReason : uint8_t {
  END_REASON_NONE = 0,  // no pulse has ended since the board started, or one is running
  END_REASON_COMPLETED = 1,  // the whole duration was run
  END_REASON_STOPPED = 2,  // the host said stop or hello
  END_REASON_FAULT = 3,  // a fault stopped it
  END_REASON_NEUTRAL_REACHED = 4,  // a pulse allowed under a fault came back to neutral
};

// Begins a session: stops the pump, takes this frame's sequence number as the start, answers with identity and limits
#define MSG_HELLO 0x01
struct __attribute__((packed)) HelloMessage {
  uint8_t protocol;  // protocol version of the host
};

// Tells the board that the host is alive; any valid frame does
#define MSG_PING 0x02

// Runs the pump once, for a bounded time
#define MSG_PULSE 0x03
struct __attribute__((packed)) PulseMessage {
  int8_t direction;  // see Direction
  uint8_t duty;  // pulse width [1/255]
  uint16_t duration_ms;  // [ms]
};

// Stops the pump at once; accepted in any state and out of sequence
#define MSG_STOP 0x04

// Sets the interval of the samples; each is the mean over the interval
#define MSG_STREAM 0x05
struct __attribute__((packed)) StreamMessage {
  uint8_t period_ms;  // [ms], 0 stops the stream; values 1 to 4 are refused
};

// Sets the limits of the pump; the board answers with Limits
#define MSG_LIMIT_PUMP 0x06
struct __attribute__((packed)) LimitPumpMessage {
  uint8_t max_duty;  // [1/255]
  uint16_t max_pulse_ms;  // [ms]
  uint16_t silence_ms;  // [ms] pump off when no valid frame came for this long
  uint8_t channels;  // pressure inputs in use, 2 or 4
};

// Sets the limits of one pressure input; the board answers with Limits
#define MSG_LIMIT_PRESSURE 0x07
struct __attribute__((packed)) LimitPressureMessage {
  uint8_t channel;  // 0 right, 1 left, 2 and 3 of the second finger
  uint16_t low_counts;  // [count] under-pressure below
  uint16_t high_counts;  // [count] over-pressure above; must exceed low_counts
};

// Clears the latched faults, unless a cause persists
#define MSG_CLEAR_FAULTS 0x08

// Declares the present state neutral: the travel that relief pulses run back is zero here
#define MSG_SET_NEUTRAL 0x09

// Hangs the main loop, in test builds only
#define MSG_TEST_HANG 0x7e
struct __attribute__((packed)) TestHangMessage {
  uint8_t interrupts_off;  // 1 hangs with interrupts off
};

// Answers a command; the frame's sequence number is the command's
#define MSG_ACK 0x81
struct __attribute__((packed)) AckMessage {
  uint8_t command;  // id of the command
  uint8_t status;  // see Status
  uint16_t faults;  // latched faults, see Fault
  uint32_t time_ms;  // board time of the execution [ms]
};

// Sent after a start and after Hello
#define MSG_IDENTITY 0x82
struct __attribute__((packed)) IdentityMessage {
  uint8_t protocol;  // protocol version of the board
  uint16_t firmware;  // firmware version, 256 x major + minor
  uint8_t reset_cause;  // MCUSR at start; 0 where the boot loader cleared it
  uint16_t faults;  // latched faults, see Fault
  uint8_t started;  // 1 in the first one after a start
};

// The limits in force, sent after Hello, LimitPump and LimitPressure
#define MSG_LIMITS 0x83
struct __attribute__((packed)) LimitsMessage {
  uint8_t max_duty;  // [1/255]
  uint16_t max_pulse_ms;  // [ms]
  uint16_t silence_ms;  // [ms]
  uint8_t channels;  // pressure inputs in use
  uint16_t low_counts[4];  // [count] of each input
  uint16_t high_counts[4];  // [count] of each input
};

// The state of the bench; the frame's sequence number counts samples
#define MSG_SAMPLE 0x84
struct __attribute__((packed)) SampleMessage {
  uint32_t time_ms;  // board time at the end of the interval [ms]
  uint8_t averaged;  // 1 kHz samples in the mean
  uint16_t pressure[4];  // mean [1/64 count]; 0 where not in use
  uint16_t supply;  // the board's 1.1 V reference against the supply [1/16 count]
  int8_t direction;  // see Direction
  uint8_t duty;  // [1/255]
  uint16_t faults;  // latched faults, see Fault
  uint8_t fault_channels;  // bit i: input i caused a pressure or sensor fault
  uint8_t pulse_sequence;  // sequence number of the last pulse
  uint16_t ran_ms;  // how long the last pulse has run [ms]
  uint8_t end_reason;  // see EndReason
  uint8_t bad_frames;  // frames the board has dropped as damaged, modulo 256
};

// Sent once when a pulse ends; the same facts are in every sample, should it be lost
#define MSG_PULSE_ENDED 0x85
struct __attribute__((packed)) PulseEndedMessage {
  uint32_t time_ms;  // board time of the end [ms]
  uint8_t pulse_sequence;  // sequence number of the pulse
  uint16_t ran_ms;  // how long it ran [ms]
  uint8_t end_reason;  // see EndReason
  uint16_t faults;  // latched faults, see Fault
};

enum PayloadVerdict : uint8_t {
  PAYLOAD_OK,
  PAYLOAD_OUT_OF_RANGE,
  PAYLOAD_WRONG_LENGTH,
  PAYLOAD_UNKNOWN,
};

// Judges the payload of a command to the board by the table.
static inline PayloadVerdict judge_payload(uint8_t id, const uint8_t *payload, uint8_t length) {
  (void)payload;
  switch (id) {
    case MSG_HELLO: {
      if (length != sizeof(HelloMessage)) return PAYLOAD_WRONG_LENGTH;
      const HelloMessage *m = (const HelloMessage *)payload;
      bool out = m->protocol < 1 || m->protocol > 1;
      return out ? PAYLOAD_OUT_OF_RANGE : PAYLOAD_OK;
    }
    case MSG_PING: {
      return length == 0 ? PAYLOAD_OK : PAYLOAD_WRONG_LENGTH;
    }
    case MSG_PULSE: {
      if (length != sizeof(PulseMessage)) return PAYLOAD_WRONG_LENGTH;
      const PulseMessage *m = (const PulseMessage *)payload;
      bool out = m->direction < -1 || m->direction > 1 || m->direction == 0 || m->duty < 1 || m->duration_ms < 1 || m->duration_ms > 10000;
      return out ? PAYLOAD_OUT_OF_RANGE : PAYLOAD_OK;
    }
    case MSG_STOP: {
      return length == 0 ? PAYLOAD_OK : PAYLOAD_WRONG_LENGTH;
    }
    case MSG_STREAM: {
      if (length != sizeof(StreamMessage)) return PAYLOAD_WRONG_LENGTH;
      const StreamMessage *m = (const StreamMessage *)payload;
      bool out = m->period_ms > 250;
      return out ? PAYLOAD_OUT_OF_RANGE : PAYLOAD_OK;
    }
    case MSG_LIMIT_PUMP: {
      if (length != sizeof(LimitPumpMessage)) return PAYLOAD_WRONG_LENGTH;
      const LimitPumpMessage *m = (const LimitPumpMessage *)payload;
      bool out = m->max_duty < 1 || m->max_pulse_ms < 1 || m->max_pulse_ms > 10000 || m->silence_ms < 50 || m->silence_ms > 450 || m->channels < 2 || m->channels > 4;
      return out ? PAYLOAD_OUT_OF_RANGE : PAYLOAD_OK;
    }
    case MSG_LIMIT_PRESSURE: {
      if (length != sizeof(LimitPressureMessage)) return PAYLOAD_WRONG_LENGTH;
      const LimitPressureMessage *m = (const LimitPressureMessage *)payload;
      bool out = m->channel > 3 || m->low_counts < 41 || m->low_counts > 982 || m->high_counts < 41 || m->high_counts > 982;
      return out ? PAYLOAD_OUT_OF_RANGE : PAYLOAD_OK;
    }
    case MSG_CLEAR_FAULTS: {
      return length == 0 ? PAYLOAD_OK : PAYLOAD_WRONG_LENGTH;
    }
    case MSG_SET_NEUTRAL: {
      return length == 0 ? PAYLOAD_OK : PAYLOAD_WRONG_LENGTH;
    }
#ifdef TEST_HOOKS
    case MSG_TEST_HANG: {
      if (length != sizeof(TestHangMessage)) return PAYLOAD_WRONG_LENGTH;
      const TestHangMessage *m = (const TestHangMessage *)payload;
      bool out = m->interrupts_off > 1;
      return out ? PAYLOAD_OUT_OF_RANGE : PAYLOAD_OK;
    }
#endif
    default: return PAYLOAD_UNKNOWN;
  }
}

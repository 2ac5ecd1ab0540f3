#include "bench.h"

#include <string.h>

#include "frame.h"
#include "hal.h"
#include "safety.h"

// ---- shared with the tick: read and written with the tick locked out ---------------------------------------
static uint32_t now_ms;
static uint16_t silence, limit_silence_ms;  // [ms] since the last valid frame
static uint8_t frame_gap;                   // [ms] since the last byte
static uint8_t loop_gap;                    // [ms] since the main loop last came round
static int8_t direction;
static uint8_t duty;
static uint16_t left_ms, ran_ms, faults_at_start;
static uint8_t pulse_sequence, end_reason;
static bool ended_due;
static uint32_t ended_ms;

static uint8_t stream_period, stream_phase;
struct Sums {
  uint32_t time_ms, pressure[CHANNELS_MAX], reference;
  uint8_t count;
};
static Sums running, interval;  // the interval under way, and the last whole one
static bool sample_due;

// ---- main loop only -----------------------------------------------------------------------------------------
static FrameReader reader;
static uint8_t bad_frames, sample_counter;
static LimitsMessage limits;
static bool in_session;
static uint8_t last_sequence;
static uint32_t last_checksum;
static AckMessage ack, last_ack;
static uint8_t ack_sequence;
static bool ack_due, identity_due, limits_due;
static uint8_t cause, just_started;

static void end_pulse(uint8_t reason) {
  hal_pump(DIRECTION_OFF, 0);
  if (direction == DIRECTION_OFF) return;
  direction = DIRECTION_OFF;
  duty = 0;
  end_reason = reason;
  ended_ms = now_ms;
  ended_due = true;
  safety_note_pumping(false);
}

void bench_start(uint8_t reset_cause, bool watchdog) {
  hal_pump(DIRECTION_OFF, 0);
  now_ms = 0;
  silence = frame_gap = loop_gap = 0;
  direction = DIRECTION_OFF;
  duty = 0;
  left_ms = ran_ms = 0;
  pulse_sequence = 0;
  end_reason = END_REASON_NONE;
  ended_due = sample_due = false;
  stream_period = stream_phase = 0;
  memset(&running, 0, sizeof running);
  reader.reset();
  bad_frames = sample_counter = 0;
  in_session = false;
  ack_due = limits_due = false;
  limits.max_duty = 255;
  limits.max_pulse_ms = DEFAULT_PULSE_MS;
  limits.silence_ms = limit_silence_ms = DEFAULT_SILENCE_MS;
  limits.channels = DEFAULT_CHANNELS;
  for (uint8_t i = 0; i < CHANNELS_MAX; i++) {
    limits.low_counts[i] = DEFAULT_PRESSURE_LOW_COUNTS;
    limits.high_counts[i] = DEFAULT_PRESSURE_HIGH_COUNTS;
  }
  safety_start(watchdog);
  safety_limit(limits);
  cause = reset_cause;
  just_started = 1;
  identity_due = true;
}

// ---- the tick -----------------------------------------------------------------------------------------------

// Sums until the interval is over; the division is left to the main loop (it would take half of a slot of the ADC).
static void sum_up(const uint16_t counts[CHANNELS_MAX], uint16_t reference) {
  for (uint8_t i = 0; i < CHANNELS_MAX; i++) running.pressure[i] += counts[i];
  running.reference += reference;
  running.count++;
  if (++stream_phase < stream_period) return;
  running.time_ms = now_ms;
  interval = running;
  memset(&running, 0, sizeof running);
  stream_phase = 0;
  sample_due = true;
}

void bench_tick(const uint16_t counts[CHANNELS_MAX], uint16_t reference) {
  now_ms++;
  if (silence < 0xffff) silence++;
  if (frame_gap < 255) frame_gap++;
  if (loop_gap < 255) loop_gap++;
  safety_judge(counts);
  if (loop_gap >= HANG_MS && direction != DIRECTION_OFF) safety_latch(FAULT_HUNG_LOOP);
  if (direction != DIRECTION_OFF) {
    ran_ms++;
    left_ms--;
    safety_add_travel(direction * (int16_t)duty);
    if (silence >= limit_silence_ms) safety_latch(FAULT_SILENCE);
    bool fresh_fault = safety_faults() & ~faults_at_start;  // stops the pump whatever its direction
    if (fresh_fault || silence >= limit_silence_ms || loop_gap >= HANG_MS) {
      end_pulse(END_REASON_FAULT);
    } else if (!safety_allows(direction)) {
      end_pulse(safety_back_at_neutral() ? END_REASON_NEUTRAL_REACHED : END_REASON_FAULT);
    } else if (left_ms == 0) {
      end_pulse(END_REASON_COMPLETED);
    }
  }
  if (stream_period) sum_up(counts, reference);
}

// ---- commands -----------------------------------------------------------------------------------------------

static uint8_t run_pulse(const PulseMessage &pulse) {
  if (pulse.duty > limits.max_duty || pulse.duration_ms > limits.max_pulse_ms) return STATUS_OUT_OF_RANGE;
  if (direction != DIRECTION_OFF) return STATUS_BUSY;
  if (!safety_allows(pulse.direction)) return STATUS_FAULT_LATCHED;
  direction = pulse.direction;
  duty = pulse.duty;
  left_ms = pulse.duration_ms;
  ran_ms = 0;
  pulse_sequence = reader.sequence();
  end_reason = END_REASON_NONE;
  faults_at_start = safety_faults();
  safety_note_pumping(true);
  hal_pump(direction, duty);
  return STATUS_OK;
}

static uint8_t set_stream(const StreamMessage &stream) {
  if (stream.period_ms >= 1 && stream.period_ms <= 4) return STATUS_OUT_OF_RANGE;
  memset(&running, 0, sizeof running);
  stream_phase = 0;
  stream_period = stream.period_ms;
  return STATUS_OK;
}

static uint8_t set_pump_limits(const LimitPumpMessage &wanted) {
  if (wanted.channels == 3) return STATUS_OUT_OF_RANGE;
  limits.max_duty = wanted.max_duty;
  limits.max_pulse_ms = wanted.max_pulse_ms;
  limits.silence_ms = limit_silence_ms = wanted.silence_ms;
  limits.channels = wanted.channels;
  return STATUS_OK;
}

static uint8_t set_pressure_limits(const LimitPressureMessage &wanted) {
  if (wanted.low_counts >= wanted.high_counts) return STATUS_OUT_OF_RANGE;
  limits.low_counts[wanted.channel] = wanted.low_counts;
  limits.high_counts[wanted.channel] = wanted.high_counts;
  return STATUS_OK;
}

// Runs a command whose payload is in range, with the tick locked out.
static uint8_t execute(uint8_t id, const uint8_t *payload) {
  uint8_t status = STATUS_OK;
  switch (id) {
    case MSG_PULSE: return run_pulse(*(const PulseMessage *)payload);
    case MSG_STREAM: return set_stream(*(const StreamMessage *)payload);
    case MSG_CLEAR_FAULTS: return safety_clear() ? STATUS_OK : STATUS_CONDITION_PERSISTS;
    case MSG_SET_NEUTRAL: safety_set_neutral(); return STATUS_OK;
    case MSG_HELLO:
    case MSG_STOP: end_pulse(END_REASON_STOPPED); return STATUS_OK;
    case MSG_LIMIT_PUMP: status = set_pump_limits(*(const LimitPumpMessage *)payload); break;
    case MSG_LIMIT_PRESSURE: status = set_pressure_limits(*(const LimitPressureMessage *)payload); break;
#ifdef TEST_HOOKS
    case MSG_TEST_HANG: hal_hang(payload[0] != 0); break;
#endif
  }
  safety_limit(limits);
  limits_due = true;
  return status;
}

static void answer(uint8_t id, uint8_t status) {
  ack.command = id;
  ack.status = status;
  ack.time_ms = now_ms;
  ack_sequence = reader.sequence();
  ack_due = true;
}

// Whether the frame's number is a new one in the window, given the rules of the session.
static bool sequence_is_next(uint8_t sequence) {
  uint8_t ahead = sequence - last_sequence;
  return ahead >= 1 && ahead <= SEQUENCE_WINDOW;
}

static void take_frame() {
  uint8_t id = reader.id(), sequence = reader.sequence();
  PayloadVerdict verdict = judge_payload(id, reader.payload(), reader.payload_length());
  if (verdict == PAYLOAD_WRONG_LENGTH) {  // no frame of ours: not even a sign of life
    bad_frames++;
    return;
  }
  uint8_t lock = hal_lock();
  silence = 0;
  bool urgent = id == MSG_PING || id == MSG_STOP || id == MSG_HELLO;
  if (verdict == PAYLOAD_UNKNOWN) answer(id, STATUS_UNKNOWN);
  else if (verdict == PAYLOAD_OUT_OF_RANGE) answer(id, STATUS_OUT_OF_RANGE);
  else if (id == MSG_PING) answer(id, STATUS_OK);
  else if (!urgent && !in_session) answer(id, STATUS_NO_SESSION);
  else if (in_session && sequence == last_sequence && reader.checksum() == last_checksum) {
    ack = last_ack;  // a retry: the answer again, without running it again
    ack_sequence = sequence;
    ack_due = true;
  } else if (!urgent && !sequence_is_next(sequence)) answer(id, STATUS_STALE_SEQUENCE);
  else {
    answer(id, execute(id, reader.payload()));
    if (id == MSG_HELLO) in_session = identity_due = limits_due = true;
    if (id == MSG_HELLO || sequence_is_next(sequence)) {
      last_sequence = sequence;
      last_checksum = reader.checksum();
      last_ack = ack;
    }
  }
  hal_unlock(lock);
}

void bench_receive(uint8_t byte) {
  uint8_t lock = hal_lock();
  bool late = frame_gap > FRAME_GAP_MS && reader.partial();
  frame_gap = 0;
  hal_unlock(lock);
  if (late) {
    reader.reset();
    bad_frames++;
  }
  FrameEvent event = reader.take(byte);
  if (event == FRAME_NONE) return;
  if (event == FRAME_GOOD) take_frame();
  else bad_frames++;
  reader.reset();
}

// ---- answers ------------------------------------------------------------------------------------------------

static bool send(uint8_t id, uint8_t sequence, const void *payload, uint8_t length) {
  if (hal_transmit_room() < length + FRAME_OVERHEAD) return false;
  uint8_t bytes[FRAME_BYTES_MAX];
  hal_transmit(bytes, frame_encode(id, sequence, payload, length, bytes));
  return true;
}

static void send_ended() {
  PulseEndedMessage ended;
  uint8_t lock = hal_lock();
  ended.time_ms = ended_ms;
  ended.pulse_sequence = pulse_sequence;
  ended.ran_ms = ran_ms;
  ended.end_reason = end_reason;
  ended.faults = safety_faults();
  hal_unlock(lock);
  if (send(MSG_PULSE_ENDED, pulse_sequence, &ended, sizeof ended)) ended_due = false;
}

static void send_sample() {
  if (hal_transmit_room() < sizeof(SampleMessage) + FRAME_OVERHEAD) return;  // the next round will do
  SampleMessage sample;
  uint8_t lock = hal_lock();
  Sums sums = interval;
  sample.direction = direction;
  sample.duty = duty;
  sample.faults = safety_faults();
  sample.fault_channels = safety_fault_channels();
  sample.pulse_sequence = pulse_sequence;
  sample.ran_ms = ran_ms;
  sample.end_reason = end_reason;
  sample_due = false;
  hal_unlock(lock);
  sample.time_ms = sums.time_ms;
  sample.averaged = sums.count;
  for (uint8_t i = 0; i < CHANNELS_MAX; i++)
    sample.pressure[i] = i < limits.channels ? (sums.pressure[i] * COUNT_SCALE + sums.count / 2) / sums.count : 0;
  sample.supply = (sums.reference * SUPPLY_SCALE + sums.count / 2) / sums.count;
  sample.bad_frames = bad_frames;
  send(MSG_SAMPLE, sample_counter++, &sample, sizeof sample);
}

static void send_identity() {
  IdentityMessage identity;
  identity.protocol = PROTOCOL_VERSION;
  identity.firmware = FIRMWARE_VERSION;
  identity.reset_cause = cause;
  identity.faults = safety_faults();
  identity.started = just_started;
  if (!send(MSG_IDENTITY, 0, &identity, sizeof identity)) return;
  identity_due = false;
  just_started = 0;
}

void bench_poll() {
  uint8_t lock = hal_lock();
  loop_gap = 0;
  ack.faults = safety_faults();
  bool ended = ended_due, sampled = sample_due;
  hal_unlock(lock);
  if (ack_due && send(MSG_ACK, ack_sequence, &ack, sizeof ack)) ack_due = false;
  if (ended) send_ended();
  if (identity_due) send_identity();
  if (limits_due && send(MSG_LIMITS, 0, &limits, sizeof limits)) limits_due = false;
  if (sampled) send_sample();
}

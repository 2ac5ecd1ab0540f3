// Tubefoot's bench on an Arduino Uno: one peristaltic pump behind an L298N, two (or four) pressure sensors.
//
// This file is the machine: pins, timers, ADC, watchdog. What the bench does is in bench.cpp (commands, pulses,
// samples), safety.cpp (when the pump must stop) and frame.cpp (bytes on the wire). docs/rig.md tells the rest.
#include <avr/sleep.h>
#include <avr/wdt.h>

#include "bench.h"
#include "hal.h"
#include "pins.h"
#include "safety.h"

#define SLOTS 5                 // of 200 us in a tick of 1 ms: the four pressure inputs, then the reference
#define SLOT_REFERENCE 4
#define MUX_REFERENCE 14        // the chip's 1.1 V reference as an input: its reading tells the supply voltage

Remembered remembered __attribute__((section(".noinit")));

static volatile uint8_t ticks;
static uint16_t counts[CHANNELS_MAX];

void hal_pump(int8_t direction, uint8_t duty) {
  // Off first, so that a change of direction never passes through "both inputs high" with the bridge enabled.
  TCCR1A &= ~_BV(COM1A1);
  PUMP_ENABLE_PORT &= ~_BV(PUMP_ENABLE_BIT);
  PUMP_FORWARD_PORT &= ~_BV(PUMP_FORWARD_BIT);
  PUMP_REVERSE_PORT &= ~_BV(PUMP_REVERSE_BIT);
  if (direction == DIRECTION_OFF || duty == 0) return;
  if (direction == DIRECTION_FORWARD) PUMP_FORWARD_PORT |= _BV(PUMP_FORWARD_BIT);
  else PUMP_REVERSE_PORT |= _BV(PUMP_REVERSE_BIT);
  if (duty == 255) {
    PUMP_ENABLE_PORT |= _BV(PUMP_ENABLE_BIT);
    return;
  }
  OCR1A = duty;
  TCCR1A |= _BV(COM1A1);
}

uint8_t hal_transmit_room() { return Serial.availableForWrite(); }

void hal_transmit(const uint8_t *bytes, uint8_t length) { Serial.write(bytes, length); }

uint8_t hal_lock() {
  uint8_t state = SREG;
  cli();
  return state;
}

void hal_unlock(uint8_t state) { SREG = state; }

void hal_hang(bool interrupts_off) {
  if (interrupts_off) cli();
  else sei();
  for (;;) {
  }
}

static void start_conversion(uint8_t input) {
  ADMUX = _BV(REFS0) | input;
  ADCSRA |= _BV(ADSC);
}

// Every 200 us: collect the conversion started in the last slot (it takes 104 us) and start the next one.
ISR(TIMER2_COMPA_vect) {
  static uint8_t slot;
  static uint16_t reference;
  uint16_t value = ADC;
  if (slot == 0) reference = value;
  else counts[slot - 1] = value;
  if (slot != SLOT_REFERENCE) {
    start_conversion(ADC_FIRST_CHANNEL + slot);
  } else {
    ADMUX = _BV(REFS0) | MUX_REFERENCE;  // a weak source: it settles while the rules run
    ticks++;
    bench_tick(counts, reference);
    start_conversion(MUX_REFERENCE);
  }
  slot = slot == SLOTS - 1 ? 0 : slot + 1;
}

void setup() {
  uint8_t cause = MCUSR;
  MCUSR = 0;
  wdt_disable();
  pinMode(PIN_PUMP_ENABLE, OUTPUT);
  pinMode(PIN_PUMP_FORWARD, OUTPUT);
  pinMode(PIN_PUMP_REVERSE, OUTPUT);
  pinMode(PIN_FAULT_LED, OUTPUT);
  bench_start(cause, cause & _BV(WDRF));
  Serial.begin(BAUD);

  TCCR1A = _BV(WGM10);  // pump PWM: 8 bit, fast, 16 MHz / 64 / 256 = 976 Hz
  TCCR1B = _BV(WGM12) | _BV(CS11) | _BV(CS10);

  ADCSRA = _BV(ADEN) | _BV(ADPS2) | _BV(ADPS1) | _BV(ADPS0);  // 125 kHz
  start_conversion(MUX_REFERENCE);
  TCCR2B = 0;
  TCCR2A = _BV(WGM21);
  TCNT2 = 0;
  OCR2A = 49;  // 16 MHz / 64 / 50 = 5 kHz
  TIMSK2 = _BV(OCIE2A);
  TCCR2B = _BV(CS22);

  set_sleep_mode(SLEEP_MODE_IDLE);
  wdt_enable(WDTO_60MS);
}

void loop() {
  static uint8_t ticks_seen;
  uint8_t now = ticks;
  bool due = now != ticks_seen;
  for (int byte; (byte = Serial.read()) >= 0; due = true) bench_receive(byte);
  if (due) {
    bench_poll();
    static bool lit;
    if (lit != (safety_faults() != 0)) digitalWrite(PIN_FAULT_LED, lit = !lit);
  }
  if (now != ticks_seen) {  // the watchdog is fed only while both the tick and this loop live
    ticks_seen = now;
    wdt_reset();
  }
  cli();  // sleep until the next interrupt, without a gap in which one could be missed
  if (now == ticks && !Serial.available()) {
    sleep_enable();
    sei();
    sleep_cpu();
    sleep_disable();
  }
  sei();
}

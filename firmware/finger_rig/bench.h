// The bench without its machine: safety rules and pump in the 1 kHz tick, commands and answers in the main loop.
// Compiles unchanged for the board and, for tests and fuzzing, on a computer.
#pragma once
#include <stdint.h>
#include "messages.h"

#define FIRMWARE_VERSION 0x0100  // 1.0

// What survives a restart that keeps the RAM (watchdog, reset button); the platform places it outside .bss.
struct Remembered {
  uint32_t magic;
  int32_t travel;   // signed sum of duty x ms since neutral [ms/255]
  uint16_t faults;  // latched faults
  uint8_t pumping;
  uint8_t check;
};
extern Remembered remembered;

void bench_start(uint8_t reset_cause, bool watchdog);                 // once, before the tick runs
void bench_tick(const uint16_t counts[CHANNELS_MAX], uint16_t reference);  // every 1 ms, in interrupt context
void bench_receive(uint8_t byte);                                     // main loop: a byte from the host
void bench_poll();                                                    // main loop: sends what is due

// What the portable part asks of the machine: finger_rig.ino on the board, native/ on a computer.
#pragma once
#include <stdint.h>

void hal_pump(int8_t direction, uint8_t duty);              // direction 0 or duty 0 stops it
uint8_t hal_transmit_room();                                // bytes that hal_transmit takes without waiting
void hal_transmit(const uint8_t *bytes, uint8_t length);
uint8_t hal_lock();                                         // keeps the 1 kHz tick out; returns what hal_unlock wants
void hal_unlock(uint8_t state);
void hal_hang(bool interrupts_off);                         // test builds: never returns

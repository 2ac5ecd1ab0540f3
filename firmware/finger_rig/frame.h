// Frames on the wire: 0x00, COBS(id, sequence, payload, CRC-32), 0x00.
//
// The delimiter stands at both ends, so that a damaged frame cannot swallow its successor. COBS as in Cheshire and
// Baker, "Consistent Overhead Byte Stuffing", 1999. CRC-32 as in IEEE 802.3 (zlib's crc32), over id to payload.
#pragma once
#include <stdint.h>
#include "messages.h"

#define FRAME_OVERHEAD 9  // delimiters, COBS code, id, sequence, CRC-32

uint32_t crc32(const uint8_t *bytes, uint8_t length);

// Writes a whole frame to `out` (FRAME_BYTES_MAX bytes); returns its length, 0 if it would not fit.
uint8_t frame_encode(uint8_t id, uint8_t sequence, const void *payload, uint8_t length, uint8_t *out);

enum FrameEvent : uint8_t { FRAME_NONE, FRAME_GOOD, FRAME_BAD };

// Collects bytes into frames.
struct FrameReader {
  uint8_t bytes[FRAME_BYTES_MAX];  // after FRAME_GOOD: id, sequence, payload, CRC-32
  uint8_t length;
  bool overrun;

  void reset();
  bool partial() const { return length != 0 || overrun; }
  FrameEvent take(uint8_t byte);
  uint8_t id() const { return bytes[0]; }
  uint8_t sequence() const { return bytes[1]; }
  const uint8_t *payload() const { return bytes + 2; }
  uint8_t payload_length() const { return length - 6; }
  uint32_t checksum() const;

 private:
  bool decode();
};

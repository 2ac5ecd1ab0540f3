#include "frame.h"

#include <string.h>

#ifndef CHECKSUM_MASK
#define CHECKSUM_MASK 0xffffffffu  // the native fuzz weakens the check through it to see that wrong frames are counted
#endif

uint32_t crc32(const uint8_t *bytes, uint8_t length) {
  static const uint32_t nibble[16] = {  // the reflected polynomial 0xedb88320, four bits at a time
      0x00000000u, 0x1db71064u, 0x3b6e20c8u, 0x26d930acu, 0x76dc4190u, 0x6b6b51f4u, 0x4db26158u, 0x5005713cu,
      0xedb88320u, 0xf00f9344u, 0xd6d6a3e8u, 0xcb61b38cu, 0x9b64c2b0u, 0x86d3d2d4u, 0xa00ae278u, 0xbdbdf21cu};
  uint32_t crc = 0xffffffffu;
  for (uint8_t i = 0; i < length; i++) {
    crc ^= bytes[i];
    crc = (crc >> 4) ^ nibble[crc & 15];
    crc = (crc >> 4) ^ nibble[crc & 15];
  }
  return ~crc;
}

uint8_t frame_encode(uint8_t id, uint8_t sequence, const void *payload, uint8_t length, uint8_t *out) {
  if (length > FRAME_BYTES_MAX - FRAME_OVERHEAD) return 0;
  uint8_t body[FRAME_BYTES_MAX];
  body[0] = id;
  body[1] = sequence;
  memcpy(body + 2, payload, length);
  uint32_t crc = crc32(body, length + 2);
  memcpy(body + 2 + length, &crc, 4);

  uint8_t written = 0, code_at = 1, run = 1;  // COBS: a code byte tells how far it is to the next zero
  out[written++] = 0;
  written++;
  for (uint8_t i = 0; i < length + 6; i++) {
    if (body[i]) {
      out[written++] = body[i];
      run++;
    } else {
      out[code_at] = run;
      code_at = written++;
      run = 1;
    }
  }
  out[code_at] = run;
  out[written++] = 0;
  return written;
}

void FrameReader::reset() {
  length = 0;
  overrun = false;
}

// The first byte after a delivered frame overwrites it: use a frame before taking the next byte.
FrameEvent FrameReader::take(uint8_t byte) {
  if (byte != 0) {
    if (length < FRAME_BYTES_MAX) bytes[length++] = byte;
    else overrun = true;
    return FRAME_NONE;
  }
  if (!partial()) return FRAME_NONE;  // two delimiters in a row
  return !overrun && decode() ? FRAME_GOOD : FRAME_BAD;
}

uint32_t FrameReader::checksum() const {
  uint32_t crc;
  memcpy(&crc, bytes + length - 4, 4);
  return crc;
}

// Undoes COBS in place and checks the CRC.
bool FrameReader::decode() {
  uint8_t written = 0, read = 0;
  while (read < length) {
    uint8_t code = bytes[read++];
    if (code - 1 > length - read) return false;
    for (uint8_t i = 1; i < code; i++) bytes[written++] = bytes[read++];
    if (read < length) bytes[written++] = 0;
  }
  length = written;
  if (length < 6) return false;
  return ((crc32(bytes, length - 4) ^ checksum()) & CHECKSUM_MASK) == 0;
}

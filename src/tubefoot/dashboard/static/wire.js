// Frames of the websocket into numbers; the layout is described in wire.py.
export const SAMPLES = 1, ANGLES = 2, PICTURE = 3, OUTLINES = 4, LINE = 5, SHAPE = 6, STATE = 7, LOST = 8;

const text = new TextDecoder();

export function unpacked(buffer) {
  const view = new DataView(buffer);
  if (view.getUint32(0, false) !== 0x54464431) throw new Error("not a frame of the dashboard");
  const found = {};
  for (let at = 8; at < buffer.byteLength; ) {
    const kind = view.getUint16(at, true), count = view.getUint16(at + 2, true), length = view.getUint32(at + 4, true);
    const start = at + 8;
    found[kind] = section(kind, count, buffer, start, length, view);
    at = start + length + ((8 - (length % 8)) % 8);
  }
  return found;
}

function section(kind, count, buffer, start, length, view) {
  switch (kind) {
    case SAMPLES: return rows(new Float64Array(buffer, start, length / 8), count);
    case ANGLES: return rows(new Float64Array(buffer, start, length / 8), count);
    case PICTURE: return {
      width: view.getUint32(start, true), height: view.getUint32(start + 4, true), time: view.getFloat64(start + 8, true),
      jpeg: new Blob([new Uint8Array(buffer, start + 16, length - 16)], { type: "image/jpeg" }),
    };
    case OUTLINES: case LINE: case SHAPE: return { count, values: new Float32Array(buffer, start, length / 4) };
    case STATE: return JSON.parse(text.decode(new Uint8Array(buffer, start, length)));
    case LOST: return text.decode(new Uint8Array(buffer, start, length));
    default: return null;
  }
}

function rows(values, count) {
  const width = count ? values.length / count : 0;
  return Array.from({ length: count }, (_, row) => values.subarray(row * width, (row + 1) * width));
}

/* The connection to the tool: requests are sent as JSON, answers arrive as binary frames. */

const KINDS = {
  f4: Float32Array, f8: Float64Array, u1: Uint8Array, i1: Int8Array, u2: Uint16Array, i2: Int16Array, u4: Uint32Array,
  i4: Int32Array,
};
const OPENED_ELSEWHERE = 4001; // the server's code: another page has taken the session over
const WAITS_S = [0.3, 0.6, 1, 2, 4, 8];

/* A frame: length of the header (uint32), the header as JSON, and its arrays, each padded to 8 bytes. */
export function unpacked(buffer) {
  const size = new DataView(buffer).getUint32(0, true);
  const facts = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, size)));
  let at = 4 + size;
  facts.data = {};
  for (const { name, dtype, shape } of facts.arrays || []) {
    const count = shape.reduce((product, each) => product * each, 1);
    const values = new KINDS[dtype.replace(/^[<|=]/, "")](buffer, at, count);
    facts.data[name] = Object.assign(values, { shape });
    at += values.byteLength + ((8 - (values.byteLength % 8)) % 8);
  }
  return facts;
}

/* Connects, and connects again after a loss; `changed` hears "open", "lost" (trying again), "gone" (given up)
   and "elsewhere" (the session is another page's now). */
export function connect(address, { answered, changed }) {
  let socket = null, tries = 0, ended = false;

  function open() {
    socket = new WebSocket(address);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => { tries = 0; changed("open"); };
    socket.onmessage = (event) => answered(typeof event.data === "string" ? JSON.parse(event.data) : unpacked(event.data));
    socket.onclose = (event) => {
      if (ended) return;
      if (event.code === OPENED_ELSEWHERE) { changed("elsewhere"); return; }
      if (tries >= WAITS_S.length) { changed("gone"); return; }
      changed("lost");
      setTimeout(open, 1000 * WAITS_S[tries++]);
    };
  }

  addEventListener("pagehide", () => { ended = true; socket.close(); });
  addEventListener("pageshow", (event) => { if (event.persisted) { ended = false; open(); } });
  open();
  return {
    send(message) {
      const there = socket.readyState === WebSocket.OPEN;
      if (there) socket.send(JSON.stringify(message));
      return there;
    },
    again() { tries = 0; open(); },
  };
}

// SHA-256 (FIPS 180-4, section 6.2, with its names), because browsers have none for pages without TLS.

/** The fractional parts of the roots of the first primes, to 32 bits. */
function fractions(count: number, root: (prime: number) => number): Uint32Array {
  const out = new Uint32Array(count);
  for (let n = 2, i = 0; i < count; ++n) {
    let prime = true;
    for (let d = 2; d * d <= n; ++d) prime &&= n % d !== 0;
    if (prime) out[i++] = (root(n) % 1) * 2 ** 32;
  }
  return out;
}
const K = fractions(64, Math.cbrt);
const H = fractions(8, Math.sqrt);

/** Of 64 hex digits. */
export async function sha256(bytes: Uint8Array): Promise<string> {
  const { subtle } = globalThis.crypto ?? {};
  return hex(subtle ? new Uint8Array(await subtle.digest('SHA-256', bytes as BufferSource)) : digest(bytes));
}

export function digest(bytes: Uint8Array): Uint8Array {
  const h = H.slice();
  const whole = bytes.length - (bytes.length % 64);
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.length);
  for (let at = 0; at < whole; at += 64) compress(h, view, at);
  const rest = bytes.length - whole;
  const end = new Uint8Array(rest < 56 ? 64 : 128);
  end.set(bytes.subarray(whole));
  end[rest] = 0x80;
  const last = new DataView(end.buffer);
  last.setUint32(end.length - 8, Math.floor(bytes.length / 2 ** 29));
  last.setUint32(end.length - 4, bytes.length * 8);
  for (let at = 0; at < end.length; at += 64) compress(h, last, at);
  const out = new DataView(new ArrayBuffer(32));
  h.forEach((word, i) => out.setUint32(4 * i, word));
  return new Uint8Array(out.buffer);
}

const W = new Uint32Array(64);
const rotr = (x: number, n: number): number => (x >>> n) | (x << (32 - n));

function compress(h: Uint32Array, view: DataView, at: number): void {
  for (let t = 0; t < 16; ++t) W[t] = view.getUint32(at + 4 * t);
  for (let t = 16; t < 64; ++t) {
    const [x, y] = [W[t - 15]!, W[t - 2]!];
    W[t] = (rotr(y, 17) ^ rotr(y, 19) ^ (y >>> 10)) + W[t - 7]! + (rotr(x, 7) ^ rotr(x, 18) ^ (x >>> 3)) + W[t - 16]!;
  }
  let a = h[0]!, b = h[1]!, c = h[2]!, d = h[3]!, e = h[4]!, f = h[5]!, g = h[6]!, last = h[7]!;
  for (let t = 0; t < 64; ++t) {
    const t1 = (last + (rotr(e, 6) ^ rotr(e, 11) ^ rotr(e, 25)) + ((e & f) ^ (~e & g)) + K[t]! + W[t]!) | 0;
    const t2 = ((rotr(a, 2) ^ rotr(a, 13) ^ rotr(a, 22)) + ((a & b) ^ (a & c) ^ (b & c))) | 0;
    last = g;
    g = f;
    f = e;
    e = (d + t1) | 0;
    d = c;
    c = b;
    b = a;
    a = (t1 + t2) | 0;
  }
  h[0]! += a;
  h[1]! += b;
  h[2]! += c;
  h[3]! += d;
  h[4]! += e;
  h[5]! += f;
  h[6]! += g;
  h[7]! += last;
}

const hex = (bytes: Uint8Array): string => Array.from(bytes, (byte) => byte.toString(16).padStart(2, '0')).join('');

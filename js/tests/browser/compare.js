// Differences between pictures as raw texels.

/** @returns {number} */
function half(bits) {
  const [sign, exponent, mantissa] = [bits >> 15 ? -1 : 1, (bits >> 10) & 31, bits & 1023];
  if (exponent === 31) return mantissa ? NaN : sign * Infinity;
  return exponent === 0 ? sign * mantissa * 2 ** -24 : sign * (1 + mantissa / 1024) * 2 ** (exponent - 15);
}

/** Numbers of texels of this format. */
export function numbers(bytes, format) {
  if (format.endsWith("16float"))
    return Array.from({ length: bytes.length / 2 }, (_, i) => half(bytes.readUInt16LE(2 * i)));
  return Array.from({ length: bytes.length / 4 }, (_, i) => bytes.readFloatLE(4 * i));
}

/**
 * Rounding of a number by itself: of ten operations in float32, or one step of float16.
 */
const ROUNDING = { 16: 2 ** -10, 32: 10 * 2 ** -24 };

/** Root of the mean square difference by that of the wanted picture, and the share of numbers that differ by more than rounding. */
export function difference(found, wanted, format) {
  const rounding = ROUNDING[format.match(/(16|32)float$/)[1]];
  if (found.length !== wanted.length) throw new Error(`${found.length} bytes instead of ${wanted.length}`);
  const [a, b] = [numbers(found, format), numbers(wanted, format)];
  let [squares, all, differ] = [0, 0, 0];
  a.forEach((value, i) => {
    if (!Number.isFinite(value)) throw new Error(`number ${i} is ${value}`);
    squares += (value - b[i]) ** 2;
    all += b[i] ** 2;
    if (Math.abs(value - b[i]) > rounding * Math.abs(b[i])) differ++;
  });
  return { relative: Math.sqrt(squares / all), differing: differ / a.length, mean: Math.sqrt(all / a.length) };
}

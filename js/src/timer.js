// Times of passes, by timestamps of the device.

/** Queries that a set may have. */
const MOST_QUERIES = 4096;

export class Timer {
  #device;
  #queries;
  #resolved;
  /** @type {GPUBuffer[]} */
  #free;
  /** @type {GPUBuffer | undefined} */
  #written;

  /** A timer, if the device has timestamps. @param {GPUDevice} device @param {number} passes */
  static of(device, passes) {
    const has = device.features.has("timestamp-query") && passes > 0 && 2 * passes <= MOST_QUERIES;
    return has ? new Timer(device, passes) : undefined;
  }

  /** @param {GPUDevice} device @param {number} passes */
  constructor(device, passes) {
    const buffer = (/** @type {string} */ label, /** @type {number} */ usage) =>
      device.createBuffer({ label, size: 16 * passes, usage });
    this.#device = device;
    this.#queries = device.createQuerySet({ label: "halflight times", type: "timestamp", count: 2 * passes });
    this.#resolved = buffer("halflight timestamps", GPUBufferUsage.QUERY_RESOLVE | GPUBufferUsage.COPY_SRC);
    // One is read while the next frame writes the other.
    const readable = GPUBufferUsage.MAP_READ | GPUBufferUsage.COPY_DST;
    this.#free = [0, 1].map((i) => buffer(`halflight timestamps to read ${i}`, readable));
  }

  /** @param {number} pass @returns {GPUComputePassTimestampWrites} */
  writes(pass) {
    return { querySet: this.#queries, beginningOfPassWriteIndex: 2 * pass, endOfPassWriteIndex: 2 * pass + 1 };
  }

  /** @param {GPUCommandEncoder} encoder */
  resolve(encoder) {
    const target = this.#written ?? this.#free.pop();
    if (!target) return;
    encoder.resolveQuerySet(this.#queries, 0, this.#resolved.size / 8, this.#resolved, 0);
    encoder.copyBufferToBuffer(this.#resolved, 0, target, 0, target.size);
    this.#written = target;
  }

  /** Milliseconds of each pass of the last submitted frame; null if there is none. @returns {Promise<number[] | null>} */
  async read() {
    const buffer = this.#written;
    if (!buffer) return null;
    this.#written = undefined;
    await buffer.mapAsync(GPUMapMode.READ);
    const ticks = new BigUint64Array(buffer.getMappedRange());
    const times = [];
    for (let i = 0; i < ticks.length; i += 2) {
      // Without this, a clock that was reset in between would give a huge number.
      times.push(ticks[i + 1] > ticks[i] ? Number(ticks[i + 1] - ticks[i]) * 1e-6 : 0);
    }
    buffer.unmap();
    this.#free.push(buffer);
    return times;
  }

  destroy() {
    this.#queries.destroy();
    for (const buffer of [this.#resolved, this.#written, ...this.#free]) buffer?.destroy();
  }
}

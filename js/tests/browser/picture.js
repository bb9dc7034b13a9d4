// Colours of a page.

/** Mean of red, green and blue over a rectangle of a screenshot, shares of its size; 0..255. */
export async function colour(page, [left, top, width, height]) {
  const png = (await page.screenshot()).toString("base64");
  return page.evaluate(`(async () => {
    const bytes = Uint8Array.from(atob("${png}"), (c) => c.charCodeAt(0));
    const picture = await createImageBitmap(new Blob([bytes]));
    const canvas = new OffscreenCanvas(picture.width, picture.height);
    const context = canvas.getContext("2d");
    context.drawImage(picture, 0, 0);
    const [w, h] = [picture.width, picture.height];
    const { data } = context.getImageData(${left} * w, ${top} * h, ${width} * w, ${height} * h);
    const sums = [0, 0, 0];
    data.forEach((value, i) => { if (i % 4 < 3) sums[i % 4] += value; });
    return sums.map((sum) => sum / (data.length / 4));
  })()`);
}

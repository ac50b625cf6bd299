// Numbers of a run: what knittest/report_page/moving/page.py packed.

/** Bytes of base64 text in zlib's format, inflated by the browser. */
export async function inflated(text) {
  const raw = Uint8Array.from(atob(text.trim()), c => c.charCodeAt(0));
  const stream = new Blob([raw]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** Whole numbers of an entry, (k, n, d) one after the other, in an array of `Kind`. */
export function unpacked(data, entry, Kind) {
  const [k, n, d] = entry.shape, plane = k * n * d, values = new Kind(plane);
  for (let c = 0, at = entry.at; c < d; c++) {
    for (let t = 0; t < k; t++) {
      for (let i = 0, along = 0; i < n; i++, at++) {
        let folded = 0;
        for (let b = entry.width - 1; b >= 0; b--) folded = folded << 8 | data[at + b * plane];
        along = along + (folded >>> 1 ^ -(folded & 1)) | 0;
        const here = (t * n + i) * d + c;
        values[here] = along + (t > 0 ? values[here - n * d] : 0);  // wraps at the width of `Kind`
      }
    }
  }
  return values;
}

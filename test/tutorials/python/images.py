"""Images: created in memory, read from and written to files, brightened with a Param. NumPy arrays serve as images: the
axes [c, y, x] are planar in memory, and become a Func's (x, y, c)."""
import sys
from pathlib import Path

import numpy as np
import retrograde as rg

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")


def save_image(pixels, path):
    """Writes a PPM file, in which colours are innermost."""
    channels, height, width = pixels.shape
    path.write_bytes(b"P6\n%d %d\n255\n" % (width, height) + pixels.transpose(1, 2, 0).tobytes())


def load_image(path):
    kind, size, limit, data = path.read_bytes().split(b"\n", 3)
    width, height = map(int, size.split())
    return np.ascontiguousarray(np.frombuffer(data, np.uint8).reshape(height, width, 3).transpose(2, 0, 1))


# Planar in memory: all of one channel, then all of the next.
c, y, x = np.indices((3, 32, 48))
drawn = (x * 4 + y * 3 * (c + 1)).astype(np.uint8)
save_image(drawn, folder / "drawn.ppm")

# The file contains the same pixels.
loaded = load_image(folder / "drawn.ppm")
print(f"loaded {loaded.shape[2]} x {loaded.shape[1]} x {loaded.shape[0]}, {(loaded != drawn).sum()} differences")

# A pipeline for any image and any gain.
image, gain, brighter = rg.ImageParam("uint8", 3, "input"), rg.Param("float32", "gain"), rg.Func("brighter")
x, y, c = rg.Var("x"), rg.Var("y"), rg.Var("c")
value = rg.f32(image[x, y, c]) * gain
brighter[x, y, c] = rg.u8(rg.min(value, 255.0))

image.set(loaded)
for g in (0.5, 1.0, 1.75):
    gain.set(g)
    result = np.asarray(brighter.realize([48, 32, 3]))
    print("gain %.2f: sum %d, pixel (40, 20) is %d %d %d" % (g, result.sum(), *result[:, 20, 40]))
    if g > 1.5:
        save_image(result, folder / "brighter.ppm")

# Interleaved images have their channels innermost in memory.
interleaved, planar = rg.Buffer.make_interleaved("uint8", 16, 8, 3), rg.Buffer(drawn)
interleaved.fill(7)
strides = [[image.dim(d).stride() for d in range(3)] for image in (interleaved, planar)]
print("strides %d %d %d, and planar %d %d %d" % (*strides[0], *strides[1]))

# A window into an image shares its memory.
window = planar.cropped(0, 8, 10).cropped(1, 4, 6)
window.fill(255)
print("window starts at (%d, %d), drawn(8, 4) is %d, drawn(7, 4) is %d"
      % (window.min(0), window.min(1), drawn[0, 4, 8], drawn[0, 4, 7]))

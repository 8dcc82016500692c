"""NumPy arrays as inputs and outputs: one axis rule, no copies, any strides.

An image of 200 x 100 pixels is an array of shape (100, 200): NumPy's last axis is a Func's first dimension.
"""
import numpy as np
import retrograde as rg
from gradients.claims import claim

x, y, c = rg.Var("x"), rg.Var("y"), rg.Var("c")

# ---- The rule: a[y, x] == f[x, y]. ----
f = rg.Func("f")
f[x, y] = x + 1000 * y
a = np.asarray(f.realize([200, 100]))
claim(a.shape == (100, 200) and a[7, 30] == 7030, "a[y, x] == f[x, y]")
b = rg.Buffer(a)
claim((b.width(), b.height()) == (200, 100) and b[30, 7] == a[7, 30], "the same rule applies to arrays that become Buffers")

# ---- Memory is shared in both directions and lives as long as any view of it. ----
b[0, 0] = -5
claim(a[0, 0] == -5, "a write to the Buffer changes the array")
out = np.zeros((100, 200), "int32")
f.realize(out)
claim(out[99, 199] == 99199, "results can be written to an existing array")
view = np.asarray(rg.Buffer(np.arange(5)))
claim(view.sum() == 10, "a view keeps the memory of a temporary array alive")

# ---- Any strides: colours innermost, rows in reverse, every second column. ----
image, gray = rg.ImageParam("uint8", 3, "image"), rg.Func("gray")
gray[x, y] = rg.u8((rg.u16(image[x, y, 0]) + image[x, y, 1] + image[x, y, 2]) / 3)
photo = np.random.default_rng(0).integers(0, 256, (60, 80, 3), "uint8")  # as files are read: [y, x, c]
planes = photo.transpose(2, 0, 1)  # [c, y, x]: the same memory
image.set(planes)
want = photo.sum(2, dtype="uint16") // 3
claim((np.asarray(gray.realize([80, 60])) == want).all(), "an image with interleaved colours")
image.set(planes[:, ::-1, ::2])
claim((np.asarray(gray.realize([40, 60])) == want[::-1, ::2]).all(), "its rows in reverse, and every second column")

# ---- A read-only array can be an input but not an output. ----
photo.flags.writeable = False
image.set(photo.transpose(2, 0, 1))
gray.realize([80, 60])
try:
    f.realize(np.broadcast_to(np.int32(0), (100, 200)))
    claim(False, "a read-only array was written to")
except rg.Error as error:
    claim("read" in str(error), "a read-only array is rejected as an output")

# ---- Half precision, and bfloat16, which NumPy lacks, through its bits. ----
half = rg.Func("half")
half[x] = rg.cast("float16", x) / 4
claim(np.asarray(half.realize([4])).dtype == np.float16, "float16 becomes NumPy's float16")
brain = rg.Func("brain")
brain[x] = rg.cast(rg.BFloat(16), rg.f32(x))
bits = np.asarray(brain.realize([3]).bits())
claim(bits.tolist() == [0, 0x3f80, 0x4000], "bfloat16 becomes uint16 in NumPy (DLPack has bfloat16 itself)")

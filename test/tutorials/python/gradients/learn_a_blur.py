"""Learn a blur: a first gradient.

A picture was blurred with an unknown kernel, and we have the picture before and after. Gradient descent on the
difference finds the kernel.
"""
import numpy as np
import retrograde as rg
from claims import claim

# ---- The input, as NumPy arrays: a sharp picture, and the same picture blurred. ----
size = 48
truth = np.array([[1, 2, 1], [2, 4, 2], [1, 2, 1]], "float32") / 16  # the program does not use it to learn
j, i = np.indices((size + 2, size + 2))
sharp = ((i * i + 3 * j * j + i * j) % 17).astype("float32") / 16 - 0.5
given = sum(sharp[v:v + size, u:u + size] * truth[v, u] for v in range(3) for u in range(3))

# ---- The model and the loss. Both are forward code only. A Buffer of an array shares its memory. ----
kernel = np.zeros((3, 3), "float32")
image, weights, wanted = rg.Buffer(sharp), rg.Buffer(kernel), rg.Buffer(given)
x, y = rg.Var("x"), rg.Var("y")
blur, loss = rg.Func("blur"), rg.Func("loss")
taps, pixels = rg.RDom(weights), rg.RDom(wanted)
blur[x, y] = rg.f32(0)
blur[x, y] += image[x + taps.x, y + taps.y] * weights[taps.x, taps.y]
loss[()] = rg.f32(0)
loss[()] += (blur[pixels.x, pixels.y] - wanted[pixels.x, pixels.y]) ** 2 / (size * size)

# ---- The gradient is a Func with the dimensions of the variable that it differentiates by. ----
gradient = rg.propagate_adjoints(loss)(weights)
claim(gradient.dimensions() == 2, "the gradient by a two-dimensional kernel has two dimensions")


# Each element is the slope of the loss along one tap.
def loss_now():
    return loss.realize()[()]


slopes = np.asarray(gradient.realize([3, 3]))
step = 1 / 16
kernel[1, 1] += step
after = loss_now()
kernel[1, 1] -= 2 * step
before = loss_now()
kernel[1, 1] += step
claim(abs((after - before) / (2 * step) - slopes[1, 1]) < 0.001 * abs(slopes[1, 1]),
      "a finite difference along one tap agrees with the gradient")

# ---- Gradient descent. ----
losses = []
for n in range(60):
    losses.append(np.log10(loss_now()))
    kernel -= 2 * np.asarray(gradient.realize([3, 3]))
claim(losses[-1] < losses[0] - 6, "the loss fell below a millionth of its start")
claim(np.abs(kernel - truth).max() < 1e-3, "all nine taps are correct to 1e-3")

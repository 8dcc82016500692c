"""Threads: concurrent calls, and parameter values for one call.

The GIL is released while a pipeline compiles or runs, so that Python threads run concurrently. Values that differ between
calls are passed to the call instead of being set in the Param, which all threads share.
"""
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import retrograde as rg
from gradients.claims import claim

x, y = rg.Var("x"), rg.Var("y")
exponent = rg.Param("float32", "exponent", 1.0)
image, curve = rg.ImageParam("float32", 2, "image"), rg.Func("curve")
curve[x, y] = rg.pow(image[x, y], exponent)
curve.compile_jit()

# ---- Eight concurrent calls, each with its own values. ----
pictures = [np.full((20, 30), n + 1, "float32") for n in range(8)]


def call(n):
    return np.asarray(curve.realize([30, 20], param_map={image: pictures[n], exponent: 2.0}))


with ThreadPoolExecutor(8) as pool:
    results = list(pool.map(call, range(8)))
claim(all((result == (n + 1) ** 2).all() for n, result in enumerate(results)), "eight threads, eight images")
claim(exponent.get() == 1, "the value set in the Param does not change")

# ---- A thread counts while the main thread waits for a pipeline. ----
slow, r = rg.Func("slow"), rg.RDom([(0, 20_000_000)])
slow[x] = rg.f64(0)
slow[x] += rg.sin(slow[x] + rg.f64(r))
slow.compile_jit()
counted, done = [0], threading.Event()


def count():
    while not done.is_set():
        counted[0] += 1
        time.sleep(0.001)


thread = threading.Thread(target=count)
thread.start()
slow.realize([1])
done.set()
thread.join()
claim(counted[0] > 5, "the other thread counted meanwhile")

# ---- The handlers of a pipeline limit the number of its threads. ----
curve.jit_handlers().thread_limit = 1
claim((call(2) == 9).all(), "one thread gives the same result")

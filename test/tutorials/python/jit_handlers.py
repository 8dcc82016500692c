"""Handlers of JIT-compiled pipelines: printing, errors, memory, parallel loops. The handler `print` is a Python function;
the others are C functions, here made by ctypes."""
import ctypes

import retrograde as rg

x, y = rg.Var("x"), rg.Var("y")
libc = ctypes.CDLL(None)
libc.aligned_alloc.restype, libc.aligned_alloc.argtypes = ctypes.c_void_p, [ctypes.c_size_t, ctypes.c_size_t]
libc.free.argtypes = [ctypes.c_void_p]
counts = {"allocations": 0, "releases": 0, "tasks": 0}


@ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t)
def count_malloc(context, size):
    counts["allocations"] += 1
    return libc.aligned_alloc(128, -(-size // 128) * 128 + 128)


@ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
def count_free(context, block):
    counts["releases"] += bool(block)
    libc.free(block)


TASK = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_int, ctypes.c_void_p)


@ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, TASK, ctypes.c_int, ctypes.c_int, ctypes.c_void_p)
def backwards(context, task, first, extent, closure):
    for i in reversed(range(first, first + extent)):
        counts["tasks"] += 1
        code = task(context, i, closure)
        if code:
            return code
    return 0


printed = []
f = rg.Func("f")
f[x] = rg.print(x * 3, "at", x)
f.jit_handlers().print = printed.append
f.realize([3])
print("caught:", "".join(printed), end="")

table, f = rg.Func("table"), rg.Func("f")
table[x, y] = x * y
f[x, y] = table[x, y] + table[x + 1, y + 1]
table.compute_root()
f.jit_handlers().custom_malloc = count_malloc
f.jit_handlers().custom_free = count_free
out = f.realize([100, 80])
print(f"{out[99, 79]}, allocations {counts['allocations']}, releases {counts['releases']}")

f = rg.Func("f")
f[x, y] = x + y
f.parallel(y)
f.jit_handlers().custom_do_par_for = backwards
out = f.realize([10, 7])
print(f"{out[9, 6]}, tasks {counts['tasks']}")

# An error handler receives errors; nothing is raised.
told = []
image, f = rg.ImageParam("int32", 1, "input"), rg.Func("f")
f[x] = image[x + 5]
handler = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_char_p)(lambda context, message: told.append(message))
f.jit_handlers().custom_error = handler
small = rg.Buffer("int32", [10])
small.fill(1)
image.set(small)
f.realize([20])
print("the error names the input: %d" % (b"input" in told[0]))

# Without an error handler, errors are exceptions.
divisor = rg.Param("int32", "divisor", 11, min=1, max=10)
f = rg.Func("f")
f[x] = x / divisor
try:
    f.realize([4])
    print("nothing raised")
except rg.RuntimeError as error:
    print("thrown, and it names the Param: %d" % ("divisor" in str(error)))
print("exceptions: 1")

# Errors in a definition are found before anything runs.
f, z = rg.Func("f"), rg.Var("z")
try:
    f[x] = x + z
    print("nothing raised")
except rg.CompileError as error:
    print("refused, and it names the Var: %d" % ("z" in str(error)))

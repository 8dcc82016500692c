"""Cross-compilation: machine code for other targets."""
import sys

import retrograde as rg

folder = sys.argv[1] if len(sys.argv) > 1 else "."
x, y = rg.Var("x"), rg.Var("y")
depth, nearest, farthest = rg.ImageParam("uint16", 2, "depth"), rg.Param("uint16", "nearest"), rg.Param("uint16", "farthest")
mask = rg.Func("mask")
is_seen = (depth[x, y] >= nearest) & (depth[x, y] <= farthest)
mask[x, y] = rg.select(is_seen, rg.u8(255), rg.u8(depth[x, y] >> 9))
mask.parallel(y, 8).vectorize(x, 32)

for name in ("x86-64-linux-sse41", "x86-64-linux-avx-avx2-fma", "arm-64-linux",
             "x86-64-linux-no_asserts-no_bounds_query"):
    target = rg.Target(name)
    file = f"{folder}/mask_for_{name}"
    mask.compile_to_file(file, [depth, nearest, farthest], "mask_between", target)
    # Bytes 18 and 19 of an ELF file name its machine.
    with open(file + ".o", "rb") as object_file:
        header = object_file.read(32)
    print("%-42s %d bytes read, '%s', %d bits, machine %d, text \"%s\""
          % (name, len(header), header[1:4].decode(), header[4] * 32, header[18] + 256 * header[19], target.to_string()))

# Targets are values whose features can be queried and set.
t = rg.Target()
t.os, t.arch, t.bits = rg.Target.OS.Linux, rg.Target.Arch.ARM, 64
t.set_feature(rg.Target.Feature.NoAsserts)
print("%s: %d %d %d" % (t.to_string(), t.has_feature(rg.Target.Feature.NoAsserts), t.has_feature(rg.Target.Feature.AVX2),
                        t.has_gpu_feature()))
print("lanes of float:", rg.Target("arm-64-linux").natural_vector_size("float32"), "and",
      rg.Target("x86-64-linux-avx-avx2").natural_vector_size("float32"))
print("valid: %d %d" % (rg.Target.validate_target_string("x86-64-linux-avx2"),
                        rg.Target.validate_target_string("x86-64-linux-avx9")))

"""Compiles pipelines to libraries without running them."""
import os
import sys

import retrograde as rg

folder = sys.argv[1] if len(sys.argv) > 1 else "."
x, y = rg.Var("x"), rg.Var("y")

# The arguments of the function, in the order of the list below: an image and two scalars.
image, offset, strength = rg.ImageParam("uint8", 2, "input"), rg.Param("uint8", "offset"), rg.Param("float32", "strength")

clamped = rg.BoundaryConditions.repeat_edge(image)
sharp = rg.Func("sharp")
around = (clamped[x - 1, y] + rg.i32(clamped[x + 1, y]) + clamped[x, y - 1] + clamped[x, y + 1]) / 4
center = rg.i32(clamped[x, y])
sharp[x, y] = rg.u8(rg.clamp(center + rg.i32(strength * rg.f32(center - around)) + offset, 0, 255))
sharp.vectorize(x, 16).parallel(y)

arguments = [image, offset, strength]
sharp.compile_to_static_library(folder + "/sharpen", arguments, "sharpen")
print("sharpen takes an image and two scalars, and gives an image")

# Several outputs become several buffer arguments after the inputs.
low, high = rg.Func("low"), rg.Func("high")
low[x, y] = rg.min(image[x, y], offset)
high[x, y] = rg.max(image[x, y], offset)
both = rg.Pipeline([low, high])
both.compile_to_static_library(folder + "/split_range", [image, offset], "split_range")

# An object, a header, assembly, bitcode, and the lowered statement of the same pipeline.
sharp.compile_to_object(folder + "/sharpen_only.o", arguments, "sharpen_only",
                        rg.get_target_from_environment().with_feature(rg.Target.Feature.NoRuntime))
sharp.compile_to_header(folder + "/sharpen_only.h", arguments, "sharpen_only")
sharp.compile_to_assembly(folder + "/sharpen_only.s", arguments, "sharpen_only")
sharp.compile_to_bitcode(folder + "/sharpen_only.bc", arguments, "sharpen_only")
for name in ("sharpen.a", "sharpen.h", "split_range.a", "split_range.h", "sharpen_only.o", "sharpen_only.h",
             "sharpen_only.s", "sharpen_only.bc"):
    print(f"{name}:", "written" if os.path.exists(f"{folder}/{name}") else "missing")

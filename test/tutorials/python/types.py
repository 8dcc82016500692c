"""Types of expressions and their promotion rules."""
import retrograde as rg


def name(t):
    kind = "bool" if t.is_bool() else "uint" if t.is_uint() else "int" if t.is_int() else "float"
    return kind if t.is_bool() else f"{kind}{t.bits()}"


def of(t):
    return rg.cast(t, rg.Var("v"))


# Every arithmetic type, with its limits.
for t in [rg.UInt(8), rg.UInt(16), rg.UInt(32), rg.UInt(64), rg.Int(8), rg.Int(16), rg.Int(32), rg.Int(64),
          rg.Float(32), rg.Float(64)]:
    print("%-8s %d bytes, uint %d, int %d, float %d" % (name(t), t.bytes(), t.is_uint(), t.is_int(), t.is_float()))
print("type_of:", name(rg.Type("uint16")), name(rg.Type("float64")), name(rg.Type(bool)))

# The type of a + b: floats win over integers, wider types over narrower, signed over unsigned.
types = [rg.UInt(8), rg.Int(8), rg.UInt(32), rg.Int(16), rg.Float(32), rg.Float(64)]
for a in types:
    print("".join(" %-8s" % name((of(a) + of(b)).type()) for b in types))
print("with constants:", name((of(rg.UInt(8)) + 3).type()), name((of(rg.UInt(8)) * 2.5).type()),
      name((of(rg.Int(16)) / 2).type()))
print(f"comparison: {name((of(rg.UInt(8)) < of(rg.Int(32))).type())}, select: "
      + name(rg.select(of(rg.Int(8)) > 0, of(rg.UInt(16)), 7).type()))

# Narrow arithmetic wraps; a cast to a wider type first does not.
x = rg.Var("x")
narrow, wide, clamped = rg.Func("narrow"), rg.Func("wide"), rg.Func("clamped")
value = rg.u8(x * 100)
narrow[x] = value + value
wide[x] = rg.u16(value) + value
clamped[x] = rg.u8(rg.min(rg.u16(value) + value, 255))
for n, w, c in zip(*(f.realize([3]) for f in (narrow, wide, clamped))):
    print(n, w, c)

# Division and remainder round towards minus infinity.
quotients = rg.Func("quotients")
quotients[x] = ((x - 5) / 3, (x - 5) % 3, rg.i32(rg.f32(x - 5) / 3))
print("".join("%d:%d:%d " % point for point in zip(*quotients.realize([11]))))


# One function for every type: a product that cannot overflow, as integers get twice their bits.
def product(a, b):
    t = a.type()
    fits = t if t.is_float() else t.with_bits(2 * t.bits())
    return rg.cast(fits, a) * rg.cast(fits, b)


low, high = rg.i8(-128), rg.i8(127)
print("product: %d %d %g, as %s" % (rg.evaluate(product(low, high)), rg.evaluate(product(rg.i16(-32768), rg.i16(-3))),
                                    rg.evaluate(product(rg.f64(0.25), rg.f64(3.0))), name(product(low, low).type())))

# Reinterpreting bits.
print("bits of 1.0f: %x, and back %g" % (rg.evaluate(rg.reinterpret("uint32", rg.f32(1.0))),
                                         rg.evaluate(rg.reinterpret("float32", rg.u32(0x40490fdb)))))

// Types of expressions and their promotion rules.
#include "Halide.h"

#include <cstdio>
#include <string>

using namespace Halide;

std::string name(Type t) {
  std::string kind = t.is_bool() ? "bool" : t.is_uint() ? "uint" : t.is_int() ? "int" : "float";
  return t.is_bool() ? kind : kind + std::to_string(t.bits());
}

Expr as(Type t) { return cast(t, Var("v")); }

int main() {
  // Every arithmetic type, with its limits.
  for (Type t : {UInt(8), UInt(16), UInt(32), UInt(64), Int(8), Int(16), Int(32), Int(64),
                 Float(32), Float(64)}) {
    printf("%-8s %d bytes, uint %d, int %d, float %d\n", name(t).c_str(), t.bytes(),
           (int)t.is_uint(), (int)t.is_int(), (int)t.is_float());
  }
  printf("type_of: %s %s %s\n", name(type_of<uint16_t>()).c_str(), name(type_of<double>()).c_str(),
         name(type_of<bool>()).c_str());

  // The type of a + b: floats win over integers, wider types over narrower, signed over unsigned.
  const Type types[] = {UInt(8), Int(8), UInt(32), Int(16), Float(32), Float(64)};
  for (Type a : types) {
    for (Type b : types) printf(" %-8s", name((as(a) + as(b)).type()).c_str());
    printf("\n");
  }
  printf("with constants: %s %s %s\n", name((as(UInt(8)) + 3).type()).c_str(),
         name((as(UInt(8)) * 2.5f).type()).c_str(), name((as(Int(16)) / 2).type()).c_str());
  printf("comparison: %s, select: %s\n", name((as(UInt(8)) < as(Int(32))).type()).c_str(),
         name(select(as(Int(8)) > 0, as(UInt(16)), 7).type()).c_str());

  // Narrow arithmetic wraps; a cast to a wider type first does not.
  Var x("x");
  Func narrow("narrow"), wide("wide"), clamped("clamped");
  Expr value = cast<uint8_t>(x * 100);
  narrow(x) = value + value;
  wide(x) = cast<uint16_t>(value) + value;
  clamped(x) = cast<uint8_t>(min(cast<uint16_t>(value) + value, 255));
  Buffer<uint8_t> n = narrow.realize({3});
  Buffer<uint16_t> w = wide.realize({3});
  Buffer<uint8_t> c = clamped.realize({3});
  for (int i = 0; i < 3; i++) printf("%d %d %d\n", n(i), w(i), c(i));

  // Division and remainder round towards minus infinity.
  Func quotients("quotients");
  quotients(x) = Tuple((x - 5) / 3, (x - 5) % 3, cast<int>(cast<float>(x - 5) / 3));
  Realization q = quotients.realize({11});
  Buffer<int> d = q[0], m = q[1], t = q[2];
  for (int i = 0; i < 11; i++) printf("%d:%d:%d ", d(i), m(i), t(i));
  printf("\n");

  // One function for every type: a product that cannot overflow, as integers get twice their bits.
  auto product = [](Expr a, Expr b) {
    const Type type = a.type(), fits = type.is_float() ? type : type.with_bits(2 * type.bits());
    return cast(fits, a) * cast(fits, b);
  };
  Expr low = cast<int8_t>(-128), high = cast<int8_t>(127);
  printf("product: %d %d %g, as %s\n", (int)evaluate<int16_t>(product(low, high)),
         evaluate<int32_t>(product(cast<int16_t>(-32768), cast<int16_t>(-3))),
         evaluate<double>(product(Expr(0.25), Expr(3.0))), name(product(low, low).type()).c_str());

  // Reinterpreting bits.
  printf("bits of 1.0f: %x, and back %g\n", evaluate<uint32_t>(reinterpret<uint32_t>(Expr(1.0f))),
         evaluate<float>(reinterpret<float>(Expr((uint32_t)0x40490fdb))));
  return 0;
}

// Stencils, resampling, boundary conditions, gathers, implicit variables, several outputs.

PIPELINE(box_blur) {
  Buffer<uint8_t> in = noise<uint8_t>({70, 40}, 1);
  Func wide("wide"), bx("bx"), by("by");
  wide(x, y) = cast<uint16_t>(in(x, y));
  bx(x, y) = (wide(x, y) + wide(x + 1, y) + wide(x + 2, y)) / 3;
  by(x, y) = cast<uint8_t>((bx(x, y) + bx(x, y + 1) + bx(x, y + 2)) / 3);
  if (scheduled) {
    by.split(y, yo, yi, 8).vectorize(x, 8).parallel(yo);
    bx.compute_at(by, yo).vectorize(x, 8);
  }
  return {{by}, {{67, 37}}, {}};
}

PIPELINE(shifted_output) {
  Buffer<int32_t> in = noise<int32_t>({40, 30}, 1);
  in.set_min(-20, 100);
  Func f("f"), g("g");
  f(x, y) = in(x, y) * 3 - x + y;
  g(x, y) = f(x - 1, y) + f(x + 1, y) - f(x, y + 1);
  if (scheduled) f.compute_root().vectorize(x, 4);
  return {{g}, {{30, 20}}, {{-15, 105}}};
}

static Func bounded(int which, const Buffer<int16_t>& in) {
  switch (which) {
    case 0:
      return BoundaryConditions::constant_exterior(in, cast<int16_t>(77));
    case 1:
      return BoundaryConditions::repeat_edge(in);
    case 2:
      return BoundaryConditions::repeat_image(in);
    case 3:
      return BoundaryConditions::mirror_image(in);
    default:
      return BoundaryConditions::mirror_interior(in);
  }
}
static Built boundary(int which, bool scheduled) {
  Buffer<int16_t> in = noise<int16_t>({17, 11}, 1);
  Func b = bounded(which, in), f("f");
  f(x, y) = b(x - 3, y + 2) * 2 + b(x + 4, y - 5);
  if (scheduled) f.vectorize(x, 8, TailStrategy::GuardWithIf).parallel(y);
  return {{f}, {{41, 29}}, {{-12, -9}}};
}
PIPELINE(boundary_constant) { return boundary(0, scheduled); }
PIPELINE(boundary_repeat_edge) { return boundary(1, scheduled); }
PIPELINE(boundary_repeat_image) { return boundary(2, scheduled); }
PIPELINE(boundary_mirror_image) { return boundary(3, scheduled); }
PIPELINE(boundary_mirror_interior) { return boundary(4, scheduled); }

PIPELINE(pyramid) {
  Buffer<float> in = noise<float>({64, 64}, 1);
  Func base = BoundaryConditions::repeat_edge(in), down("down"), down2("down2"), up("up"),
       out("out");
  down(x, y) =
      (base(2 * x - 1, y) + 3 * base(2 * x, y) + 3 * base(2 * x + 1, y) + base(2 * x + 2, y)) / 8;
  down2(x, y) =
      (down(x, 2 * y - 1) + 3 * down(x, 2 * y) + 3 * down(x, 2 * y + 1) + down(x, 2 * y + 2)) / 8;
  up(x, y) = 0.75f * down2(x / 2, y / 2) + 0.25f * down2(x / 2 - 1 + 2 * (x % 2), y / 2);
  out(x, y) = in(x, y) - up(x, y);
  if (scheduled) {
    down.compute_root().vectorize(x, 8);
    down2.compute_root();
    out.tile(x, y, xi, yi, 16, 8).vectorize(xi, 8);
    up.compute_at(out, x);
  }
  return {{out}, {{64, 64}}, {}};
}

PIPELINE(transpose_and_rotate) {
  Buffer<uint8_t> in = noise<uint8_t>({20, 30, 3}, 1);
  Func f("f"), g("g");
  f(x, y, c) = in(y, 29 - x, c);
  g(x, y, c) = f(x, y, c) + f(29 - x, y, (c + 1) % 3);
  if (scheduled) {
    f.compute_root();
    g.reorder(c, x, y).unroll(c, 3).vectorize(x, 4, TailStrategy::GuardWithIf);
  }
  g.bound(c, 0, 3);
  return {{g}, {{30, 20, 3}}, {}};
}

PIPELINE(lookup_table) {
  Buffer<uint8_t> in = noise<uint8_t>({50, 20}, 1);
  Func lut("lut"), f("f");
  Var i("i");
  lut(i) = cast<uint16_t>(i * i / 3 + 17);
  f(x, y) = lut(in(x, y)) + lut(clamp(cast<int>(in(x, y)) - 10, 0, 255));
  if (scheduled) {
    lut.compute_root();
    f.vectorize(x, 8);
  }
  return {{f}, {{50, 20}}, {}};
}

PIPELINE(gather_through_indices) {
  Buffer<uint8_t> where = noise<uint8_t>({33, 9}, 1);
  Buffer<float> values = noise<float>({16, 16}, 2);
  Func f("f");
  Expr i = cast<int>(where(x, y));
  f(x, y) = values(i % 16, i / 16) + values(clamp(x - 5, 0, 15), clamp(y + i, 0, 15));
  return {{f}, {{33, 9}}, {}};
}

PIPELINE(implicit_variables) {
  Buffer<int32_t> in = noise<int32_t>({20, 10, 4}, 1);
  Func f("f"), g("g"), h("h");
  f(_) = in(_) + 1;
  g(x, _) = f(x + 1, _) * 2;
  h(x, _) = g(x, _) - f(_0 + 0 * x, _1, _2);
  return {{g}, {{19, 10, 4}}, {}};
}

PIPELINE(several_outputs) {
  Buffer<uint8_t> in = noise<uint8_t>({32, 24}, 1);
  Func shared("shared"), a("a"), b("b"), d("d");
  shared(x, y) = cast<int32_t>(in(x, y)) * 5 - 300;
  a(x, y) = cast<int16_t>(shared(x, y) + shared(x + 1, y));
  b(x) = cast<float>(shared(x, 3)) / 2;
  d(x, y) = Tuple(shared(x, y) > 0, shared(y, x));
  if (scheduled) shared.compute_root();
  return {{a, b, d}, {{31, 24}, {32}, {24, 24}}, {}};
}

PIPELINE(tuples) {
  Buffer<float> in = noise<float>({40, 10}, 1);
  Func f("f"), g("g"), h("h");
  f(x, y) = Tuple(in(x, y), cast<int32_t>(in(x, y) * 8.0f), in(x, y) > 0.0f);
  g(x, y) = Tuple(f(x, y)[1] + x, f(x, y)[0] * 2.0f);
  h(x, y) = Tuple(select(f(x, y)[2], g(x, y)[0], -1), g(x, y)[1]);
  if (scheduled) f.compute_root();
  return {{h}, {{40, 10}}, {}};
}

PIPELINE(tuple_select) {
  Buffer<int32_t> in = noise<int32_t>({40}, 1);
  Func f("f"), g("g");
  f(x) = Tuple(in(x), cast<uint8_t>(x));
  g(x) = tuple_select(in(x) > 0, Tuple(f(x)), Tuple(f(39 - x)));
  return {{g}, {{40}}, {}};
}

PIPELINE(parameters) {
  Param<int32_t> gain("gain");
  Param<float> bias("bias");
  ImageParam in(Int(16), 2, "in");
  gain.set(7);
  bias.set(0.375f);
  in.set(noise<int16_t>({30, 20}, 1));
  Func f("f");
  f(x, y) = in(x, y) * gain + cast<int32_t>(bias * 16.0f) + in.width() - in.dim(1).extent();
  return {{f}, {{30, 20}}, {}};
}

PIPELINE(demosaic) {
  Buffer<uint16_t> raw = noise<uint16_t>({48, 32}, 1);
  Func m = BoundaryConditions::mirror_interior(raw), g("g"), out("out");
  auto at = [&](int dx, int dy) { return cast<int32_t>(m(x + dx, y + dy)); };
  g(x, y) =
      select((x + y) % 2 == 0, at(0, 0), (at(-1, 0) + at(1, 0) + at(0, -1) + at(0, 1) + 2) / 4);
  Expr red = select(x % 2 == 1 && y % 2 == 0, at(0, 0), g(x, y) + (at(1, 0) - at(-1, 0)) / 2);
  Expr blue = select(x % 2 == 0 && y % 2 == 1, at(0, 0), g(x, y) + (at(0, 1) - at(0, -1)) / 2);
  out(x, y, c) = saturating_cast<uint16_t>(mux(c, {red, g(x, y), blue}));
  if (scheduled) {
    out.reorder(c, x, y).bound(c, 0, 3).unroll(c);
    g.compute_at(out, y).vectorize(x, 8);
  }
  return {{out}, {{48, 32, 3}}, {}};
}

PIPELINE(bilateral_filter) {
  Buffer<float> in = noise<float>({40, 24}, 1);
  Func b = BoundaryConditions::repeat_edge(in), f("f");
  RDom r(-2, 5, -2, 5);
  Expr d = b(x + r.x, y + r.y) - b(x, y);
  Expr weight = exp(-d * d / 8.0f - cast<float>(r.x * r.x + r.y * r.y) / 4.0f);
  f(x, y) = sum(weight * b(x + r.x, y + r.y)) / sum(weight);
  if (scheduled) f.vectorize(x, 8).parallel(y);
  return {{f}, {{40, 24}}, {}};
}

PIPELINE(crops_and_slices) {
  Buffer<int32_t> in = noise<int32_t>({30, 20, 4}, 1);
  Buffer<int32_t> cropped = in.copy();
  cropped.crop(0, 5, 20);
  cropped.crop(1, 2, 10);
  Buffer<int32_t> plane = in.copy();
  plane.slice(2, 3);
  Func f("f");
  f(x, y) = cropped(x, y, 1) - plane(x, y) + cropped.dim(0).min();
  return {{f}, {{20, 10}}, {{5, 2}}};
}

// The same definitions under every directive and tail strategy.

static Func stencil_source(const Buffer<int32_t>& in, const char* name) {
  Func b = BoundaryConditions::repeat_edge(in), f(name);
  f(x, y) = b(x - 1, y) + 2 * b(x, y) + b(x + 1, y - 1);
  return f;
}

PIPELINE(tail_guard_with_if) {
  Func f = stencil_source(noise<int32_t>({40, 30}, 1), "f");
  if (scheduled)
    f.split(x, xo, xi, 8, TailStrategy::GuardWithIf)
        .vectorize(xi)
        .unroll(y, 3, TailStrategy::GuardWithIf);
  return {{f}, {{37, 29}}, {}};
}

PIPELINE(tail_shift_inwards) {
  Func f = stencil_source(noise<int32_t>({40, 30}, 1), "f");
  if (scheduled) f.tile(x, y, xo, yo, xi, yi, 16, 4, TailStrategy::ShiftInwards).vectorize(xi, 8);
  return {{f}, {{37, 29}}, {}};
}

PIPELINE(tail_round_up) {
  Func f = stencil_source(noise<int32_t>({40, 30}, 1), "f"), g("g");
  g(x, y) = f(x, y) + f(x + 1, y + 1);
  if (scheduled) f.compute_root().split(x, xo, xi, 8, TailStrategy::RoundUp).vectorize(xi);
  return {{g}, {{37, 29}}, {}};
}

PIPELINE(fuse_and_parallel) {
  Func f = stencil_source(noise<int32_t>({40, 30}, 1), "f");
  if (scheduled) f.fuse(x, y, t).parallel(t, 16, TailStrategy::GuardWithIf);
  return {{f}, {{37, 29}}, {}};
}

PIPELINE(reorder_and_unroll) {
  Func f = stencil_source(noise<int32_t>({40, 30}, 1), "f");
  if (scheduled) f.reorder(y, x).unroll(y, 4).vectorize(x, 4);
  return {{f}, {{36, 28}}, {}};
}

PIPELINE(sliding_window) {
  Func f = stencil_source(noise<int32_t>({40, 30}, 1), "f"), g("g");
  g(x, y) = f(x, y) + f(x, y + 1) * f(x, y + 2);
  if (scheduled) f.store_root().compute_at(g, y);
  return {{g}, {{37, 27}}, {}};
}

PIPELINE(store_at_outer) {
  Func f = stencil_source(noise<int32_t>({40, 40}, 1), "f"), g("g");
  g(x, y) = f(x, y) - f(x, y + 2) + f(x + 1, y + 1);
  if (scheduled) {
    g.split(y, yo, yi, 8);
    f.store_at(g, yo).compute_at(g, yi).vectorize(x, 4);
  }
  return {{g}, {{33, 37}}, {}};
}

PIPELINE(nested_compute_at) {
  Func f = stencil_source(noise<int32_t>({40, 40}, 1), "f"), g("g"), h("h");
  g(x, y) = f(x, y) + f(x + 1, y);
  h(x, y) = g(x, y) + g(x, y + 1) + f(x, y);
  if (scheduled) {
    h.tile(x, y, xo, yo, xi, yi, 8, 8);
    g.compute_at(h, xo).vectorize(x, 4);
    f.compute_at(h, xo);
  }
  return {{h}, {{39, 35}}, {}};
}

PIPELINE(update_schedules) {
  Buffer<int32_t> in = noise<int32_t>({50, 50}, 1);
  RDom r(0, 7, 0, 5);
  RVar ro("ro"), ri("ri");
  Func f("f"), g("g");
  f(x, y) = x - y;
  f(x, y) += in(x + r.x, y + r.y) * (r.x - r.y);
  g(x, y) = f(x, y) * 3;
  if (scheduled) {
    f.compute_at(g, yo).vectorize(x, 8);
    f.update().split(r.x, ro, ri, 2).reorder(x, ri, ro, r.y, y).vectorize(x, 4).unroll(ri);
    g.split(y, yo, yi, 6).parallel(yo);
  }
  return {{g}, {{37, 41}}, {}};
}

PIPELINE(tiled_tuple) {
  Buffer<int32_t> in = noise<int32_t>({50, 50}, 1);
  Func f("f"), g("g");
  f(x, y) = Tuple(in(x, y) + 1, cast<uint8_t>(in(x, y)));
  g(x, y) = Tuple(f(x, y)[0] + f(x + 1, y)[0], f(x, y)[1] - f(x, y + 1)[1]);
  if (scheduled) {
    g.tile(x, y, xo, yo, xi, yi, 8, 8, TailStrategy::GuardWithIf).parallel(yo).vectorize(xi);
    f.compute_at(g, xo).vectorize(x, 8);
  }
  return {{g}, {{43, 45}}, {}};
}

PIPELINE(long_chain) {
  Buffer<uint16_t> in = noise<uint16_t>({100, 4}, 1);
  Func last = BoundaryConditions::mirror_image(in);
  for (int i = 0; i < 12; ++i) {
    Func next("chain" + std::to_string(i));
    next(x, y) = cast<uint16_t>((last(x - 1, y) + last(x, y) * 2 + last(x + 1, y)) / 4 + i);
    if (scheduled && i % 3 == 0) next.compute_root().vectorize(x, 8);
    if (!scheduled && i % 2 == 0) next.compute_root();
    last = next;
  }
  return {{last}, {{100, 4}}, {}};
}

PIPELINE(compute_with_other_ranges) {
  Func f = stencil_source(noise<int32_t>({40, 30}, 1), "f"), g("g"), h("h");
  g(x, y) = x * 3 - y * y;
  h(x, y) = f(x, y) + f(x + 1, y + 2) * g(x, y) - g(x - 3, y - 1);
  if (scheduled) {
    f.compute_root();
    g.compute_root().compute_with(f, x, LoopAlignStrategy::AlignEnd);
  }
  return {{h}, {{33, 27}}, {}};
}

PIPELINE(compute_with_producer_inside) {
  Func p = stencil_source(noise<int32_t>({40, 40}, 1), "p"), f("f"), g("g"), h("h");
  f(x, y) = p(x, y) + p(x + 1, y);
  g(x, y) = p(x, y + 1) * 3;
  h(x, y) = f(x, y) - g(x, y);
  if (scheduled) {
    h.split(y, yo, yi, 8, TailStrategy::GuardWithIf);
    f.compute_at(h, yo).vectorize(x, 8);
    g.compute_at(h, yo).vectorize(x, 8).compute_with(f, y);
    p.compute_at(f, y);
  }
  return {{h}, {{37, 29}}, {}};
}

PIPELINE(compute_with_updates) {
  Func f("f"), g("g"), h("h");
  RDom r(0, 9);
  f(x, y) = x + y;
  f(x, y) += r * x;
  g(x, y) = x * y;
  g(x, y) = g(x, y) * 3 + x;
  h(x, y) = f(x, y) - g(x, y);
  if (scheduled) {
    f.compute_root();
    g.compute_root().compute_with(f, x);
    g.update(0).compute_with(f.update(0), y, LoopAlignStrategy::AlignStart);
  }
  return {{h}, {{21, 17}}, {}};
}

PIPELINE(compute_with_outputs) {
  Func f("f"), g("g");
  f(x, y) = x + 2 * y;
  g(x, y) = x * y;
  if (scheduled) g.compute_with(f, y);
  return {{f, g}, {{31, 13}, {16, 29}}, {}};
}

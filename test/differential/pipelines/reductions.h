// Reduction domains, updates, scans, scatters, reductions of Tuples.

PIPELINE(inline_reductions) {
  Buffer<int32_t> in = noise<int32_t>({40, 12}, 1);
  RDom r(0, 5);
  Func f("f");
  f(x, y) = Tuple(sum(in(x + r, y)), maximum(in(x + r, y)), minimum(in(x + r, y)),
                  product(in(x + r, y) % 5 + 1));
  return {{f}, {{36, 12}}, {}};
}

PIPELINE(argument_reductions) {
  Buffer<uint8_t> in = noise<uint8_t>({40, 40}, 1);
  RDom r(0, 7, 0, 3);
  Func f("f"), g("g");
  f(x, y) = argmax(in(x + r.x, y + r.y));
  g(x, y) = argmin(cast<int32_t>(in(x + r.x, y + r.y) % 4));
  return {{f, g}, {{34, 38}, {34, 38}}, {}};
}

PIPELINE(float_sums) {
  Buffer<float> in = noise<float>({64, 64}, 1);
  RDom r(0, 64);
  Func rows("rows"), total("total");
  rows(y) += in(r, y) * in(y, r);
  total() += rows(r) / 64.0f;
  if (scheduled) rows.compute_root();
  return {{rows, total}, {{64}, {}}, {}};
}

PIPELINE(predicated_reduction) {
  Buffer<int16_t> in = noise<int16_t>({32, 32}, 1);
  RDom r(0, 32, 0, 32);
  r.where(r.x + r.y < 40);
  r.where(in(r.x, r.y) > 0 || r.x % 3 == 0);
  Func count("count"), f("f");
  count() = 0;
  count() += cast<int32_t>(in(r.x, r.y));
  f(x) = 1;
  f(r.x) += cast<int32_t>(in(r.x, r.y)) * (r.y + 1);
  return {{count, f}, {{}, {32}}, {}};
}

PIPELINE(triangular_domain) {
  RDom r(0, 20, 0, 20);
  r.where(r.y <= r.x);
  Func f("f");
  f(x, y) = x * 100 + y;
  f(r.x, r.y) = f(r.y, r.x) + 7;
  if (scheduled) f.compute_root();
  return {{f}, {{20, 20}}, {}};
}

// Each pixel's rank, 0 to 99, among the pixels of its column block: a histogram of 16 values, a
// scan from the right that counts pixels at least as bright, and a gather.
PIPELINE(ranks_in_blocks) {
  const int columns = 48, rows = 27, block = 16;
  Buffer<uint8_t> in = noise<uint8_t>({columns, rows}, 1);
  RDom pixel(0, columns, 0, rows), right(0, 15);
  Func count("count"), at_least("at_least"), rank("rank");
  Expr value = in(pixel.x, pixel.y) / cast<uint8_t>(16);
  count(x, y) = 0;
  count(clamp(cast<int>(value), 0, 15), pixel.x / block) += 1;
  at_least(x, y) = count(x, y);
  at_least(14 - right, y) += at_least(15 - right, y);
  rank(x, y) = cast<uint8_t>(at_least(in(x, y) >> 4, x / block) * 99 / (block * rows));
  count.compute_root();
  at_least.compute_root();
  if (scheduled) {
    count.vectorize(x, 8);
    at_least.update().vectorize(y, 2, TailStrategy::GuardWithIf);
    rank.parallel(y).vectorize(x, 16);
  }
  return {{rank, at_least}, {{columns, rows}, {16, columns / block}}, {}};
}

PIPELINE(scans) {
  Buffer<int32_t> in = noise<int32_t>({25, 18}, 1);
  RDom rx(1, 24), ry(1, 17);
  Func f("f");
  f(x, y) = in(x, y) % 100;
  f(rx, y) += f(rx - 1, y);
  f(x, ry) += f(x, ry - 1);
  if (scheduled) {
    f.compute_root();
    f.update(0).parallel(y);
    f.update(1).vectorize(x, 8, TailStrategy::GuardWithIf);
  }
  return {{f}, {{25, 18}}, {}};
}

PIPELINE(recursive_filter) {
  Buffer<float> in = noise<float>({40, 6}, 1);
  RDom r(1, 39);
  Func f("f"), g("g");
  f(x, y) = in(x, y);
  f(r, y) = 0.75f * f(r - 1, y) + 0.25f * in(r, y);
  f(39 - r, y) = 0.5f * f(40 - r, y) + 0.5f * f(39 - r, y);
  g(x, y) = f(x, y) * 2.0f;
  f.compute_root();
  return {{g}, {{40, 6}}, {}};
}

PIPELINE(many_updates) {
  Func f("f"), g("g");
  f(x, y) = x + y;
  f(x, 3) = 100;
  f(5, y) += 11;
  f(x, y) *= 2;
  f(2, 2) -= 7;
  f(x, y) = f(x, y) - x * y;
  g(x, y) = f(x, y) + f(y, x);
  if (scheduled) {
    f.compute_root().vectorize(x, 8);
    f.update(2).vectorize(x, 8, TailStrategy::GuardWithIf);
    f.update(4).parallel(y);
  }
  return {{g}, {{19, 17}}, {}};
}

PIPELINE(implicit_initial_values) {
  Buffer<int32_t> in = noise<int32_t>({20}, 1);
  RDom r(0, 4);
  Func a("a"), p("p"), s("s");
  a(x) += in(x + r);
  p(x) *= in(x + r) % 5;
  s(x) -= in(x + r);
  return {{a, p, s}, {{16}, {16}, {16}}, {}};
}

PIPELINE(complex_multiplication) {
  RDom r(0, 8);
  Func f("f");
  f(x) = Tuple(cast<float>(x) / 8.0f, 1.0f);
  f(x) = Tuple(f(x)[0] * 0.5f - f(x)[1] * (cast<float>(r) / 8.0f),
               f(x)[0] * (cast<float>(r) / 8.0f) + f(x)[1] * 0.5f);
  return {{f}, {{33}}, {}};
}

PIPELINE(mandelbrot) {
  Func z("z"), count("count");
  RDom r(1, 12);
  Expr cr = cast<float>(x - 24) / 16.0f, ci = cast<float>(y - 12) / 8.0f;
  z(x, y, t) = Tuple(0.0f, 0.0f);
  Expr re = z(x, y, r - 1)[0], im = z(x, y, r - 1)[1];
  Expr small = re * re + im * im < 4.0f;
  z(x, y, r) =
      Tuple(select(small, re * re - im * im + cr, re), select(small, 2.0f * re * im + ci, im));
  RDom q(0, 13);
  count(x, y) = argmin(z(x, y, q)[0] * z(x, y, q)[0] + z(x, y, q)[1] * z(x, y, q)[1] < 4.0f)[0];
  z.compute_root();
  return {{count}, {{32, 24}}, {}};
}

PIPELINE(tuple_argmin) {
  Buffer<int32_t> in = noise<int32_t>({16, 30}, 1);
  RDom r(0, 30);
  Func best("best");
  best(x) = Tuple(1000000, -1);
  Expr better = in(x, r) < best(x)[0];
  best(x) = Tuple(select(better, in(x, r), best(x)[0]), select(better, r, best(x)[1]));
  return {{best}, {{16}}, {}};
}

PIPELINE(matrix_multiplication) {
  Buffer<int16_t> a = noise<int16_t>({20, 24}, 1), b = noise<int16_t>({24, 20}, 2);
  RDom k(0, 20);
  Func f("f"), out("out");
  f(x, y) += cast<int32_t>(a(k, y)) % 256 * (b(x, k) % 256);
  out(x, y) = f(x, y);
  if (scheduled) {
    out.tile(x, y, xi, yi, 8, 4).vectorize(xi, 8).parallel(y);
    f.compute_at(out, x).vectorize(x, 8);
    f.update().reorder(x, k, y).vectorize(x, 8).unroll(y, 2);
  }
  return {{out}, {{24, 24}}, {}};
}

PIPELINE(scatter) {
  Buffer<uint8_t> where = noise<uint8_t>({60}, 1);
  RDom r(0, 60);
  Func f("f");
  f(x, y) = 0;
  f(clamp(cast<int>(where(r)) % 20, 0, 19), r % 4) = r;
  f(where(r) % 20, y) += y + 1;
  return {{f}, {{20, 4}}, {}};
}

PIPELINE(undefined_initial_values) {
  RDom r(0, 16);
  Func f("f");
  f(x) = undef<int32_t>();
  f(r) = r * r;
  f(r) = select(r % 3 == 0, f(r) + 1000, undef<int32_t>());
  return {{f}, {{16}}, {}};
}

PIPELINE(game_of_life) {
  Buffer<uint8_t> in = noise<uint8_t>({32, 32}, 1);
  Func cells("cells"), next("next"), next2("next2");
  cells(x, y) = in(x, y) % 2;
  auto step = [&](Func& to, Func from) {
    Func wrapped =
        BoundaryConditions::repeat_image(from, {{Expr(0), Expr(32)}, {Expr(0), Expr(32)}});
    RDom n(-1, 3, -1, 3);
    Expr alive = sum(cast<uint8_t>(wrapped(x + n.x, y + n.y))) - wrapped(x, y);
    to(x, y) = cast<uint8_t>(alive == 3 || (alive == 2 && wrapped(x, y) == 1));
  };
  step(next, cells);
  step(next2, next);
  next.compute_root();
  cells.compute_root();
  return {{next2}, {{32, 32}}, {}};
}

// Updates whose iterations never access one element twice, parallel and vectorized.

static Func line_of_squares(const char* name) {
  Func f(name);
  f(x) = x * x;
  return f;
}

PIPELINE(update_reversed_half) {
  Func f = line_of_squares("f");
  RDom r(0, 8);
  f(15 - r) = f(r) * 2;
  if (scheduled) f.update().parallel(r);
  return {{f}, {{16}}, {}};
}

PIPELINE(update_from_other_half) {
  Func f = line_of_squares("f");
  RDom r(0, 8);
  f(r) = f(r + 8) - 1;
  if (scheduled) f.update().vectorize(r, 4);
  return {{f}, {{16}}, {}};
}

PIPELINE(update_lifting_steps) {
  Func f = line_of_squares("f");
  RDom r(0, 7);
  f(2 * r + 1) -= (f(2 * r) + f(2 * r + 2)) / 2;
  f(2 * r + 2) += f(2 * r + 1) / 4;
  if (scheduled) {
    f.update(0).vectorize(r, 4, TailStrategy::GuardWithIf);
    f.update(1).parallel(r);
  }
  return {{f}, {{16}}, {}};
}

PIPELINE(update_quarter_turn) {
  Func f("f");
  RDom r(0, 6, 0, 6);
  f(x, y) = x - 3 * y;
  f(r.y, 5 - r.x) = r.x * 100 + r.y;
  if (scheduled) f.update().parallel(r.y).vectorize(r.x, 3);
  return {{f}, {{6, 6}}, {}};
}

PIPELINE(unrolled_below_a_bound) {
  Func f("f");
  Param<int32_t> n;
  n.set(3);
  RDom r(0, clamp(n, 0, 4));
  f(x) = 0;
  f(x) += x * r;
  if (scheduled) f.update().unroll(r);
  return {{f}, {{9}}, {}};
}

PIPELINE(coordinates_from_absolute_values) {
  Buffer<float> image = noise<float>({20, 10}, 5);
  Func table("table"), f("f");
  table(x) = x * x;
  f(x, y) =
      table(cast<int>(abs(cast<float>(x - 7)))) + table(min(cast<int>(abs(image(x, y)) * 3.0f), 9));
  if (scheduled) {
    table.compute_root();
    f.vectorize(x, 4).parallel(y);
  }
  return {{f}, {{20, 10}}, {}};
}

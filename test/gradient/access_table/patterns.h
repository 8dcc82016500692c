// The access patterns of the table, written in the subset that Halide and Retrograde share. This file is included
// inside a namespace in which the names of one of the two languages are visible.

struct Pattern {
  Description description;
  Func (*build)(const Func& in);
};

static Var x("x"), y("y"), c("c");

static Func made(const Expr& value, const std::vector<Var>& args) {
  Func out("out");
  out(args) = value;
  return out;
}
static Func summed(const Expr& term, const std::vector<Var>& args) {
  Func out("out");
  out(args) = 0.0f;
  out(args) += term;
  return out;
}
// Integers that no analysis can know: a permutation of 0, 1, 2, ... below `bound`.
static Expr data(const Expr& i, int bound) {
  static Func table("table");
  static Var t("t");
  if (!table.defined()) table(t) = cast<int>(abs(sin(cast<float>(t) * 12.9898f)) * 40.0f);
  return clamp(table(i) % bound, 0, bound - 1);
}

static std::vector<Pattern> patterns() {
  using enum Nature;
  return {
      {{"in(x)", QuasiAffine, {12}, {12}}, [](const Func& in) { return made(in(x), {x}); }},
      {{"in(x + 3)", QuasiAffine, {15}, {12}}, [](const Func& in) { return made(in(x + 3), {x}); }},
      {{"in(11 - x)", QuasiAffine, {12}, {12}},
       [](const Func& in) { return made(in(11 - x), {x}); }},
      {{"in(2*x)", QuasiAffine, {24}, {12}}, [](const Func& in) { return made(in(2 * x), {x}); }},
      {{"in(3*x + 1)", QuasiAffine, {36}, {12}},
       [](const Func& in) { return made(in(3 * x + 1), {x}); }},
      {{"in(x/4)", QuasiAffine, {3}, {12}}, [](const Func& in) { return made(in(x / 4), {x}); }},
      {{"in(x%5)", QuasiAffine, {5}, {12}}, [](const Func& in) { return made(in(x % 5), {x}); }},
      {{"in(3)", QuasiAffine, {12}, {12}}, [](const Func& in) { return made(in(3), {x}); }},
      {{"in(x) for all y", QuasiAffine, {6}, {6, 5}},
       [](const Func& in) {
         return made(in(x), {x, y});
       }},
      {{"convolution: sum in(x + r)", QuasiAffine, {14}, {12}},
       [](const Func& in) {
         RDom r(0, 3);
         return summed(in(x + r), {x});
       }},
      {{"convolution, flipped: sum in(x - r + 2)", QuasiAffine, {14}, {12}},
       [](const Func& in) {
         RDom r(0, 3);
         return summed(in(x - r + 2) * cast<float>(r + 1), {x});
       }},
      {{"strided: sum in(2*x + r)", QuasiAffine, {25}, {12}},
       [](const Func& in) {
         RDom r(0, 3);
         return summed(in(2 * x + r) * cast<float>(r + 1), {x});
       }},
      {{"dilated: sum in(x + 3*r)", QuasiAffine, {18}, {12}},
       [](const Func& in) {
         RDom r(0, 3);
         return summed(in(x + 3 * r) * cast<float>(r + 1), {x});
       }},
      {{"strided and dilated, 2D", QuasiAffine, {13, 13}, {5, 5}},
       [](const Func& in) {
         RDom r(0, 3, 0, 3);
         return summed(in(2 * x + 2 * r.x, 2 * y + 2 * r.y) * cast<float>(r.x + 2 * r.y + 1),
                       {x, y});
       }},
      {{"2x2 averages", QuasiAffine, {12, 10}, {6, 5}},
       [](const Func& in) {
         RDom r(0, 2, 0, 2);
         return summed(in(2 * x + r.x, 2 * y + r.y), {x, y});
       }},
      {{"in(x/2 + r)", QuasiAffine, {8}, {12}},
       [](const Func& in) {
         RDom r(0, 3);
         return summed(in(x / 2 + r) * cast<float>(r + 1), {x});
       }},
      {{"pixel shuffle: in(4*x + c)", QuasiAffine, {24}, {6, 4}},
       [](const Func& in) {
         return made(in(4 * x + c), {x, c});
       }},
      {{"pixel unshuffle: in(x/4, x%4)", QuasiAffine, {6, 4}, {24}},
       [](const Func& in) { return made(in(x / 4, x % 4), {x}); }},
      {{"Bayer: in(x/2, y/2, x%2 + 2*(y%2))", QuasiAffine, {5, 4, 4}, {10, 8}},
       [](const Func& in) {
         return made(in(x / 2, y / 2, x % 2 + 2 * (y % 2)), {x, y});
       }},
      {{"in(clamp(x - 3, 0, 9))", QuasiAffine, {10}, {18}},
       [](const Func& in) { return made(in(clamp(x - 3, 0, 9)), {x}); }},
      {{"repeated edge, 2D", QuasiAffine, {6, 5}, {8, 7}},
       [](const Func& in) {
         return made(in(clamp(x - 1, 0, 5), clamp(y - 1, 0, 4)), {x, y});
       }},
      {{"blur of a repeated edge", QuasiAffine, {10}, {10}},
       [](const Func& in) {
         RDom r(-1, 3);
         return summed(in(clamp(x + r, 0, 9)) * cast<float>(r + 2), {x});
       }},
      {{"clamp with a parameter", QuasiAffine, {10}, {16}},
       [](const Func& in) {
         Param<int> n("n");
         n.set(10);
         return made(in(clamp(x - 3, 0, n - 1)), {x});
       }},
      {{"strided and mirrored, clamped with parameters", QuasiAffine, {4, 6}, {12}},
       [](const Func& in) {
         Param<int> w("w"), h("h"), p("p");
         w.set(4);
         h.set(6);
         p.set(-3);
         return made(in(max(min((2 - x) / 3 + 1, w - 1), 0), h - 1 - max(min(x + p, h - 1), 0)),
                     {x});
       }},
      {{"three clamps of x with parameters", QuasiAffine, {4, 5, 3}, {10}},
       [](const Func& in) {
         Param<int> w("w"), h("h"), d("d"), p("p"), q("q");
         w.set(4);
         h.set(5);
         d.set(3);
         p.set(2);
         q.set(-4);
         return made(in(clamp(x, 0, w - 1), clamp(x + p, 0, h - 1), clamp(x + q, 0, d - 1)), {x});
       }},
      {{"sum along a shear, clamped with parameters", QuasiAffine, {6, 5}, {6, 5}},
       [](const Func& in) {
         Param<int> w("w"), h("h");
         w.set(6);
         h.set(5);
         RDom r(0, 3);
         return summed(in(clamp(x + r, 0, w - 1), clamp(y - r, 0, h - 1)) * cast<float>(r + 1),
                       {x, y});
       }},
      {{"mirror: select of three", QuasiAffine, {8}, {16}},
       [](const Func& in) {
         Expr u = x - 4;
         return made(in(select(u<0, -1 - u, u> 7, 15 - u, u)), {x});
       }},
      {{"wrap: in((x + 3)%8)", QuasiAffine, {8}, {16}},
       [](const Func& in) { return made(in((x + 3) % 8), {x}); }},
      {{"in(min(x, 5))", QuasiAffine, {6}, {12}},
       [](const Func& in) { return made(in(min(x, 5)), {x}); }},
      {{"in(max(x, y))", QuasiAffine, {6}, {6, 6}},
       [](const Func& in) {
         return made(in(max(x, y)), {x, y});
       }},
      {{"in(min(x, y), max(x, y))", QuasiAffine, {6, 6}, {6, 6}},
       [](const Func& in) {
         return made(in(min(x, y), max(x, y)), {x, y});
       }},
      {{"in(x < 5 ? x + 5 : 9 - x)", QuasiAffine, {10}, {10}},
       [](const Func& in) { return made(in(select(x < 5, x + 5, 9 - x)), {x}); }},
      {{"in(|x - 5|)", QuasiAffine, {7}, {12}},
       [](const Func& in) { return made(in(cast<int>(abs(x - 5))), {x}); }},
      {{"transpose: in(y, x)", QuasiAffine, {5, 6}, {6, 5}},
       [](const Func& in) {
         return made(in(y, x), {x, y});
       }},
      {{"rotation: in(y, 5 - x)", QuasiAffine, {5, 6}, {6, 5}},
       [](const Func& in) {
         return made(in(y, 5 - x), {x, y});
       }},
      {{"shear: in(x + y, y)", QuasiAffine, {11, 5}, {6, 5}},
       [](const Func& in) {
         return made(in(x + y, y), {x, y});
       }},
      {{"shear of a sum: in(x + r, y - r + 2)", QuasiAffine, {8, 7}, {6, 5}},
       [](const Func& in) {
         RDom r(0, 3);
         return summed(in(x + r, y - r + 2) * cast<float>(r + 1), {x, y});
       }},
      {{"unimodular: in(2*x + y, x + y)", QuasiAffine, {16, 11}, {6, 5}},
       [](const Func& in) {
         return made(in(2 * x + y, x + y), {x, y});
       }},
      {{"diagonal: in(x, x)", QuasiAffine, {8, 8}, {8}},
       [](const Func& in) { return made(in(x, x), {x}); }},
      {{"antidiagonal: in(x, 7 - x)", QuasiAffine, {8, 8}, {8}},
       [](const Func& in) { return made(in(x, 7 - x), {x}); }},
      {{"in(x + y)", QuasiAffine, {10}, {6, 5}},
       [](const Func& in) {
         return made(in(x + y), {x, y});
       }},
      {{"in(x + 2*y + r)", QuasiAffine, {16}, {6, 5}},
       [](const Func& in) {
         RDom r(0, 3);
         return summed(in(x + 2 * y + r), {x, y});
       }},
      {{"tiles: in(x%4 + 4*y, x/4)", QuasiAffine, {12, 3}, {12, 3}},
       [](const Func& in) {
         return made(in(x % 4 + 4 * y, x / 4), {x, y});
       }},
      {{"matrix product: sum in(k, y) b(x, k)", QuasiAffine, {4, 5}, {6, 5}},
       [](const Func& in) {
         RDom k(0, 4);
         return summed(in(k, y) * cast<float>(x + 2 * k + 1), {x, y});
       }},
      {{"triangle: sum in(r, y) where r <= x", QuasiAffine, {6, 4}, {6, 4}},
       [](const Func& in) {
         RDom r(0, 6);
         r.where(r <= x);
         return summed(in(r, y), {x, y});
       }},
      {{"interleave: x%2 ? in(x/2, 1) : in(x/2, 0)", QuasiAffine, {6, 2}, {12}},
       [](const Func& in) {
         return made(select(x % 2 == 0, Expr(in(x / 2, 0)), Expr(in(x / 2, 1))), {x});
       }},
      {{"in((x + 1)/3*2 + x%2)", QuasiAffine, {10}, {12}},
       [](const Func& in) { return made(in((x + 1) / 3 * 2 + x % 2), {x}); }},
      {{"in(-x/2 + 6)", QuasiAffine, {7}, {12}},
       [](const Func& in) { return made(in(-x / 2 + 6), {x}); }},
      {{"in(x + s(y), y)", Determined, {10, 5}, {6, 5}},
       [](const Func& in) {
         return made(in(x + data(y, 4), y), {x, y});
       }},
      {{"in(s(y) - x, y)", Determined, {10, 5}, {6, 5}},
       [](const Func& in) {
         return made(in(data(y, 4) + 5 - x, y), {x, y});
       }},
      {{"in(x, y, s(x, y))", DataDependent, {6, 5, 9}, {6, 5}},
       [](const Func& in) {
         return made(in(x, y, data(x + 6 * y, 9)), {x, y});
       }},
      {{"in(s(x), y)", DataDependent, {6, 5}, {8, 5}},
       [](const Func& in) {
         return made(in(data(x, 6), y), {x, y});
       }},
      {{"in(s(x))", DataDependent, {6}, {12}},
       [](const Func& in) { return made(in(data(x, 6)), {x}); }},
  };
}

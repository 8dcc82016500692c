// Code that both sides of the table share, in the language (Halide or Retrograde) that is visible where this file is
// included. The including side defines `adjoint_of`, `depends_on_reduction` and `iterations_of`.

static Region region_of(const std::vector<int>& extents) {
  Region region;
  for (int n : extents) region.push_back({0, n});
  return region;
}

// in(...) is the image; elements outside of it are never read.
static Func wrapped(const Buffer<float>& image) {
  Func in("in");
  std::vector<Var> args(static_cast<size_t>(image.dimensions()));
  in(args) = image(std::vector<Expr>(args.begin(), args.end()));
  return in;
}

static Func seed_of(const std::vector<int>& extents) {
  Func seed("seed");
  std::vector<Var> args(extents.size());
  Expr number = 0;
  int stride = 1;
  for (size_t d = 0; d < extents.size(); ++d) {
    number = number + args[d] * stride;
    stride *= extents[d];
  }
  // Zero outside of the output, because Halide 14 reads the seed there.
  Expr inside = cast<bool>(1);
  for (size_t d = 0; d < extents.size(); ++d)
    inside = inside && args[d] >= 0 && args[d] < extents[d];
  seed(args) = select(inside, cast<float>((37 * number + 11) % 17 - 8), 0.0f);
  return seed;
}

// Also computed on a ring around the input, because Halide 14's scatters write there.
static std::vector<float> realized_on(Func adjoint, const std::vector<int>& extents) {
  const int ring = 16;
  std::vector<int> mins, wide;
  for (int n : extents) {
    mins.push_back(-ring);
    wide.push_back(n + 2 * ring);
  }
  Buffer<float> all(wide);
  all.set_min(mins);
  adjoint.realize(all, jit_target());
  for (size_t d = 0; d < extents.size(); ++d) all.crop(static_cast<int>(d), 0, extents[d]);
  Buffer<float> gradient = all.copy();
  return {gradient.begin(), gradient.end()};
}

static Outcome differentiate(const Pattern& pattern) {
  const Description& d = pattern.description;
  Buffer<float> image(d.input);
  image.fill(1.0f);
  Func in = wrapped(image), out = pattern.build(in);
  Func adjoint = adjoint_of(out, in, seed_of(d.output), region_of(d.output));
  Outcome result;
  if (!adjoint.defined()) {
    result.error = "none";
    return result;
  }
  for (int i = 0; i < adjoint.num_update_definitions(); ++i) {
    UpdateShape shape;
    for (const Expr& index : adjoint.update_args(i))
      shape.is_gather &= !depends_on_reduction(index);
    for (const RVar& r : adjoint.rvars(i)) {
      long n = iterations_of(r);
      shape.iterations = n < 0 || shape.iterations < 0 ? -1 : shape.iterations * n;
    }
    result.updates.push_back(shape);
  }
  result.gradient = realized_on(adjoint, d.input);
  return result;
}

static Outcome differentiate_safely(const Pattern& pattern) {
  try {
    return differentiate(pattern);
  } catch (const std::exception& e) {
    Outcome failed;
    failed.error = e.what();
    return failed;
  }
}

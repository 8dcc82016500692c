// Schedules whose loop nests are compared. Included like common.h.
#pragma once

struct NestCase {
  std::string name;
  std::function<Func()> build;
};

// The two-stage stencil that every case schedules. Names of Funcs created for another Func contain
// its name, and Halide prints none of them when it has a number.
struct Stencil {
  Func f, g;
  Var x{"x"}, y{"y"}, xo{"xo"}, yo{"yo"}, xi{"xi"}, yi{"yi"}, t{"t"};
  explicit Stencil(const std::string& first = "f", const std::string& second = "g")
      : f(first), g(second) {
    f(x, y) = x + y;
    g(x, y) = f(x, y - 1) + f(x, y) + f(x, y + 1);
  }
};

// A reduction in two variables.
struct Sums {
  Func f, g;
  Var x{"x"}, u{"u"};
  RDom r{0, 20, 0, 30, "r"};
  RVar ro{"ro"}, ri{"ri"};
  explicit Sums(const std::string& first = "f") : f(first), g("g") {
    f(x) = 0;
    f(x) += x * r.x + r.y;
    g(x) = f(x) + 1;
  }
};

inline const std::vector<NestCase>& nest_cases() {
  static const std::vector<NestCase> all = {
      {"inlined", [] { return Stencil().g; }},
      {"root",
       [] {
         Stencil s;
         s.f.compute_root();
         return s.g;
       }},
      {"at_a_row",
       [] {
         Stencil s;
         s.f.compute_at(s.g, s.y);
         return s.g;
       }},
      {"at_a_point",
       [] {
         Stencil s;
         s.f.compute_at(s.g, s.x);
         return s.g;
       }},
      {"slid_rows",
       [] {
         Stencil s;
         s.f.store_root().compute_at(s.g, s.y);
         return s.g;
       }},
      {"slid_within_tiles",
       [] {
         Stencil s;
         s.g.tile(s.x, s.y, s.xo, s.yo, s.xi, s.yi, 16, 8);
         s.f.store_at(s.g, s.xo).compute_at(s.g, s.yi);
         return s.g;
       }},
      {"tiles",
       [] {
         Stencil s;
         s.g.tile(s.x, s.y, s.xo, s.yo, s.xi, s.yi, 16, 8).vectorize(s.xi).parallel(s.yo);
         s.f.compute_at(s.g, s.xo).vectorize(s.x, 4).unroll(s.y, 2);
         return s.g;
       }},
      {"vectors",
       [] {
         Stencil s;
         s.f.compute_root().vectorize(s.x, 8);
         s.g.vectorize(s.x, 8).unroll(s.y, 2).parallel(s.y);
         return s.g;
       }},
      {"parallel_chunks",
       [] {
         Stencil s;
         s.g.parallel(s.y, 4);
         return s.g;
       }},
      {"fused",
       [] {
         Stencil s;
         s.g.fuse(s.x, s.y, s.t).vectorize(s.t, 8);
         return s.g;
       }},
      {"renamed_and_split_again",
       [] {
         Stencil s;
         s.g.rename(s.x, s.t)
             .split(s.t, s.xo, s.xi, 8)
             .split(s.xi, s.xi, s.yi, 4)
             .reorder(s.y, s.xo);
         return s.g;
       }},
      {"names_used_again",
       [] {
         Stencil s;
         s.g.split(s.x, s.xo, s.xi, 8).split(s.y, s.x, s.yi, 4).split(s.xo, s.y, s.xo, 2);
         return s.g;
       }},
      {"bounded",
       [] {
         Stencil s;
         s.g.bound(s.x, 0, 16).bound(s.y, 0, 4).unroll(s.y);
         s.f.compute_root();
         return s.g;
       }},
      {"reduction",
       [] {
         Sums s;
         s.f.compute_root();
         return s.g;
       }},
      {"reduction_at_a_point", [] { return Sums().g; }},
      {"reduction_split",
       [] {
         Sums s;
         s.f.compute_root()
             .vectorize(s.x, 4)
             .update()
             .split(s.r.x, s.ro, s.ri, 5)
             .reorder(s.x, s.ri, s.ro, s.r.y);
         return s.g;
       }},
      {"rfactor",
       [] {
         Sums s("total");
         s.f.compute_root();
         s.f.update().rfactor(s.r.y, s.u).compute_root().parallel(s.u).update().parallel(s.u);
         return s.g;
       }},
      {"two_stored_at_one_level",
       [] {
         Stencil s;
         Func h("h");
         h(s.x, s.y) = s.g(s.x, s.y) + s.f(s.x, s.y);
         s.f.store_root().compute_at(h, s.y);
         s.g.store_root().compute_at(h, s.y);
         return h;
       }},
      {"folded_by_hand",
       [] {
         Stencil s;
         s.f.store_root().compute_at(s.g, s.y).fold_storage(s.y, 4);
         return s.g;
       }},
      {"wrapper",
       [] {
         Stencil s("image", "blurred");
         s.f.compute_root();
         s.f.in(s.g).compute_at(s.g, s.y);
         return s.g;
       }},
  };
  return all;
}

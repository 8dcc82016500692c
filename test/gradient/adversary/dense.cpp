// Checks complete derivative matrices against one product for each column: the Jacobian of the output by an image, by
// columns and by rows, and the Hessian of the weighted output, whose diagonal is also computed alone.
#include <cmath>
#include <ctime>

#include "autodiff/jacobian.h"
#include "autodiff/second_order.h"
#include "diagnostics/error.h"
#include "gradient/adversary/probe.h"

namespace retrograde::gradient {

namespace {

constexpr std::clock_t longest = 3 * CLOCKS_PER_SEC;  // time limit for the columns of one matrix

// The product of two regions: the dimensions of `a`, then those of `b`.
oracle::Region joined(const oracle::Region& a, const oracle::Region& b) {
  oracle::Region result = a;
  result.mins.insert(result.mins.end(), b.mins.begin(), b.mins.end());
  result.extents.insert(result.extents.end(), b.extents.begin(), b.extents.end());
  return result;
}

class Dense {
 public:
  Dense(Subject& s, size_t image)
      : s_(s),
        input_(s.program.image(image)),
        columns_(oracle::region_of(*s.program.images[image].raw_buffer())),
        unit_(columns_.extents, "unit") {
    unit_.set_min(columns_.mins);
    unit_.fill(0.0f);
  }

  void compare_jacobian() {
    const Func& output = s_.program.output();
    const Func column = propagate_tangents(output, {{input_, unit_}})(output);
    const auto dense = [&](Compression c) {
      return jacobian(output, input_, s_.first().bounds(), {.compression = c}).dense();
    };
    compare("Jacobian", dense(Compression::Auto), column, s_.program.region());
    for (Compression forced : {Compression::Columns, Compression::Rows}) {
      Func matrix;
      try {
        matrix = dense(forced);
      } catch (const UserError&) {  // one of the two modes has no rule for it
        continue;
      } catch (const Unsupported&) {
        continue;
      }
      compare("Jacobian by force", matrix, column, s_.program.region());
    }
  }

  void compare_hessian() {
    Func loss("loss");
    const std::vector<Buffer<float>>& w = s_.first().w;
    const Region bounds = s_.first().bounds();
    RDom r;
    if (!bounds.empty()) r = RDom(bounds);
    std::vector<Expr> at;
    for (size_t d = 0; d < bounds.size(); ++d) at.push_back(r[static_cast<int>(d)]);
    loss() = cast<double>(0.0f);
    for (size_t k = 0; k < w.size(); ++k) {
      const Expr e = s_.program.output()(at).element(static_cast<int>(k));
      if (e.type().is_float()) loss() += cast<double>(e) * cast<double>(w[k](at));
    }
    const Func dense = hessian(loss, input_).dense();
    const Func column = hessian_vector_product(loss, input_, {{input_, unit_}});
    compare("Hessian", dense, column, columns_);
    compare_diagonal(dense, hessian_diagonal(loss, input_).diagonal);
  }

 private:
  // Compares matrix(y, x) with column(y), which has 1 at x as its direction.
  void compare(const char* what, const Func& matrix, const Func& column,
               const oracle::Region& rows) {
    if (!matrix.defined() || !column.defined()) return;
    const auto all = evaluate(matrix, joined(rows, columns_));
    const std::clock_t start = std::clock();
    columns_.for_each([&](const std::vector<int>& x) {
      if (std::clock() - start > longest) return;
      set_unit(x, 1);
      const auto one = evaluate(column, rows);
      set_unit(x, 0);
      for (size_t k = 0; k < one.size(); ++k) compare_column(what, all[k], one[k], x);
    });
  }
  void compare_column(const char* what, const oracle::Array& all, const oracle::Array& one,
                      const std::vector<int>& x) {
    one.region.for_each([&](const std::vector<int>& y) {
      std::vector<int> at = y;
      at.insert(at.end(), x.begin(), x.end());
      compare_entry(what, all.at(at), one.at(y));
    });
  }
  void compare_entry(const char* what, const oracle::Value& a, const oracle::Value& b) {
    const double found = as_double(a), expected = as_double(b);
    if (!std::isfinite(found) || !std::isfinite(expected)) return;
    if (std::abs(found - expected) <= 1e-9 * (std::abs(expected) + 1 + s_.largest)) return;
    decide(Judgement::Wrong,
           text("an entry of the ", what, " is ", found, " and should be ", expected));
  }
  void compare_diagonal(const Func& matrix, const Func& diagonal) {
    if (!matrix.defined() || !diagonal.defined()) return;
    const auto all = evaluate(matrix, joined(columns_, columns_)),
               alone = evaluate(diagonal, columns_);
    for (size_t k = 0; k < alone.size(); ++k) {
      columns_.for_each([&](const std::vector<int>& x) {
        compare_entry("diagonal of the Hessian", alone[k].at(x),
                      all[k].at(joined({x, x}, {x, x}).mins));
      });
    }
  }
  void set_unit(const std::vector<int>& x, float value) {
    unit_.get()->operator()(x.data()) = value;
  }

  Subject& s_;
  AdjointInput input_;
  const oracle::Region columns_;
  Buffer<float> unit_;
};

}  // namespace

void compare_dense(Subject& s) {
  Dense dense(s, static_cast<size_t>(s.weights.below(static_cast<int>(s.program.images.size()))));
  dense.compare_jacobian();
  dense.compare_hessian();
}

}  // namespace retrograde::gradient

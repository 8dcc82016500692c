// transpose_loads -- read the columns of a block by rows, and transpose them in registers.
// In:  Vector.
// Out: Vector; the same stores; the same elements are read.
//
//   out[ramp(a, 1, 4)] = in[ramp(b, 64, 4)]            let t = interleave(in[ramp(b, 1, 4)],
//   out[ramp(a + n, 1, 4)] = in[ramp(b + 1, 64, 4)] =>     in[ramp(b + 64, 1, 4)], ...)
//   out[ramp(a + 2n, 1, 4)] = in[ramp(b + 2, 64, 4)]   out[ramp(a, 1, 4)] = lanes 0 ... 3 of t
//   out[ramp(a + 3n, 1, 4)] = in[ramp(b + 3, 64, 4)]   ...
//
// Method: per run of neighbouring stores, looking through the lets around each. Columns are loads of a buffer that the
//         run does not store to, with one constant stride and a power of two lanes, whose bases go up by one. A
//         block takes the largest power of two of columns, at least min_columns. The interleaved rows hold the
//         columns one after the other.
// Not done: strides up to 4, which deinterleave_loads handles; strides unknown until run time.
// Source: folklore. Tests: test/golden/lower/transpose_loads/, loop_passes_test.
#include "lower/statement_passes.h"

#include <map>
#include <numeric>
#include <unordered_map>
#include <unordered_set>

#include "ir/build.h"
#include "ir/memory_reads.h"
#include "ir/visit.h"
#include "lower/nests/copy_statement.h"
#include "lower/statement_rewriter.h"
#include "lower/vectors/strided_loads.h"

namespace retrograde::lower {

namespace {

constexpr int64_t min_stride = 5;
constexpr size_t min_columns = 4, max_columns = 16;

bool is_power_of_two(int64_t n) { return n > 0 && (n & (n - 1)) == 0; }

// Neighbouring stores, each with its lets.
struct Run {
  std::vector<Stmt> stmts;
  std::vector<StridedLoad> columns;  // with the lets around the store substituted in their bases
  std::unordered_set<std::string> stored;
};

// Adds the statement to the run; false if it is not a store.
bool joins(Run& run, const Stmt& s) {
  Substitution lets;
  std::unordered_set<std::string> inside;  // names whose values are not known before the run
  Stmt inner = s;
  while (const auto* let = inner.as<LetStmt>()) {
    const bool is_plain = let->value.type().is_scalar() &&
                          !reads_memory(let->value, MemoryReads::Calls) &&
                          !uses_any_variable(let->value, inside);
    if (is_plain) {
      lets[let->name] = substitute(let->value, lets);
    } else {
      inside.insert(let->name);
    }
    inner = let->body;
  }
  const auto* store = inner.as<Store>();
  if (!store) return false;
  run.stmts.push_back(s);
  run.stored.insert(store->name);
  walk(store->value, [&](const Expr& e) {
    auto load = as_strided(e);
    if (load && load->stride >= min_stride && is_power_of_two(e.type().lanes())) {
      load->base = substitute(load->base, lets);
      if (!reads_memory(load->base, MemoryReads::Calls) && !uses_any_variable(load->base, inside))
        run.columns.push_back(*load);
    }
    return e.kind() != Kind::Let && !as_op(e, Op::if_then_else);
  });
  return true;
}

std::vector<StridedFamily> find_families(const Run& run) {
  std::vector<StridedFamily> families;
  for (const StridedLoad& column : run.columns) {
    if (!run.stored.count(column.node().name)) add_to_family(column, families);
  }
  return families;
}

using Replacements = std::unordered_map<const ExprNode*, Expr>;

class Transposer {
 public:
  explicit Transposer(const Stmt& s) : fresh_(s) {}

  Stmt transposed(const Block& block) {
    std::vector<Stmt> result;
    Run run;
    for (const Stmt& part : block.stmts) {
      if (joins(run, part)) continue;
      if (!run.stmts.empty()) result.push_back(transposed(run));
      run = {};
      result.push_back(part);
    }
    if (!run.stmts.empty()) result.push_back(transposed(run));
    return make_block(std::move(result));
  }

 private:
  using Columns = std::map<int64_t, std::vector<Expr>>;  // by offset from the family's base

  Stmt transposed(const Run& run) {
    Lets blocks;
    Replacements replacements;
    for (const StridedFamily& family : find_families(run)) add_blocks(family, blocks, replacements);
    const Stmt stores = make_block(run.stmts);
    if (blocks.empty()) return stores;
    return make_lets(blocks, ir::rewrite(stores, [&](const Expr& e, const auto&) {
                       return value_or(replacements, e.get(), {});
                     }));
  }

  // Splits neighbouring columns into blocks, from the left, with powers of two as widths.
  void add_blocks(const StridedFamily& family, Lets& blocks, Replacements& replacements) {
    Columns columns;
    for (const StridedLoad& load : family) columns[load.offset].push_back(load.load);
    auto at = columns.begin();
    while (at != columns.end()) {
      size_t count = 1;
      auto end = std::next(at);
      while (end != columns.end() && count < max_columns &&
             end->first == at->first + static_cast<int64_t>(count)) {
        ++count;
        ++end;
      }
      while (!is_power_of_two(static_cast<int64_t>(count))) --count;
      if (count >= min_columns) add_block(family[0], columns, at, count, blocks, replacements);
      std::advance(at, count);
    }
  }

  void add_block(const StridedLoad& family, const Columns& columns, Columns::const_iterator first,
                 size_t count, Lets& blocks, Replacements& replacements) {
    const Load& model = family.node();
    const int height = model.type.lanes(), width = static_cast<int>(count);
    const Type index_type = family.base.type();
    std::vector<Expr> rows;
    for (int row = 0; row < height; ++row) {
      const Expr base = binary(Kind::Add, family.base,
                               make_const(index_type, first->first + row * family.stride));
      rows.push_back(make_load(model.type.with_lanes(width), model.name,
                               make_ramp(base, make_one(index_type), width), {}, model.symbol));
    }
    const Expr block = make_interleaved(rows);
    blocks.emplace_back(fresh_(model.name + ".block"), block);
    const Expr whole = variable(blocks.back().first, block.type());
    for (int column = 0; column < width; ++column) {
      std::vector<int> lanes(static_cast<size_t>(height));
      std::iota(lanes.begin(), lanes.end(), column * height);
      const Expr part = make_shuffle({whole}, std::move(lanes));
      for (const Expr& load : columns.at(first->first + column)) replacements[load.get()] = part;
    }
  }

  FreshNames fresh_;
};

}  // namespace

Stmt transpose_loads(const Stmt& s) {
  if (!s.defined()) return s;
  Transposer transposer(s);
  return rewrite_statements(s, [&](const Stmt& part, auto& all) {
    const Stmt inner = all.children(part);
    const auto* block = inner.as<Block>();
    return block ? transposer.transposed(*block) : inner;
  });
}

}  // namespace retrograde::lower

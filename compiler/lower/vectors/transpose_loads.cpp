// transpose_loads -- read the columns of a block by its rows, and transpose in registers.
// In:  Vector.
// Out: Vector; the same stores; the same elements are read.
//
//   out[ramp(a, 1, 4)] = in[ramp(b, 64, 4)]            let t = interleave(in[ramp(b, 1, 4)],
//   out[ramp(a + n, 1, 4)] = in[ramp(b + 1, 64, 4)] =>     in[ramp(b + 64, 1, 4)], ...)
//   out[ramp(a + 2n, 1, 4)] = in[ramp(b + 2, 64, 4)]   out[ramp(a, 1, 4)] = lanes 0 ... 3 of t
//   out[ramp(a + 3n, 1, 4)] = in[ramp(b + 3, 64, 4)]   ...
//
// Method: per run of neighbouring stores, looking through the lets around each. Loads of a buffer
//         that the run does not store to, with one constant stride and a power of two lanes, whose
//         bases go up by one, are the columns; as many as the largest power of two there is, and
//         not fewer than min_columns. Interleaved, the rows are the columns one after the other.
// Not done: strides up to 4, which deinterleave_loads shares; strides unknown until run time.
// Source: folklore. Tests: test/golden/lower/transpose_loads/, loop_passes_test.
#include "lower/statement_passes.h"

#include <map>
#include <numeric>
#include <optional>
#include <unordered_map>
#include <unordered_set>

#include "ir/build.h"
#include "ir/memory_reads.h"
#include "ir/visit.h"
#include "lower/nests/copy_statement.h"
#include "lower/statement_rewriter.h"
#include "simplify/simplify.h"

namespace retrograde::ir {

namespace {

constexpr int64_t min_stride = 5;
constexpr size_t min_columns = 4, max_columns = 16;

bool is_power_of_two(int64_t n) { return n > 0 && (n & (n - 1)) == 0; }

struct Column {
  Expr load;
  Expr base;  // with the lets around the store substituted
};

// Loads of one buffer with one stride and number of lanes, by their distance from the first.
struct Family {
  const Load* first;
  int64_t stride;
  Expr base;
  std::map<int64_t, std::vector<Expr>> columns;
};

// Stores one after the other, with the lets around each.
struct Run {
  std::vector<Stmt> stmts;
  std::vector<Column> columns;
  std::unordered_set<std::string> stored;
};

std::optional<int64_t> stride_of(const Load& load) {
  const auto* ramp = load.predicate.defined() ? nullptr : load.index.as<Ramp>();
  if (!ramp || !ramp->base.type().is_scalar() || !is_power_of_two(ramp->lanes)) return std::nullopt;
  const auto stride = as_const_int(ramp->stride);
  return stride && *stride >= min_stride ? stride : std::nullopt;
}

// Adds the statement to the run, unless it is no store.
bool joins(Run& run, const Stmt& s) {
  Substitution lets;
  std::unordered_set<std::string> inside;  // cannot be known before the run
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
    const auto* load = e.as<Load>();
    if (load && stride_of(*load)) {
      const Expr base = substitute(load->index.as<Ramp>()->base, lets);
      if (!reads_memory(base, MemoryReads::Calls) && !uses_any_variable(base, inside))
        run.columns.push_back({e, base});
    }
    const auto* call = e.as<Call>();
    return e.kind() != Kind::Let && !(call && call->is_op(Op::if_then_else));
  });
  return true;
}

std::vector<Family> find_families(const Run& run) {
  std::vector<Family> families;
  const auto join = [](Family& family, const Load& load, const Column& column) {
    const bool is_alike = family.first->name == load.name && family.first->type == load.type &&
                          family.stride == stride_of(load);
    if (!is_alike) return false;
    const auto distance = as_const_int(simplify(binary(Kind::Sub, column.base, family.base)));
    if (distance) family.columns[*distance].push_back(column.load);
    return distance.has_value();
  };
  for (const Column& column : run.columns) {
    const auto* load = column.load.as<Load>();
    if (run.stored.count(load->name)) continue;
    bool is_taken = false;
    for (size_t i = 0; i < families.size() && !is_taken; ++i)
      is_taken = join(families[i], *load, column);
    if (!is_taken) families.push_back({load, *stride_of(*load), column.base, {{0, {column.load}}}});
  }
  return families;
}

class Replacer : public Rewriter {
 public:
  std::unordered_map<const ExprNode*, Expr> replacements;

 protected:
  Expr rewrite(const Expr& e) override {
    const auto found = replacements.find(e.get());
    return found == replacements.end() ? children(e) : found->second;
  }
};

class Transposer : public StatementRewriter {
 public:
  explicit Transposer(const Stmt& s) : fresh_(s) {}

 protected:
  Stmt rewrite(const Stmt& s) override {
    const Stmt copy = children(s);
    const auto* block = copy.as<Block>();
    if (!block) return copy;
    std::vector<Stmt> result;
    Run run;
    for (const Stmt& part : block->stmts) {
      if (joins(run, part)) continue;
      if (!run.stmts.empty()) result.push_back(transposed(run));
      run = {};
      result.push_back(part);
    }
    if (!run.stmts.empty()) result.push_back(transposed(run));
    return make_block(std::move(result));
  }

 private:
  Stmt transposed(const Run& run) {
    Lets blocks;
    Replacer replacer;
    for (const Family& family : find_families(run)) add_blocks(family, blocks, replacer);
    const Stmt stores = make_block(run.stmts);
    return blocks.empty() ? stores : make_lets(blocks, replacer(stores));
  }

  // Columns side by side, taken from the left in powers of two.
  void add_blocks(const Family& family, Lets& blocks, Replacer& replacer) {
    auto at = family.columns.begin();
    while (at != family.columns.end()) {
      size_t count = 1;
      auto end = std::next(at);
      while (end != family.columns.end() && count < max_columns &&
             end->first == at->first + static_cast<int64_t>(count)) {
        ++count;
        ++end;
      }
      while (!is_power_of_two(static_cast<int64_t>(count))) --count;
      if (count >= min_columns) add_block(family, at->first, count, blocks, replacer);
      std::advance(at, count);
    }
  }

  void add_block(const Family& family, int64_t first, size_t count, Lets& blocks,
                 Replacer& replacer) {
    const Load& model = *family.first;
    const int height = model.type.lanes(), width = static_cast<int>(count);
    const Type index_type = family.base.type();
    std::vector<Expr> rows;
    for (int row = 0; row < height; ++row) {
      const Expr base =
          binary(Kind::Add, family.base, make_const(index_type, first + row * family.stride));
      rows.push_back(make_load(model.type.with_lanes(width), model.name,
                               make_ramp(base, make_one(index_type), width), {}, model.symbol));
    }
    std::vector<int> order;
    for (int i = 0; i < width * height; ++i) order.push_back(i % height * width + i / height);
    const Expr block = make_shuffle(std::move(rows), std::move(order));
    blocks.emplace_back(fresh_(model.name + ".block"), block);
    const Expr whole = variable(blocks.back().first, block.type());
    for (int column = 0; column < width; ++column) {
      std::vector<int> lanes(static_cast<size_t>(height));
      std::iota(lanes.begin(), lanes.end(), column * height);
      const Expr part = make_shuffle({whole}, std::move(lanes));
      for (const Expr& load : family.columns.at(first + column))
        replacer.replacements[load.get()] = part;
    }
  }

  FreshNames fresh_;
};

}  // namespace

Stmt transpose_loads(const Stmt& s) { return s.defined() ? Transposer(s)(s) : s; }

}  // namespace retrograde::ir

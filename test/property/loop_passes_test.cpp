// Tests the passes over loops and memory on random loop nests: run before and after a pass, the nest must leave the
// same buffers and print the same. A failure prints its seed.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <iterator>
#include <map>
#include <random>
#include <set>
#include <utility>

#include "ir/validate.h"
#include "lower/statement_passes.h"
#include "lower/vectors/vectorize_inner_loops.h"
#include "property/statement_evaluator.h"

namespace retrograde::lower {
namespace {

constexpr int width = 24, height = 6,
              margin = 40;  // of the image; the buffers have a margin on both sides

// Generates programs whose iterations are independent, except for reductions.
class RandomProgram {
 public:
  explicit RandomProgram(unsigned seed) : random_(seed) {}

  Stmt make() {
    std::vector<Stmt> nests;
    for (int i = number(1, 2); i > 0; --i) nests.push_back(nest());
    if (number(0, 3) == 0) nests.push_back(row_of_storage());
    return make_block(std::move(nests));
  }

 private:
  std::mt19937 random_;
  int names_ = 0;
  std::vector<Expr> coordinates_;  // in scope: loop variables and lets over them

  int number(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }
  bool flip() { return number(0, 1) == 1; }
  std::string name(const char* base) { return std::string(base) + std::to_string(names_++); }
  Expr any_coordinate() {
    return coordinates_[number(0, static_cast<int>(coordinates_.size()) - 1)];
  }

  ForType loop_type() {
    static constexpr ForType types[] = {ForType::Serial, ForType::Parallel, ForType::Vectorized,
                                        ForType::Unrolled};
    return types[number(0, 3)];
  }

  // Loops over y outside and x inside, the latter possibly split into blocks with a guard or shifted inwards.
  Stmt nest() {
    coordinates_.clear();
    Expr y = variable(name("y")), x = variable(name("x"));
    std::string y_name = y.as<Variable>()->name, x_name = x.as<Variable>()->name;
    ForType y_type = flip() ? ForType::Serial : loop_type();
    bool is_split = flip();
    coordinates_ = {y};
    if (!is_split) {
      coordinates_.push_back(x);
      ForType type = loop_type();
      bool needs_constant = type == ForType::Vectorized || type == ForType::Unrolled;
      Expr extent = needs_constant || flip() ? Expr(number(1, 9)) : variable("w");
      Stmt loop =
          make_for(x_name, flip() ? Expr(0) : variable("x_min"), extent, type, body(x, y, 2));
      return make_for(y_name, 0, number(1, height), y_type, loop);
    }
    Expr xi = variable(name("xi"));
    int factor = number(2, 5);
    bool shifts = flip();
    Expr base = x * factor;
    Expr position = (shifts ? min(likely(base), variable("w") - factor) : base) + xi;
    Expr t = variable(name("t"));
    coordinates_.push_back(t);
    Stmt inside = body(t, y, 2);
    if (!shifts) inside = make_if(likely(t < variable("w")), inside);
    Stmt loop = make_let(t.as<Variable>()->name, position, inside);
    loop = make_for(xi.as<Variable>()->name, 0, factor, loop_type(), loop);
    ForType outer = flip() ? ForType::Serial : ForType::Parallel;
    loop = make_for(x_name, 0, (variable("w") + (factor - 1)) / factor, outer, loop);
    return make_for(y_name, 0, number(1, height), y_type, loop);
  }

  // Rows in a buffer of their own, updated by vectors with a guarded tail, then copied to the output.
  Stmt row_of_storage() {
    coordinates_.clear();
    const std::string row = name("row");
    const Expr y = variable(name("y")), w = variable("w");
    const auto loop = [&](ForType type, int factor, const std::function<Stmt(const Expr&)>& store) {
      const Expr x = variable(name("x")), xi = variable(name("xi"));
      const Expr t = x * factor + xi;
      coordinates_ = {x, y};
      const Stmt inner =
          make_for(xi.as<Variable>()->name, 0, factor, type, make_if(likely(t < w), store(t)));
      return make_for(x.as<Variable>()->name, 0, (w + (factor - 1)) / factor, ForType::Serial,
                      inner);
    };
    const auto old = [&](const Expr& t) { return make_load(Int(32), row, t); };
    const Stmt rows = make_block(
        {loop(ForType::Serial, 1, [&](const Expr& t) { return make_store(row, value(1), t); }),
         loop(ForType::Vectorized, number(2, 8),
              [&](const Expr& t) { return make_store(row, old(t) + value(1), t); }),
         loop(ForType::Vectorized, 4,
              [&](const Expr& t) { return make_store(row, max(value(1), old(t)), t); }),
         loop(ForType::Serial, 1,
              [&](const Expr& t) { return make_store("a", old(t), t + y * width + margin); })});
    const Expr elements = flip() ? Expr(make_const(Int(64), 3 * width)) : cast(Int(64), w);
    return make_for(y.as<Variable>()->name, 0, number(1, height), ForType::Serial,
                    make_allocate(row, Int(32), MemoryType::Auto, elements, rows));
  }

  // Writes only elements that belong to (x, y).
  Stmt body(const Expr& x, const Expr& y, int depth) {
    std::vector<Stmt> stmts;
    for (int i = number(1, 2); i > 0; --i) stmts.push_back(statement(x, y, depth));
    return make_block(std::move(stmts));
  }

  Stmt statement(const Expr& x, const Expr& y, int depth) {
    switch (depth == 0 ? number(0, 1) : number(0, 11)) {
      case 0:
      case 1:
        return make_store(flip() ? "a" : "b", value(2), x + y * width + margin);
      case 2: {  // a reduction over x (with f.s == out[y] in memory)
        Expr index = y + margin;
        Expr old = make_load(Int(32), "s", index);
        Expr g = value(1);
        Expr sums[] = {old + g, g + old, (old - g) + value(1), old - g};
        return make_store("s", sums[number(0, 3)], index);
      }
      case 3: {  // keeps two values together, as argmax does
        Expr index = y + margin;
        Expr g = value(1), best = make_load(Int(32), "m", index);
        Expr t = variable(name("better"), Bool());
        Stmt stores =
            make_block({make_store("m", make_select(t, g, best), index),
                        make_store("p", make_select(t, x, make_load(Int(32), "p", index)), index)});
        return make_let(t.as<Variable>()->name, g > best, stores);
      }
      case 4: {
        Expr c = condition();
        if (flip()) c = likely(c);
        return make_if(c, body(x, y, depth - 1), flip() ? body(x, y, depth - 1) : Stmt());
      }
      case 5: {
        Expr t = variable(name("let"));
        Expr v = flip() ? position() : value(1);
        coordinates_.push_back(t);
        Stmt rest = body(x, y, depth - 1);
        coordinates_.pop_back();
        return make_let(t.as<Variable>()->name, v, rest);
      }
      case 6:
        return scratch(x, y);
      case 9: {  // neighbours in memory
        Expr index = (x + y * width) * 2 + margin;
        return make_block({make_store("d", value(2), index + 1), make_store("d", value(1), index)});
      }
      case 11:
        return summed_blocks(y);
      case 7:
        return make_evaluate(call_op(Op::print, {value(1)}));
      case 8: {  // extent may vary
        Expr r = variable(name("r"));
        bool is_constant = flip();
        Expr extent = is_constant ? Expr(number(1, 4)) : max(position() % 4, 0);
        ForType type = is_constant && flip() ? ForType::Unrolled : ForType::Serial;
        coordinates_.push_back(r);
        Expr index = x + y * width + margin;
        Stmt sum = make_store("a", make_load(Int(32), "a", index) + value(1), index);
        coordinates_.pop_back();
        return make_for(r.as<Variable>()->name, number(-1, 1), extent, type, sum);
      }
      default:  // reads only where it may
        return make_if(
            x >= 3 && x < 10,
            make_store("b", make_load(Int(32), "tight", x - 3) + value(1), x + y * width + margin));
    }
  }

  // A reduction over blocks of lanes, whose sums may pass through several loops.
  Stmt summed_blocks(const Expr& y) {
    const Expr block = variable(name("block")), lane = variable(name("lane"));
    coordinates_.push_back(block);
    coordinates_.push_back(lane);
    const Expr index = y + margin, old = make_load(Int(32), "s", index), g = value(1);
    const Expr sums[] = {old + g, old - g, min(old, g), old + g - value(1)};
    const int kind = number(0, 3);
    Stmt sum = make_store(kind == 2 ? "m" : "s",
                          kind == 2 ? min(make_load(Int(32), "m", index), g) : sums[kind], index);
    if (number(0, 3) == 0) sum = make_if(condition(), sum);
    coordinates_.resize(coordinates_.size() - 2);
    sum = make_for(lane.as<Variable>()->name, block * 2, number(2, 5), ForType::Vectorized, sum);
    if (number(0, 2) == 0) sum = make_if(condition(), sum);
    const Expr extent = flip() ? Expr(number(1, 3)) : variable("w") - 5;
    return make_for(block.as<Variable>()->name, 0, extent, ForType::Serial, sum);
  }

  // A buffer that lives for one iteration.
  Stmt scratch(const Expr& x, const Expr& y) {
    std::string buffer = name("scratch");
    Expr k = variable(name("k"));
    coordinates_.push_back(k);
    Stmt fill =
        make_for(k.as<Variable>()->name, 0, 3, flip() ? ForType::Serial : ForType::Vectorized,
                 make_store(buffer, value(1), k));
    coordinates_.pop_back();
    Stmt use = make_store(
        "b", make_load(Int(32), buffer, 0) + make_load(Int(32), buffer, any_coordinate() % 3),
        x + y * width + margin);
    return make_allocate(buffer, Int(32), MemoryType::Auto, make_const(Int(64), 3),
                         make_block({fill, use}));
  }

  Expr position() { return any_coordinate() + number(-4, 4); }

  Expr condition() {
    Expr a = position();
    switch (number(0, 4)) {
      case 0:
        return a < variable("w") - 2;
      case 1:
        return a >= 2;
      case 2:
        return a >= 1 && any_coordinate() < 4;
      case 3:
        return value(0) % 2 == 0;
      default:
        return a <= any_coordinate() + 1;
    }
  }

  Expr read() {
    Expr at = position();
    Expr last = flip() ? Expr(width - 1) : variable("w") - 1;
    switch (number(0, 5)) {
      case 4:  // alternates between neighbours
        return make_load(Int(32), "in", (any_coordinate() + number(0, 1)) / number(2, 3) % width);
      case 5: {  // beside each other
        Expr even = clamp(likely(position()), 0, width / 2 - 1) * 2;
        return make_load(Int(32), "in", even) - make_load(Int(32), "in", even + 1) * 2;
      }
      case 0:
        return make_load(Int(32), "in", clamp(likely(at), 0, last));
      case 1:
        return make_load(Int(32), "in", max(min(at, last), 0));
      case 2: {
        Expr outside = at < 0 || at > last;
        Expr inside_value = make_load(Int(32), "in", clamp(at, 0, last));
        return make_select(outside, Expr(-1), likely(inside_value));
      }
      default:
        return make_load(Int(32), "in", max(likely_if_innermost(at), 0) % width);
    }
  }
  static Expr likely_if_innermost(const Expr& e) { return call_op(Op::likely_if_innermost, {e}); }

  Expr value(int depth) {
    if (depth == 0) return flip() ? read() : any_coordinate();
    Expr a = value(depth - 1), b = value(0);
    switch (number(0, 8)) {
      case 0:
        return a + b;
      case 1:
        return a - b * 2;
      case 2:
        return min(a, b) % 64;
      case 3:
        return make_select(a < b, b, a % 32);
      case 4:
        return (a % 8) * (b % 8);
      case 5: {  // the arm may be read only where the condition holds, although its address does
                 // not vary with x
        Expr low = coordinates_[0] % 2;
        Expr c = low == 0 && a < b;
        return call_op(Op::if_then_else, Int(32),
                       {c, make_load(Int(32), "tight", 6 + 5 * low) + read(), b});
      }
      case 6: {
        std::string t = name("e");
        return make_let(t, a, variable(t) + variable(t) % 4 - b);
      }
      case 7:
        return call_extern("first_of", Int(32), {a, b});
      default:
        return cast(Int(32), cast(UInt(8), a)) + b;
    }
  }
};

struct Outcome {
  std::map<std::string, std::vector<int64_t>> buffers;
  std::vector<int64_t> printed;
  std::string error;
  bool operator==(const Outcome&) const = default;
};

Outcome run(const Stmt& s, int w, int x_min) {
  StatementEvaluator evaluator;
  auto fill = [&](const char* name, int size) {
    std::vector<Scalar>& buffer = evaluator.buffers[name];
    for (int i = 0; i < size; ++i)
      buffer.push_back(Scalar::of_int(Int(32), (i * 37 + 11) % 101 - 40));
  };
  for (const char* name : {"a", "b", "s", "m", "p"}) fill(name, width * height + 2 * margin);
  fill("in", width);
  fill("d", 2 * width * height + 2 * margin);
  fill("tight", 7);
  evaluator.set("w", w);
  evaluator.set("x_min", x_min);
  Outcome outcome;
  try {
    evaluator.run(s);
  } catch (const std::runtime_error& e) {
    outcome.error = e.what();
  }
  for (const auto& [name, buffer] : evaluator.buffers) {
    for (const Scalar& element : buffer) outcome.buffers[name].push_back(element.i);
  }
  outcome.printed = evaluator.printed;
  std::sort(outcome.printed.begin(),
            outcome.printed.end());  // lanes of one statement run before the next statement
  return outcome;
}

const std::vector<std::string> free_names = {"w", "x_min"};

constexpr std::pair<int, int> inputs[] = {{17, 1}, {6, -2}, {width, 0}};  // w, x_min

// A program and its versions after each pass. Often a version equals the previous statement, which then runs only once.
class Comparison {
 public:
  Comparison(unsigned seed, const Stmt& program) : seed_(seed), program_(program) {}

  // Must be called first.
  void run_program() {
    for (const auto& [w, x_min] : inputs) {
      expected_.push_back(run(program_, w, x_min));
      ASSERT_EQ(expected_.back().error, "") << "seed " << seed_ << "\n" << program_;
    }
    same_ = {program_};
  }

  void expect_same(const char* pass, const Stmt& after, Phase phase) {
    ASSERT_NO_THROW(validate(after, phase, pass, free_names)) << "seed " << seed_ << "\n"
                                                              << program_ << "\n=>\n"
                                                              << after;
    if (is_known(after)) return;
    for (size_t i = 0; i < std::size(inputs); ++i) {
      const auto [w, x_min] = inputs[i];
      const Outcome found = run(after, w, x_min);
      ASSERT_EQ(found.error, "") << pass << ", seed " << seed_ << "\n"
                                 << program_ << "\n=>\n"
                                 << after;
      ASSERT_TRUE(expected_[i] == found) << pass << ", seed " << seed_ << ", w " << w << "\n"
                                         << program_ << "\n=>\n"
                                         << after;
    }
    same_.push_back(after);
  }

 private:
  bool is_known(const Stmt& s) const {
    return std::any_of(same_.begin(), same_.end(), [&](const Stmt& t) { return t.same_as(s); });
  }

  unsigned seed_;
  Stmt program_;
  std::vector<Outcome> expected_;  // for each of `inputs`
  std::vector<Stmt> same_;         // computes the same
};

// Whether each buffer is stored to once, and not loaded from.
bool is_surely_independent(const For& loop) {
  std::map<std::string, int> stores;
  std::set<std::string> loads;
  walk(
      loop.body, [&](const Load& load) { loads.insert(load.name); },
      [&](const Store& store) { ++stores[store.name]; });
  return std::all_of(stores.begin(), stores.end(), [&](const auto& entry) {
    return entry.second == 1 && loads.count(entry.first) == 0;
  });
}

class LoopPasses : public testing::TestWithParam<int> {};

TEST_P(LoopPasses, KeepWhatProgramsCompute) {
  constexpr unsigned count = 100;
  int accumulated = 0, changed = 0, widened = 0, blended = 0;
  for (unsigned seed = GetParam() * count; seed < (GetParam() + 1) * count; ++seed) {
    Stmt program = RandomProgram(seed).make();
    ASSERT_NO_THROW(validate(program, Phase::FlatStorage, "generator", free_names))
        << "seed " << seed << "\n"
        << program;
    Comparison programs(seed, program);
    programs.run_program();
    if (HasFatalFailure()) return;
    Stmt partitioned = partition_loops(program);
    programs.expect_same("partition_loops", partitioned, Phase::FlatStorage);
    programs.expect_same("skip_empty_tiles", skip_empty_tiles(program), Phase::FlatStorage);
    programs.expect_same("drop_guarded_clamps alone", drop_guarded_clamps(program),
                         Phase::FlatStorage);
    Stmt guarded = drop_guarded_clamps(partitioned);
    programs.expect_same("drop_guarded_clamps", guarded, Phase::FlatStorage);
    Stmt trimmed = trim_loops(guarded);
    programs.expect_same("trim_loops", trimmed, Phase::FlatStorage);
    changed += !trimmed.same_as(guarded);
    programs.expect_same("trim_loops alone", trim_loops(program), Phase::FlatStorage);
    programs.expect_same("merge_equal_loops", merge_equal_loops(trimmed), Phase::FlatStorage);
    Stmt unrolled = unroll_loops(trimmed);
    programs.expect_same("unroll_loops", unrolled, Phase::FlatStorage);
    programs.expect_same("join_indices", join_indices(unrolled), Phase::FlatStorage);
    Stmt inner = vectorize_inner_loops(unrolled, {8, is_surely_independent});
    programs.expect_same("vectorize_inner_loops", inner, Phase::FlatStorage);
    widened += !inner.same_as(unrolled);
    programs.expect_same("both vectorizers", vectorize_loops(inner), Phase::Vector);
    Stmt vectorized = vectorize_loops(unrolled);
    programs.expect_same("vectorize_loops", vectorized, Phase::Vector);
    programs.expect_same("bound_allocations", bound_allocations(vectorized), Phase::Vector);
    Stmt with_sums = accumulate_vectors(vectorized);
    programs.expect_same("accumulate_vectors", with_sums, Phase::Vector);
    accumulated += !with_sums.same_as(vectorized);
    Stmt with_blends = blend_masked_stores(vectorized);
    programs.expect_same("blend_masked_stores", with_blends, Phase::Vector);
    blended += !with_blends.same_as(vectorized);
    programs.expect_same("interleave_vectors", interleave_vectors(vectorized), Phase::Vector);
    programs.expect_same("deinterleave_loads", deinterleave_loads(vectorized), Phase::Vector);
    programs.expect_same("mask_guarded_loads", mask_guarded_loads(vectorized), Phase::Vector);
    programs.expect_same("transpose_loads", transpose_loads(vectorized), Phase::Vector);
    programs.expect_same("free_early", free_early(vectorized), Phase::Vector);
    programs.expect_same("vectorize_loops alone", vectorize_loops(unroll_loops(program)),
                         Phase::Vector);
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(accumulated, 0) << "no program had a reduction to accumulate";
  EXPECT_GT(blended, 0) << "no program had a masked store into storage of its own";
  EXPECT_GT(widened, 0) << "no program had an inner loop for vectors";
  EXPECT_GT(changed, 0) << "no program had a loop to trim";
}

INSTANTIATE_TEST_SUITE_P(Seeds, LoopPasses, testing::Range(0, 8));

}  // namespace
}  // namespace retrograde::lower
